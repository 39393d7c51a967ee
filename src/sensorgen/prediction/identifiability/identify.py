"""Identifiability: how precisely a sensor's impedance determines force and position, and what would improve it.

A change of design or readout keeps the press: the same force at the same place. The required errors stay those of the
unchanged setup.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from sensorgen.core.arrays import Real, finite
from sensorgen.core.errors import OutOfRange
from sensorgen.models import compression
from sensorgen.models.compression import Plate
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import fisher, results
from sensorgen.prediction.identifiability.fisher import LeastErrors, Required, Setup, spread, standard_errors
from sensorgen.prediction.identifiability.results import cartesian
from sensorgen.prediction.query import FORCE_N, NOISE

SHOWN = 3
HELPS = 0.95  # a change counts that takes the shortfall below this share of what it was

WORSE_ETPU_OHM_M = 1 / 1.2  # thesis, Table 3.2: 1.2 S/m
SOFTER_X60_PA, SOFTER_X60 = 1e6, 6.0  # thesis, Table 4.1: 1 MPa; Tables 3.1 and 3.2 have 6 MPa
_CELL = {"dielectric_mm": 0.1, "period_mm": 2.0, "hang_height_mm": 0.5, "lower_height_mm": 0.24}
_CELL_PA = {"x60": 6.0e6, "etpu": 22.0e6}  # thesis, Table 3.2
CELL_F_PER_M2 = 159.65204e-12 / 2e-3  # of that cell, unloaded, by finite elements: per depth, over its period


@dataclass(frozen=True)
class Remedy:
    """One thing to do differently.

    Attributes
    ----------
    kind : str
        Part of the sensor or readout; of each kind only the most helpful change is advised.
    name : str
        As text; ``{count}``, ``{lowest}`` and ``{highest}`` stand for the frequencies.
    risk : str
        Its disadvantage.
    apply : callable
        The changed setup, or the same where the change does not apply.
    """

    kind: str
    name: str
    risk: str
    apply: Callable[[Setup], Setup]


@dataclass(frozen=True)
class Tried:
    """A change, the changed setup and its bounds."""

    change: Remedy
    setup: Setup
    bounds: LeastErrors
    shortfall: float

    def result(self) -> results.ChangeResult:
        """As a result, with the frequencies named."""
        low, high = (
            f"{np.round(f / 1e3, 3):.4g} kHz" for f in (min(self.setup.frequency_hz), max(self.setup.frequency_hz))
        )
        return results.ChangeResult(
            **vars(standard_errors(self.bounds)),
            kind=self.change.kind,
            change=self.change.name.format(lowest=low, highest=high, count=len(self.setup.frequency_hz)),
            risk=self.change.risk,
            shortfall=self.shortfall,
        )


def most_helpful(setup: Setup, need: Required) -> list[Tried]:
    """The changes that lower the worse of both errors most, one of each kind, the best first.

    Parameters
    ----------
    setup : Setup
        As designed.
    need : Required
        Required errors, which the errors are compared with.
    """
    before = float(need.shortfall(setup.bounds()))
    ranked = sorted((t for t in _tried(setup, need) if t.shortfall < HELPS * before), key=lambda t: t.shortfall)
    of_kind = {t.change.kind: t for t in reversed(ranked)}
    return sorted(of_kind.values(), key=lambda t: t.shortfall)[:SHOWN]


def together(setup: Setup, changes: Sequence[Tried]) -> LeastErrors | None:
    """Bounds with several changes, frequencies last since they depend on the corner; None if the film closes."""
    ordered = sorted((t.change for t in changes), key=CHANGES.index)
    try:
        return reduce(lambda so_far, change: change.apply(so_far), ordered, setup).bounds()
    except OutOfRange:
        return None


def _tried(setup: Setup, need: Required) -> Iterator[Tried]:
    """Every change with finite results: not one that closes the film."""
    for change in CHANGES:
        changed = change.apply(setup)
        try:
            limits = changed.bounds()
        except OutOfRange:
            continue
        yield Tried(change, changed, limits, float(need.shortfall(limits)))


def worse_filament(setup: Setup) -> Setup:
    """Both electrodes at least as resistive as Table 3.2's."""
    top, bottom = (max(rho, WORSE_ETPU_OHM_M) for rho in setup.sensor.resistivity_ohm_m)
    return setup.on(replace(setup.sensor, resistivity_ohm_m=(top, bottom)))


