"""A calibration as it is stored and shown: it holds all that an inversion needs, and what it could not tell."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from math import sqrt
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput
from sensorgen.models.compression import CapacitanceCurve, Plate
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.calibration.fitting import Data, Posterior, calibrated
from sensorgen.prediction.calibration.inversion import OTHERWISE, InvertedPresses, Inverter
from sensorgen.prediction.calibration.materials import TOLD, Link, MaterialEstimate, estimate, source_text
from sensorgen.prediction.calibration.rest import Baseline
from sensorgen.prediction.calibration.specimen import FORCES_N, Presses, SpecimenModel, Spread
from sensorgen.prediction.inference import NORMAL_90, Parameter
from sensorgen.prediction.inverse.estimator import Prior

FOLDS = 5
FEWEST = 10  # presses, with which the others still calibrate


@dataclass(frozen=True)
class Coverage:
    """Presses that were found again from the others.

    Attributes
    ----------
    presses : int
        Number of presses.
    force, position : int
        How many lie in their intervals of 90 %.
    force_width_n, position_width_m : float
        Medians of the intervals' widths [N], [m].
    force_error_n, position_error_m : float
        Root mean squares of median less truth [N], [m].
    """

    presses: int
    force: int
    position: int
    force_width_n: float
    position_width_m: float
    force_error_n: float
    position_error_m: float


def inside(inverted: InvertedPresses, presses: Presses) -> tuple[Mask, Mask]:
    """Masks of the forces and of the positions that lie in their intervals."""
    return tuple(  # type: ignore[return-value]
        (ends[:, 0] <= truth) & (truth <= ends[:, 1])
        for ends, truth in ((inverted.force_90_n, presses.force_n), (inverted.position_90_m, presses.position_m))
    )


def coverage_of(inverted: InvertedPresses, presses: Presses) -> Coverage:
    """Of presses that are known."""
    force, position = inside(inverted, presses)
    return Coverage(
        len(force), int(force.sum()), int(position.sum()), float(np.median(np.ptp(inverted.force_90_n, axis=1))),
        float(np.median(np.ptp(inverted.position_90_m, axis=1))), _rms(inverted.force_n - presses.force_n),
        _rms(inverted.position_m - presses.position_m),
    )  # fmt: skip


def _rms(off: Real) -> float:
    return float(np.sqrt(np.mean(off**2)))


def held_out(
    model: SpecimenModel, data: Data, limit_n: float, step: Callable[[str], None] = lambda _: None
) -> tuple[Coverage, InvertedPresses] | None:  # fmt: skip
    """Coverage of presses held back in turn; None of fewer presses than ``FEWEST``.

    Parameters
    ----------
    model, data
        As of :func:`sensorgen.prediction.calibration.fitting.calibrated`.
    limit_n : float
        Largest force to look for [N].
    step : callable
        Called with what is done next.
    """
    count = len(data.presses.force_n)
    if count < FEWEST:
        return None
    fold = np.arange(count) % FOLDS
    parts = []
    for k in range(FOLDS):
        step(f"held back: part {k + 1} of {FOLDS}")
        known = calibrated(model, data.rows(np.flatnonzero(fold != k)))
        known = replace(known, noise=np.median(data.noise, axis=0))
        parts.append(Inverter(model, known, force_limit_n=limit_n).batch(data.ratio[fold == k]))
    order = np.argsort(np.concatenate([np.flatnonzero(fold == k) for k in range(FOLDS)]), kind="stable")
    inverted = InvertedPresses.joined(parts).rows(order)
    return coverage_of(inverted, data.presses), inverted


SCHEMA = 2
BEYOND = 1.25  # times the largest known force: up to which a press is looked for
_LAWS = {"plate": Plate, "curve": CapacitanceCurve}


@dataclass(frozen=True)
class CalibratedValue:
    """A parameter after calibration, and before."""

    name: Annotated[str, Column("parameter")]
    unit: Annotated[str, Column("unit")]
    value: Annotated[float, Column("median")]
    lower: Annotated[float, Column("5 %")]
    upper: Annotated[float, Column("95 %")]
    before_lower: Annotated[float, Column("before 5 %")]
    before_upper: Annotated[float, Column("before 95 %")]
    by: Annotated[str, Column("known by", about="presses and rest: what the readings say; prediction: what was known")]

    @property
    def has_left(self) -> bool:
        """True if no value of its interval was expected."""
        return self.lower > self.before_upper or self.upper < self.before_lower


@dataclass(frozen=True, eq=False)
class Calibration(Displayed):
    """A specimen's calibration.

    Attributes
    ----------
    specimen, design, design_id : str
        Name of the specimen, name and identity of its design.
    model : SpecimenModel
        What was predicted of it, and how far it may differ.
    posterior : Posterior
        What the presses say.
    force_n : float
        Largest known force [N].
    held_out : Coverage or None
        Of presses held back in turn; None of too few.
    rows : tuple of str
        Recordings and readings of the log that it rests on.
    gain : tuple of complex
        Most probable ln of each tone's gain, phase as its imaginary part [-].
    notes : tuple of str
        What was left out, what is to be doubted.
    links : tuple of Link
        How parameters depend on values of materials.
    rechecked : bool
        Known presses of a later session agreed with it, or mended it.
    """

    specimen: str
    design: str
    design_id: str
    model: SpecimenModel
    posterior: Posterior
    force_n: float
    held_out: Coverage | None
    rows: tuple[str, ...]
    gain: tuple[complex, ...] = ()
    notes: tuple[str, ...] = ()
    links: tuple[Link, ...] = ()
    rechecked: bool = False

    def materials(self) -> list[MaterialEstimate]:
        """Values of the materials that this specimen has, with intervals of 95 %."""
        return [estimate(self.model, self.posterior, link) for link in self.links]

    def departures(self) -> tuple[str, ...]:
        """Remarks on values that no longer lie where they were expected."""
        estimates: dict[str, CalibratedValue | MaterialEstimate] = {
            (f"{one.name} [{one.unit}]" if one.unit else one.name): one for one in self.values()
        }
        estimates |= {f"{one.material} {one.quantity}": one for one in self.materials()}
        return tuple(
            f"{name}: {one.value:.3g} ({one.lower:.3g} to {one.upper:.3g}) has left what was expected, "
            f"{one.before_lower:.3g} to {one.before_upper:.3g}: doubt the design, film (a hole leaks), tip or bench"
            for name, one in estimates.items()
            if one.has_left
        )

    def source(self) -> str:
        """A source of material values, as a design names it: those that the readings tell."""
        return source_text(f"calibration of {self.specimen}, design {self.design}", self.materials())

    @property
    def limit_n(self) -> float:
        """Largest force that an inversion looks for [N]."""
        return BEYOND * self.force_n

    def inverter(self, noise: ArrayLike | None = None, prior: Prior | None = None, limit_n: float = 0.0) -> Inverter:
        """Inverter of readings of this specimen to force and position.

        Parameters
        ----------
        noise : float or (m,) array, optional
            Standard deviation of a ratio's real and imaginary part [-]; that of the calibration if not given.
        prior : Prior, optional
            On force and position.
        limit_n : float
            Largest force to look for [N]; a quarter above the largest known one if 0.
        """
        known = self.posterior
        if noise is not None:
            known = replace(known, noise=np.broadcast_to(noise, known.noise.shape))
        otherwise = OTHERWISE if self.allowance else 0.0
        return Inverter(self.model, known, prior, limit_n or self.limit_n, otherwise=otherwise, session=True)

    @property
    def allowance(self) -> tuple[str, ...]:
        """Allowance of the intervals of the force until known presses of a later session narrow them, in words."""
        if self.rechecked or not self.posterior.presses:
            return ()
        return (
            "lower ends of the force allow for what no reading shows, until 3 to 5 known presses narrow them ("
            "sensorgen calibrate --recheck): a softer film, a wider tip, a hand, a second press",
        )

    @property
    def baseline(self) -> Baseline:
        """The reading at rest that later ones are compared with."""
        return Baseline(self.model, self.posterior, np.array(self.gain) if self.gain else None)

    def values(self) -> list[CalibratedValue]:
        """Parameters in their units."""
        parameters = {one.key: (one, np.eye(len(self.model.names))[k]) for k, one in enumerate(self.model.parameters)}
        rise, _ = parameters["rise"]
        for force, weights in zip(FORCES_N, self.model.law_weights() / rise.spread, strict=True):
            name = f"rise at {force:g} N"  # the rise as a whole, and its deviation at this force
            parameters[name] = replace(rise, key=name), weights
        return [self._value(one, weights) for one, weights in parameters.values()]

    def _value(self, parameter: Parameter, weights: Real) -> CalibratedValue:
        """A parameter by the weights of all in its deviation from the prior's mean."""
        at, before = float(weights @ self.posterior.at), sqrt(weights @ weights)
        sd = sqrt(weights @ self.posterior.covariance @ weights)
        ends = np.array([at, at - NORMAL_90 * sd, at + NORMAL_90 * sd, -NORMAL_90 * before, NORMAL_90 * before])
        middle, lower, upper, *prior = (parameter.shown * parameter.at(ends)).tolist()
        by = "presses and rest" if sd / before < TOLD else "prediction"
        return CalibratedValue(parameter.key, parameter.unit, middle, lower, upper, prior[0], prior[1], by)

    @property
    def unidentified(self) -> tuple[str, ...]:
        """Parameters of which the readings said next to nothing."""
        return tuple(value.name for value in self.values() if value.by == "prediction")

    def document(self) -> Iterator[Part]:
        """Quality of the calibration, its values, and what it could not determine."""
        p, tested = self.posterior, self.held_out
        by = f"{p.presses} known press{'es' * (p.presses != 1)} up to {self.force_n:.3g} N under a tip of "
        by += f"{self.model.sensor.tip_m * 1e3:g} mm and its readings at rest"
        by = by if p.presses else "its readings at rest alone"
        yield f"{self.specimen}, design {self.design}: calibrated by {by}"
        if tested:
            yield (
                f"presses held back in turn, each a mean over a second: {tested.force} of {tested.presses} forces and "
                f"{tested.position} of {tested.presses} positions lie in their 90 % intervals, whose median widths are "
                f"{tested.force_width_n:.3g} N and {tested.position_width_m * 1e3:.3g} mm"
            )
        elif p.presses:
            yield f"not checked on presses held back: that takes {FEWEST} known presses in one calibration"
        else:
            yield "no known press: force and position are as uncertain as predicted, and inversions say so"
        yield (
            f"from press to press the rise scatters by {p.scatter:.2%}, C wanders by {p.wander_c:.2%} and R by "
            f"{p.wander_r:.2%} between a reading at rest and its press"
        )
        yield Table.of("parameters", "", self.values())
        if self.links:
            yield Table.of("materials", "material values of this specimen, 95 %", self.materials())
        if self.gain:
            tones = self.model.frequency_hz.tolist()
            rows = tuple((f / 1e3, 100 * g.real, np.rad2deg(g.imag)) for f, g in zip(tones, self.gain, strict=True))
            yield Table(
                "gain", "gain of each tone that the rest reading asks for; ratios do not depend on it",
                (Column("frequency", "kHz"), Column("gain", "%", digits=2), Column("phase", "°", digits=2)), rows,
            )  # fmt: skip
        if self.unidentified:
            yield f"not identified by these readings: {', '.join(self.unidentified)}"
        yield from (f"note: {note}" for note in self.notes)

    def to_json(self) -> str:
        """As the log keeps it."""
        sensor, p = self.model.sensor, self.posterior
        law = next(name for name, kind in _LAWS.items() if isinstance(sensor.compression, kind))
        data = {
            "schema": SCHEMA, "specimen": self.specimen, "design": self.design, "design_id": self.design_id,
            "sensor": asdict(sensor) | {"compression": {law: asdict(sensor.compression)}},
            "frequency_hz": self.model.frequency_hz.tolist(), "spread": asdict(self.model.spread),
            "parameters": list(self.model.names),
            "posterior": {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(p).items()},
            "force_n": self.force_n, "held_out": asdict(self.held_out) if self.held_out else None,
            "rows": self.rows, "gain": [[g.real, g.imag] for g in self.gain], "notes": self.notes,
            "links": [asdict(link) for link in self.links], "rechecked": self.rechecked,
        }  # fmt: skip
        return json.dumps(data, ensure_ascii=False)

    def shown_json(self, **more: Any) -> str:
        """As JSON shows it: the record, its parameters and its materials' values in their units, and more."""
        own = {"values": [asdict(v) for v in self.values()], "materials": [asdict(v) for v in self.materials()]}
        data = json.loads(self.to_json()) | own | more
        return json.dumps(data, ensure_ascii=False, indent=2) + "\n"


