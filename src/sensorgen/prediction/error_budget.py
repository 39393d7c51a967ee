"""How wrong a prediction may be, term by term: whatever is not known is moved to its ends, and all computed anew.

Terms are ``cell`` (bounds of the capacitance), ``compression`` (the law's own error), ``boundary`` (how the cell is
held and touched), ``line`` (sections under the tip), ``tip`` (how its pressure is spread) and one per material value
on which sources disagree. Each is the largest relative change over the tones.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import Design
from sensorgen.design.materials import PIEZORESISTANCE, SET, Material
from sensorgen.design.values import ENDS, MaterialValue, permittivities, piezoresistance
from sensorgen.models.pressure import PROFILES
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.capacitance import capacitance
from sensorgen.prediction.sensor_of_design import Sensed

MEASURES = ("magnitude", "re", "im", "by_force")
MODELS = ("cell", "compression", "boundary", "line", "tip")  # the other terms are materials
_NEAR = 1.01  # ratio of stiffnesses that need not be told apart
_RICHARDSON = 4 / 3  # of what halving changes, where errors fall by four

Shares = dict[str, float]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Term:
    """One thing that is not known.

    Attributes
    ----------
    name, what : str
        Which, and in words what was moved where.
    shares : dict of str to float, or None
        Largest relative change of each of ``MEASURES`` [-]; None where nobody knows.
    at_least : bool
        Whether the change may be larger: a press at one end is beyond what the models bear.
    """

    name: str
    what: str
    shares: Shares | None
    at_least: bool = False

    def size(self, measure: str) -> float:
        """Its share, infinite where nobody knows how large it may be."""
        return inf if self.shares is None or self.at_least else self.shares[measure]


def budget(
    design: Design,
    sensed: Sensed,
    frequency_hz: Sequence[float],
    force_n: float,
    position_m: float,
    accuracy: float = inf,
) -> dict[str, Any]:
    """The error budget of a press, as plain data.

    Parameters
    ----------
    design, sensed : Design, Sensed
        As drawn, and its sensor.
    frequency_hz : sequence of float
        Tones [Hz].
    force_n, position_m : float
        The press [N], [m].
    accuracy : float
        Wanted of abs(Z), relative [-].

    Raises
    ------
    OutOfRange
        A press that the sensor cannot take.

    Notes
    -----
    ``total`` adds all terms, as if each were at its worst: bounds do not average out. It is None where a term is not
    known at all, and may be more where one is ``at_least``; such a term is the largest.
    """
    seen = Seen(sensed.sensor, frequency_hz, force_n, position_m)
    terms = [*_models(sensed, seen), *_materials(design, sensed, seen)]
    unknown = any(t.shares is None for t in terms)
    sums = {m: None if unknown else sum((t.shares or {})[m] for t in terms) for m in MEASURES}
    return {
        "press": {"force_n": force_n, "position_m": position_m},
        "terms": [vars(t) for t in terms],
        "total": sums,
        "at_least": any(t.at_least for t in terms),
        "largest": {m: max(terms, key=lambda t: t.size(m)).name for m in MEASURES},
        "accuracy": _verdict(terms, accuracy) if accuracy < inf else None,
    }


def _verdict(terms: Sequence[Term], accuracy: float) -> dict[str, Any]:
    """Whether the models, and everything, meet an accuracy of abs(Z); terms that alone do not."""
    sizes = {t.name: t.size("magnitude") for t in terms}
    return {
        "asked": accuracy,
        "met_by_models": sum(size for name, size in sizes.items() if name in MODELS) <= accuracy,
        "met": sum(sizes.values()) <= accuracy,
        "missed_by": [name for name, size in sizes.items() if size > accuracy],
    }


class Seen:
    """A press as it is predicted, to hold other predictions against.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : sequence of float
        Tones [Hz].
    force_n, position_m : float
        The press [N], [m].

    Raises
    ------
    OutOfRange
        A press that the sensor cannot take.
    """

    def __init__(self, sensor: Sensor, frequency_hz: Sequence[float], force_n: float, position_m: float) -> None:
        self._press = np.asarray(frequency_hz, float), force_n, position_m
        self._z, self._slope = self._read(sensor)

    def _read(self, sensor: Sensor) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        z, by_force, _ = sensor.response(*self._press)
        return z, by_force

    def change(self, *others: Sensor, factor: float = 1.0) -> Shares | None:
        """Largest relative changes over some other sensors; None where one of them cannot take the press."""
        found = dict.fromkeys(MEASURES, 0.0)
        for other in others:
            try:
                z, slope = self._read(other)
            except OutOfRange:
                return None
            parts = (np.abs, np.real, np.imag)
            apart = [_apart(np.asarray(part(z)), np.asarray(part(self._z))) for part in parts]
            apart.append(_apart(slope, self._slope))
            found = {m: max(found[m], factor * value) for m, value in zip(MEASURES, apart, strict=True)}
        return found


def _apart(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Largest relative difference, 0 where both are 0 and inf where only the other is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.max(np.where(one == other, 0.0, np.abs(one - other) / np.abs(other)), initial=0.0))


def _models(sensed: Sensed, seen: Seen) -> Iterator[Term]:
    sensor, law, bounds = sensed.sensor, sensed.law, sensed.unloaded.answer.capacitance_f
    middle = sensor.capacitance_f_per_m / bounds.middle()
    ends = [replace(sensor, capacitance_f_per_m=middle * end) for end in (bounds.lower, bounds.upper)]
    yield Term("cell", f"capacitance between its bounds ({sensed.unloaded.answer.model})", seen.change(*ends))
    others = seen.change(*(replace(sensor, compression=c) for c in law.others)) if law.bounded else None
    why = "the law's own error" if law.bounded else "B.49 knows no gaps: nobody knows how far off it is"
    if law.others and law.others[0].name != law.compression.name:
        why = f"{law.compression.name} or {law.others[0].name}"
    yield Term("compression", why, others)
    if law.held:
        held = seen.change(*(replace(sensor, compression=c) for c in law.held))
        yield Term("boundary", "faces that stick, a stiff tip, or a cell free to widen", held)
    if sensor.profile == UNIFORM:
        yield Term("line", "one section under the tip is exact", seen.change(sensor))
    else:
        finer = seen.change(replace(sensor, pieces=2 * sensor.pieces), factor=_RICHARDSON)
        yield Term("line", f"{sensor.pieces} sections under the tip", finer)
    spread = [replace(sensor, profile=name) for name in PROFILES if name != sensor.profile]
    yield Term("tip", f"pressure spread like {', '.join(s.profile for s in spread)}", seen.change(*spread))


def _materials(design: Design, sensed: Sensed, seen: Seen) -> Iterator[Term]:
    """One term for each value that sources disagree on."""
    sensor = sensed.sensor
    tracks = [_range(*design.slot(f"{end}_electrode"), "resistivity_ohm_m") for end in ENDS]
    if any(low < high for low, high in tracks):
        ends = [replace(sensor, resistivity_ohm_m=(a, b)) for a, b in zip(*tracks, strict=True)]
        yield Term("resistivity", f"of the electrodes, {_said(tracks)} ohm m", seen.change(*ends))
    yield from _piezoresistance(design, sensed, seen)
    yield from _stiffness(design, sensed, seen)
    yield from _permittivity(design, sensed, seen)


def _piezoresistance(design: Design, sensed: Sensed, seen: Seen) -> Iterator[Term]:
    """None where nobody says; a material of which only one of a design's sources speaks may have it in both places."""
    taken, tracks = piezoresistance(design), []
    for end in ENDS:
        material, _ = design.slot(f"{end}_electrode")
        tracks.append(_among(material, taken.get(end, MaterialValue(material.name, PIEZORESISTANCE, 0.0, ""))))
    if any(low < high for low, high in tracks):
        ends = [replace(sensed.sensor, piezoresistance_per_pa=(a, b)) for a, b in zip(*tracks, strict=True)]
        yield Term("piezoresistance", f"of the electrodes, {_said(tracks)} 1/Pa", seen.change(*ends))