def resistive(setup: Setup) -> Setup:
    """Both electrodes five times as resistive."""
    top, bottom = (5 * rho for rho in setup.sensor.resistivity_ohm_m)
    return setup.on(replace(setup.sensor, resistivity_ohm_m=(top, bottom)))


def thin_electrodes(setup: Setup) -> Setup:
    """Both electrodes half as thick."""
    top, bottom = (h / 2 for h in setup.sensor.electrode_m)
    return setup.on(replace(setup.sensor, electrode_m=(top, bottom)))


def cell(setup: Setup) -> Setup:
    """The solved cell of triangles under the usual block, in place of what is there; that cell under any tip stays."""
    sensor = setup.sensor
    even = compression.solved("tri", _CELL, _CELL_PA)
    if even is None or setup.assumed:  # the gain over an unsolved cell is unknown
        return setup
    blocks = [even.under_block(usual=usual) for usual in (True, False)]
    if sensor.compression in (even, *blocks, even.scaled_rise(1 + even.stiff_change)):
        return setup
    return setup.on(replace(sensor, capacitance_f_per_m=CELL_F_PER_M2 * sensor.width_m, compression=blocks[0]))


def soft_film(setup: Setup) -> Setup:
    """A plate six times softer, down to 1 MPa; a solved curve would have to be computed again."""
    law = setup.sensor.compression
    if not isinstance(law, Plate):
        return setup
    modulus_pa = min(law.modulus_pa, max(law.modulus_pa / SOFTER_X60, SOFTER_X60_PA))
    return setup.on(replace(setup.sensor, compression=Plate(law.name, law.source, modulus_pa)))


def thin_film(setup: Setup) -> Setup:
    """A free plate half as thick: twice the capacitance, the same strain."""
    if setup.sensor.compression.name != "unconfined" or setup.assumed:
        return setup
    return setup.on(replace(setup.sensor, capacitance_f_per_m=2 * setup.sensor.capacitance_f_per_m))


def narrow(setup: Setup) -> Setup:
    """Half the width: the same force on half the area. A bonded plate would also become softer, which is neglected."""
    sensor = setup.sensor
    half = replace(sensor, width_m=sensor.width_m / 2, capacitance_f_per_m=sensor.capacitance_f_per_m / 2)
    return setup.on(half)


def ended(setup: Setup) -> Setup:
    """A resistor at an open far end, as large as both electrodes."""
    if setup.sensor.far_end != "open" or not setup.sensor.resistance_ohm():
        return setup
    return setup.on(replace(setup.sensor, far_end=setup.sensor.resistance_ohm()))


def tip(factor: float) -> Callable[[Setup], Setup]:
    """A tip so many times as long [-], as far as the sensor is long enough."""

    def apply(setup: Setup) -> Setup:
        length = min(factor * setup.sensor.tip_m, setup.sensor.length_m)
        return setup.on(replace(setup.sensor, tip_m=length))

    return apply


def higher_frequencies(setup: Setup) -> Setup:
    """Ten times higher frequencies, where the instrument can give them."""
    if 10 * max(setup.frequency_hz) > setup.highest_hz:
        return setup
    return replace(setup, frequency_hz=tuple(10 * f for f in setup.frequency_hz))


def frequencies_at_corner(setup: Setup) -> Setup:
    """As many frequencies spread about the corner."""
    if not setup.sensor.resistance_ohm():
        return setup
    return replace(setup, frequency_hz=spread(setup))


def quieter(setup: Setup) -> Setup:
    """A tenth of the noise."""
    return replace(setup, noise=setup.noise / 10)


