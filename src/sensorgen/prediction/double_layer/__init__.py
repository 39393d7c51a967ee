"""Double sensors: information of a second film, and the effect of a touching body with and without isolation."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue
from sensorgen.models.stack import GroundTie
from sensorgen.prediction.double_layer.designs import press_at, stacked
from sensorgen.prediction.double_layer.differencing import ReadingErrors, bounds
from sensorgen.prediction.double_layer.touching import THICKEST_MM, WIRINGS, Touching, TouchResult
from sensorgen.prediction.query import TIP_M

__all__ = ["FilmReadings", "ReadingErrors", "StackStudy", "TouchResult", "study"]

_ASSUMPTIONS = (
    "both films carry the same force, the lower one spread no wider; bending is neglected",
    "double: the third electrode floats while the other two are read",
    "touch: 1.5 kohm of skin and 100 pF to ground (human body model, ANSI/ESDA/JEDEC JS-001)",
    "touch: the isolation has its full thickness under the body, without fringe",
)


@dataclass(frozen=True)
class FilmReadings:
    """Impedances of the lower and the upper film at one frequency [Hz], real and imaginary parts [ohm]."""

    frequency_hz: float
    lower_re: float
    lower_im: float
    upper_re: float
    upper_im: float


@dataclass(frozen=True)
class StackStudy:
    """A design as a stack.

    Attributes
    ----------
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    noise, drift : float
        Of a reading, relative to its modulus; of the films' permittivity, relative [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    readings_ohm : tuple of FilmReadings
        Under the press, per frequency.
    bounds : tuple of ReadingErrors
        Standard errors of force and position per way of reading.
    press_shift : float
        Largest relative change of the reading by the press [-].
    touch : tuple of TouchResult
        Effect of a touch, per wiring.
    values : tuple of MaterialValue
        Material values used.
    doubts, assumptions : tuple of str
        Why the numbers are uncertain, and what they assume.
    """

    force_n: float
    position_m: float
    noise: float
    drift: float
    within_n: float
    readings_ohm: tuple[FilmReadings, ...]
    bounds: tuple[ReadingErrors, ...]
    press_shift: float
    touch: tuple[TouchResult, ...]
    values: tuple[MaterialValue, ...]
    doubts: tuple[str, ...]
    assumptions: tuple[str, ...] = _ASSUMPTIONS

    def document(self) -> Iterator[Part]:
        """Readings of both films, standard errors by way of reading, and the effect of a touch."""
        yield (
            f"{self.force_n:g} N at {self.position_m / M_PER_MM:g} mm, noise {self.noise * 100:g} %; "
            f"it moves a reading by {self.press_shift * 100:.3g} %"
        )
        yield ""
        heads = ("lower R", "lower X", "upper R", "upper X", "delta R", "delta X")
        readings = (
            (r.frequency_hz, r.lower_re, r.lower_im, r.upper_re, r.upper_im, r.upper_re - r.lower_re,
             r.upper_im - r.lower_im)
            for r in self.readings_ohm
        )  # fmt: skip
        columns = (Column("frequency", "Hz", si=True), *(Column(head) for head in heads))
        caption = "two films that share the middle electrode; R and X, and upper - lower [ohm]"
        yield Table("readings", caption, columns, tuple(readings))
        yield ""
        columns = (
            Column("reading"), Column("sigma F", "N", si=True), Column("sigma x", "m", si=True),
            Column("with drift, F", "N", si=True), Column("x", "m", si=True),
        )  # fmt: skip
        errors = (
            (e.reading, e.force_n.known, e.position_m.known, e.force_n.drifting, e.position_m.drifting)
            for e in self.bounds
        )
        caption = f"standard errors, permittivity known, and where it may drift by {self.drift * 100:g} %"
        yield Table("errors", caption, columns, tuple(errors))
        yield ""
        effects = (
            (f"{rows[0].isolation_mm:.4g} mm" if rows[0].isolation_mm else "bare",
             *(f"{r.largest_shift * 100:.2g} % {r.mistaken_for_n:.3g} N" for r in rows))
            for rows in zip(*(row.by_isolation for row in self.touch), strict=True)
        )  # fmt: skip
        needed = ("needed", *(_needed(row.needed_mm) for row in self.touch))
        caption = (
            "A body that touches the top beside the press: shift of the reading, and the force that it is mistaken for"
        )
        columns = (Column("isolation"), *(Column(row.wiring) for row in self.touch))
        yield Table("touch", caption, columns, (*effects, needed))
        yield f"needed: isolation from which on it stays within {self.within_n:g} N"
        yield ""
        yield from (f"doubt: {doubt}" for doubt in self.doubts)
        yield f"assumptions: {'; '.join(self.assumptions)}"


def _needed(thickness_mm: float | None) -> str:
    if thickness_mm is None:
        return f"not even {THICKEST_MM:g} mm"
    return "none" if thickness_mm == 0 else f"{thickness_mm:.3g} mm"


def study(
    design: Design, frequency_hz: Sequence[float], force_n: float, position_m: float | None, noise: float, drift: float,
    within_n: float, law: str = "", tip_m: float = TIP_M,
) -> StackStudy:  # fmt: skip
    """Evaluate a design as a stack.

    Parameters
    ----------
    design : Design
        Double, or any other: it is then stacked twice.
    frequency_hz : sequence of float
        Frequencies of the readings [Hz].
    force_n, position_m : float
        The press: force [N], centre of the tip [m]; the middle of the sensor where None.
    noise : float
        Relative noise of a reading [-].
    drift : float
        Relative drift of the films' permittivity [-].
    within_n : float
        Largest force that a touch may be mistaken for [N].
    law, tip_m : str, float
        Law of compression; length of the tip and of the touch [m].

    Raises
    ------
    SensorgenError
        As :func:`stacked` and :func:`press_at`.
    """
    found = stacked(design, law, tip_m)
    press, frequency = press_at(found, force_n, position_m), np.asarray(frequency_hz, float)
    z = found.double.impedance(frequency, press)
    touching = Touching(found.own, found.isolation_eps_r, frequency, press, noise, GroundTie())
    return StackStudy(
        force_n, float(np.asarray(press.left_m)) + tip_m / 2, noise, drift, within_n,
        tuple(
            FilmReadings(float(f), *(float(part) for k in (0, 1) for part in (m[k, k].real, m[k, k].imag)))
            for f, m in zip(frequency, z, strict=True)
        ),
        bounds(found.double, frequency, press, noise, drift), touching.press_shift(),
        tuple(touching.result(wiring, within_n, design.params.isolation_mm) for wiring in WIRINGS),
        found.taken, found.doubts,
    )  # fmt: skip
