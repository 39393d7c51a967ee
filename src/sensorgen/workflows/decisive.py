"""The few numbers that decide whether to print a design, drawn beside printed."""

from collections.abc import Iterator
from dataclasses import replace

from sensorgen.core.bounds import Bounds
from sensorgen.core.document import Column, Part, Table
from sensorgen.prediction.identifiability.verdict import FORCE_SHARE, GUESS
from sensorgen.workflows.trial import Numbers, Trial


def grade(tried: Trial) -> tuple[int, int]:
    """Whether the print senses force, and locates: 2 yes, 1 roughly, 0 no."""
    length_m = 2 * tried.position_m  # the reference load is in the middle
    force, place = tried.printed.force_resolution, tried.printed.position_resolution
    return (
        _grade(force, FORCE_SHARE * tried.force_n, GUESS * tried.force_n),
        _grade(place, FORCE_SHARE * length_m, GUESS * length_m),
    )


def _grade(error: Bounds | None, good: float, useless: float) -> int:
    return 0 if error is None or not error.value < useless else 2 if error.value <= good else 1


def resolved(error: Bounds | None, most: float, cannot: str) -> str:
    """A standard error in words; where it is that of a reading without information, what the sensor cannot do.

    >>> resolved(Bounds.of(8580.0, "m"), 0.1, "cannot locate"), resolved(Bounds.of(0.2, "N"), 6.0, "cannot sense")
    ('cannot locate', '200 mN')
    """
    if error is None:
        return "–"
    if not error.value < GUESS * most:
        return cannot
    if error.upper > most:
        error = replace(error, upper=most, open="upper")
    return error.words()


def table(tried: Trial) -> Iterator[Part]:
    """Electrode gap, capacitance, resistance of the electrodes, resolution, and the time of the print where known."""
    both, length_m = (tried.drawn, tried.printed), 2 * tried.position_m
    rows = [
        ("electrode gap", *(_words(n.gap) for n in both)),
        ("capacitance", *(_words(n.capacitance) for n in both)),
        ("top electrode", *(_words(n.top_electrode) for n in both)),
        ("bottom electrode", *(_words(n.bottom_electrode) for n in both)),
        ("force resolution", *(_force(n, tried.force_n) for n in both)),
        ("position resolution", *(_place(n, length_m) for n in both)),
    ]
    if tried.toolpath:
        rows.append(("print time", "", f"at least {tried.toolpath.time_s / 60:.0f} min"))
    yield Table("numbers", "", (Column(""), Column("drawn"), Column("printed")), tuple(rows))
    yield f"(resolution at {tried.force_n:g} N and {tried.position_m * 1e3:g} mm; {tried.body})"
    if tried.reason:
        yield tried.reason


def words_of(tried: Trial) -> str:
    """Capacitance and resolutions of the print, in one line."""
    printed = tried.printed
    c = printed.capacitance
    force, place = _force(printed, tried.force_n), _place(printed, 2 * tried.position_m)
    return ", ".join((
        f"C {_best(c)}" if c else tried.status,
        force if force.startswith("cannot") else f"force {_best(printed.force_resolution)}",
        place if place.startswith("cannot") else f"position {_best(printed.position_resolution)}",
    ))  # fmt: skip


def _force(numbers: Numbers, force_n: float) -> str:
    return resolved(numbers.force_resolution, force_n, "cannot sense force")


def _place(numbers: Numbers, length_m: float) -> str:
    return resolved(numbers.position_resolution, length_m, "cannot locate")


def _words(bounds: Bounds | None) -> str:
    return bounds.words() if bounds else "–"


def _best(bounds: Bounds | None) -> str:
    """The best value alone, to two digits."""
    return Bounds.of(float(f"{bounds.value:.2g}"), bounds.unit).words() if bounds else "–"