CHANGES = (
    Remedy("film", "triangles 2 mm apart over a film of 0.1 mm (tri), as drawn, in place of this cell",
           "a print may lose the apexes, or short through a film of one or two layers: see sensorgen check tri", cell),
    Remedy("film", "a film six times softer (X60: 1 MPa by Table 4.1 in place of 6 MPa)",
           "softer filaments are hard to feed, and creep more", soft_film),
    Remedy("film", "a film half as thick", "it shorts sooner, and if bonded is four times stiffer", thin_film),
    Remedy("electrodes", "electrodes of at least 0.83 ohm m (another filament than PI-eTPU, or little carbon)",
           "resistance then scatters and drifts more with strain and temperature", worse_filament),
    Remedy("electrodes", "electrodes five times as resistive", "needs another filament: little carbon scatters much",
           resistive),
    Remedy("electrodes", "electrodes half as thick", "few layers: gaps in one of them cut the track", thin_electrodes),
    Remedy("outline", "half the width", "a smaller target, and twice the pressure on the film", narrow),
    Remedy("far end", "a resistor at the far end, as large as both electrodes", "a contact at the far end", ended),
    Remedy("tip", "a tip twice as long", "two presses closer than the tip become one", tip(2.0)),
    Remedy("tip", "a tip half as long", "twice the pressure on the film", tip(0.5)),
    Remedy("frequencies", "ten times higher frequencies, {lowest} to {highest}",
           "stray capacitance and leads count more", higher_frequencies),
    Remedy("frequencies", "{count} frequencies about the corner, log-spaced from {lowest} to {highest}",
           "stray capacitance and leads count more", frequencies_at_corner),
    Remedy("noise", "a tenth of the noise", "a hundred readings averaged in place of one, or a better bridge", quieter),
)  # fmt: skip


LIGHT_N = 1.0  # smaller forces do not count in the shares of presses that are known
MAP_FORCES, MAP_POSITIONS = 7, 21


def identify(
    sensor: Sensor,
    frequency_hz: Sequence[float],
    noise: float = NOISE,
    *,
    force_n: float = FORCE_N,
    position_m: float | None = None,
    stiffest: Sensor | None = None,
    assumed: str = "",
) -> results.Identifiability:
    """Cramer-Rao bounds of force and position, which frequencies carry the information, and what would improve them.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : sequence of float
        Frequencies of the readings [Hz].
    noise : float
        Standard deviation of Re Z and of Im Z at each frequency, each, relative to abs(Z) [-].
    force_n : float
        Reference force, and the greatest of the map [N].
    position_m : float
        Centre of the tip; the middle of the sensor unless given [m].
    stiffest : Sensor
        The same sensor by its stiffest law of compression, where ``sensor`` has the softest (a plate).
    assumed : str
        Assumption on the law of compression of a cell that was not solved; the verdict is then conditional.

    Raises
    ------
    OutOfRange
        No frequency; a noise that is not above 0; a press that the sensor cannot take.

    Notes
    -----
    Force is *sensed* where its standard error (:mod:`sensorgen.prediction.identifiability.fisher`) is a tenth of the
    force or less, a press *located* where it is the tip's length or less; a quantity is not sensed where the error is
    that of a uniform distribution (range over the root of 12), and "roughly" in between.
    """
    centre = sensor.length_m / 2 if position_m is None else position_m
    setup = Setup(sensor, tuple(map(float, frequency_hz)), noise, force_n, centre, assumed)
    slopes = fisher.slopes(sensor, setup.frequency_hz, force_n, setup.position_m)
    limits, need, reason = fisher.bounds(slopes, noise), fisher.required(setup), fisher.undefined(setup, slopes)
    helpful = most_helpful(setup, need)
    combined = together(setup, helpful) if helpful else None
    calibrated, uncalibrated = _on_a_bench(setup)
    senses_force, locates = (None, None) if assumed else need.grades(limits)
    stress = sensor.stress_pa(force_n, centre)
    strain = float(sensor.compression.capacitive_strain(stress)[0])
    press, bracket = results.ReferencePress(force_n, centre, sensor.tip_m, float(stress), strain), None
    if stiffest:
        stiff = setup.on(stiffest).bounds()
        bracket = results.Stiffest(**vars(standard_errors(stiff)), verdict=fisher.bracket(limits, stiff, need))
    return results.Identifiability(
        **vars(fisher.standard_errors(limits)), noise=noise, press=press,
        corner_frequency_hz=sensor.corner_frequency_hz() if sensor.resistance_ohm() else None,
        required=need.errors(), reason=reason, assumed=assumed or None,
        senses_force=senses_force, locates=locates,
        verdict=fisher.verdict(setup, limits, need, reason),
        stiffest=bracket,
        frequencies=_frequencies(setup, slopes), map=_map(setup, need),
        best_frequencies=fisher.best(setup, slopes, need), advised_frequencies=fisher.advised(setup, need),
        changes=tuple(one.result() for one in helpful),
        changes_together=fisher.standard_errors(combined) if combined else None,
        calibrated=calibrated, uncalibrated=uncalibrated,
    )  # fmt: skip