def _stiffness(design: Design, sensed: Sensed, seen: Seen) -> Iterator[Term]:
    """All moduli at once: a cell gives way between what it would if all changed as much as those that change most."""
    sensor, used = sensed.sensor, design.used()
    softest, stiffest, said = inf, 0.0, []
    for taken in sensed.law.taken:
        if taken.quantity == "youngs_modulus_pa":
            low, high = _range(design.material(taken.material), used[taken.material], taken.quantity)
            softest, stiffest = min(softest, low / taken.value), max(stiffest, high / taken.value)
            said.append(f"{taken.material} {low / 1e6:g} to {high / 1e6:g} MPa")
    if softest < stiffest:
        borne = _borne(sensor, softest, seen)
        ends = [replace(sensor, compression=sensor.compression.stiffer(factor)) for factor in (borne, stiffest)]
        beyond = f": below {borne:.2g} of it the press is beyond the law of compression" if borne > softest else ""
        yield Term("stiffness", ", ".join(said) + beyond, seen.change(*ends), at_least=borne > softest)


def _borne(sensor: Sensor, softest: float, seen: Seen) -> float:
    """The share of the stiffness from which on a press can be borne: ``softest``, or a per cent above what cannot."""
    law = sensor.compression
    low, high = softest, 1.0
    if seen.change(replace(sensor, compression=law.stiffer(low))):
        return low
    while high / low > _NEAR:
        middle = (low * high) ** 0.5
        bearable = seen.change(replace(sensor, compression=law.stiffer(middle)))
        low, high = (low, middle) if bearable else (middle, high)
    return high


def _permittivity(design: Design, sensed: Sensed, seen: Seen) -> Iterator[Term]:
    """What other permittivities make of the capacitance, by the cheapest model, whose error mostly cancels."""
    known = {t.material: t for t in permittivities(design)}
    values = {name: t.value for name, t in known.items()}
    answer = sensed.unloaded.answer
    scene = sensed.piece.scene
    cheap = answer if answer.wanted == inf else capacitance(scene, values)
    middle = cheap.capacitance_f.middle()
    used, sensor = design.used() | {"air": ""}, sensed.sensor
    for name, taken in known.items():
        low, high = _range(design.material(name), used[name], taken.quantity)
        if low < high:
            others = [values | {name: end} for end in (low, high) if end != taken.value]
            found = [capacitance(scene, other).capacitance_f.middle() for other in others]
            ends = [replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * c / middle) for c in found]
            yield Term(f"permittivity of {name}", f"{low:g} to {high:g}", seen.change(*ends))


def _range(material: Material, source: str, quantity: str) -> tuple[float, float]:
    """Lowest and highest of what its sources say; the user's own value is not doubted."""
    value = material.value(quantity, source)
    return _among(material, MaterialValue(material.name, quantity, value.value, value.source))


def _among(material: Material, taken: MaterialValue) -> tuple[float, float]:
    """Lowest and highest of a value that is taken and of what all sources say."""
    plausible = [v.value for v in material.properties.get(taken.quantity, []) if not v.implausible]
    if taken.source == SET:
        plausible = []
    return min([taken.value, *plausible]), max([taken.value, *plausible])


def _said(tracks: Sequence[tuple[float, float]]) -> str:
    low, high = min(a for a, _ in tracks), max(b for _, b in tracks)
    return f"{low:.3g} to {high:.3g}"