def from_json(text: str) -> Calibration:
    """A calibration out of the log.

    Raises
    ------
    BadInput
        No calibration, or of a schema or parameters that this version does not have.
    """
    try:
        data = json.loads(text)
        if data["schema"] == 1:  # knew recordings alone
            data |= {"schema": SCHEMA, "rows": data["recordings"]}
        if data["schema"] != SCHEMA:
            raise BadInput(f"a calibration of schema {data['schema']!r:.20}; this sensorgen reads {SCHEMA}")
        sensor = dict(data["sensor"])
        ((law, fields),) = sensor.pop("compression").items()
        compression = _LAWS[law](**_frozen(fields))
        model = SpecimenModel(
            Sensor(**_frozen(sensor), compression=compression), np.array(data["frequency_hz"], float),
            Spread(**data["spread"]),
        )  # fmt: skip
        p: dict[str, Any] = _frozen(data["posterior"])
        posterior = Posterior(**p | {k: np.array(p[k], float) for k in ("at", "covariance", "noise")})
        count = len(model.names)
        if data["parameters"] != list(model.names) or posterior.covariance.shape != (count, count):
            raise BadInput("a calibration with other parameters than this sensorgen has: calibrate again")
        return Calibration(
            data["specimen"], data["design"], data["design_id"], model, posterior, float(data["force_n"]),
            Coverage(**data["held_out"]) if data["held_out"] else None, tuple(data["rows"]),
            tuple(complex(*pair) for pair in data["gain"]), tuple(data["notes"]),
            tuple(Link(**link) for link in data.get("links", [])), bool(data.get("rechecked", False)),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BadInput(f"no calibration that can be read ({type(error).__name__}: {str(error)[:80]})") from None


def _frozen(data: dict[str, Any]) -> dict[str, Any]:
    """JSON's lists as tuples, one level deep."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in data.items()}