def _on_a_bench(setup: Setup) -> tuple[results.StandardErrors | None, ...]:
    """Errors of a specimen, with a calibration and without."""
    from sensorgen.prediction.calibration.next_press import outlook

    errors = outlook(setup.sensor, np.array(setup.frequency_hz), setup.noise, setup.force_n, setup.position_m)
    return tuple(
        results.StandardErrors(sigma_force_n=_rounded(force), sigma_position_m=_rounded(position))
        for force, position in np.array(errors).tolist()
    ) if errors else (None, None)  # fmt: skip


def _rounded(error: float) -> float | None:
    """A standard error to four digits, the same on every machine; None of an infinite one."""
    return float(f"{error:.4g}") if np.isfinite(error) else None


def _frequencies(setup: Setup, slopes: fisher.Slopes) -> tuple[results.FrequencyInformation, ...]:
    z = setup.sensor.impedance(np.array(setup.frequency_hz), setup.force_n, setup.position_m)
    columns = (setup.frequency_hz, z, *slopes, *fisher.shares(slopes))
    return tuple(
        results.FrequencyInformation(
            f, float(abs(ohm)), cartesian(a * ohm), cartesian(b * ohm), cartesian(a), cartesian(b), finite(of_force),
            finite(of_position),
        )
        for f, ohm, a, b, of_force, of_position in zip(*columns, strict=True)
    )  # fmt: skip


def surface(setup: Setup, force_n: Real, position_m: Real) -> LeastErrors:
    """Bounds over forces (rows, [N]) and positions (columns, [m]); nan where undefined or the electrodes touch."""
    force, place = np.broadcast_arrays(force_n[:, None], position_m)
    valid = fisher.bearable(setup.sensor, force, place)
    slopes = fisher.slopes(setup.sensor, setup.frequency_hz, np.where(valid, force, 0.0), place)
    return LeastErrors(*(np.where(valid, value, np.nan) for value in fisher.bounds(slopes, setup.noise)))


def _map(setup: Setup, need: fisher.Required) -> results.ErrorMap:
    force = np.linspace(0.0, setup.force_n, MAP_FORCES)
    place = np.linspace(0.0, setup.sensor.length_m, MAP_POSITIONS)
    limits = surface(setup, force, place)
    pressed = force != 0
    rows_n, rows_m = (tuple(map(tuple, finite(sigma))) for sigma in (limits.force_n, limits.position_m))
    doubt = setup.sensor.compression.doubt(float(setup.sensor.stress_pa(force[:, None], place).max()))
    summaries = (
        _summary(sigma[pressed], serves, force[pressed], place)
        for sigma, serves in ((limits.force_n, need.force_n), (limits.position_m, need.position_m))
    )
    return results.ErrorMap(tuple(force.tolist()), tuple(place.tolist()), rows_n, rows_m, doubt, *summaries)


def _summary(sigma: Real, serves: float, force_n: Real, position_m: Real) -> results.ErrorSummary:
    if np.isnan(sigma).all():
        return results.ErrorSummary(None, None, None, None, LIGHT_N, 0.0)
    row, column = np.unravel_index(np.nanargmax(sigma), sigma.shape)
    counted = np.abs(force_n) >= min(LIGHT_N, np.abs(force_n).max())
    return results.ErrorSummary(
        float(np.nanmedian(sigma)), float(sigma[row, column]), float(force_n[row]), float(position_m[column]),
        from_force_n=float(np.abs(force_n[counted]).min()), share_known=float(np.mean(sigma[counted] <= serves)),
    )  # fmt: skip
