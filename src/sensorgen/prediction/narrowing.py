"""The one measurement that narrows a wide range most, and by how much."""

from collections.abc import Iterator, Mapping
from math import inf, isfinite, prod

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.design.body import Body
from sensorgen.prediction.results import Narrowing, Prediction

WIDE = 3.0  # upper over lower end, from which on a measurement is advised
_METER, _PRESS = 1.02, 1.1  # upper over lower end of what a meter, and what a known weight, leave of what they measure
MULTIMETER, LCR = "multimeter, four wires", "LCR meter at rest, open leads subtracted"
WEIGHT, GCODE = "known weight on it", "G-code (sensorgen slice)"
_REMOVES = {  # causes by what they no longer count after
    MULTIMETER: ("resistivity", "contact resistance"),
    LCR: ("permittivity", "lead capacitance"),
    WEIGHT: ("law", "width", "film", "stiffness"),
    GCODE: ("width",),
}


def narrowings(
    found: Prediction, body: Body, of_force: Mapping[str, Interval], of_position: Mapping[str, Interval]
) -> Iterator[Narrowing]:
    """Measurements for all ranges that span more than ``WIDE``.

    Parameters
    ----------
    found : Prediction
        With its ranges.
    body : Body
        That is predicted: of G-code, there is none to narrow it.
    of_force, of_position : mapping of str to Interval
        Ends of the resolutions by each cause [N], [m].
    """
    for end, r in found.resistance.items():
        yield from _narrowing(f"{end} electrode", r, {MULTIMETER: _METER, GCODE: _without_print(r)}, body)
    if c := found.capacitance:
        yield from _narrowing("capacitance", c, {LCR: _METER, GCODE: _without_print(c)}, body)
    if s := found.sensitivity:
        yield from _narrowing("sensitivity", s, {WEIGHT: _PRESS, GCODE: _without_print(s)}, body)
    for name, resolution, causes in (
        ("force resolution", found.force_resolution, of_force),
        ("position resolution", found.position_resolution, of_position),
    ):
        if resolution:
            left = {
                by: prod(_factor(part) for cause, part in causes.items() if not cause.startswith(removed))
                for by, removed in _REMOVES.items()
            }
            yield from _narrowing(name, resolution, left, body)


def _narrowing(name: str, of: Bounds, left: Mapping[str, float], body: Body) -> Iterator[Narrowing]:
    now = _factor(of)
    possible = {by: factor for by, factor in left.items() if by != GCODE or body.kind == "estimated"}
    if now > WIDE and possible:
        best = min(possible, key=possible.__getitem__)
        yield Narrowing(name, best, now, min(possible[best], now))


def _factor(of: Bounds | Interval) -> float:
    return of.upper / of.lower if of.lower > 0 and isfinite(of.upper) else inf


def _without_print(of: Bounds) -> float:
    return _factor(of) / _factor(of.print)
