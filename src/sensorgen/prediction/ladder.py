"""How a sensor is predicted as nearly as asked: each level by the cheapest that will do, the whole within the accuracy.

The levels are the cell's capacitance, how the cell gives way, and the sections of the line under the tip. An error is
what it makes of abs(Z) at one press; each level may take up what the ones before it left over.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.capacitance import Answer, Unloaded, unloaded, weighed
from sensorgen.prediction.compression_law import Law, Option, options
from sensorgen.prediction.error_budget import Seen
from sensorgen.prediction.identifiability import FORCE_N
from sensorgen.prediction.mesh_ladder import Piece
from sensorgen.prediction.plan import Candidate, Level, Plan, cheapest, walked
from sensorgen.prediction.sensor_of_design import Sensed, sensor_of

ACCURACY = 1e-2  # that is tried where none is asked for: a share of what materials are known to
_TONES_HZ = (1e3, 1e5)  # between which errors of abs(Z) are looked for there
SECTIONS = (4, 8, 16, 32, 64, 128, 256)  # that a tip whose pressure is not uniform may be cut into
_NAMES = {f"line, {n} section{'s' * (n > 1)}": n for n in (1, *SECTIONS)}
_RICHARDSON = 4 / 3  # of what halving a section changes, where errors fall by four
_NUDGE = 0.01  # of the capacitance, to see what abs(Z) makes of it

_OF_C, _OF_Z = "bounds of C apart", "|Z| off by"


@dataclass(frozen=True)
class Press:
    """Where abs(Z) has to be known: tones [Hz], force [N], and place [m]."""

    frequency_hz: tuple[float, ...]
    force_n: float
    position_m: float


@dataclass(frozen=True)
class Makers:
    """How a sensor is made, drawn or printed.

    Attributes
    ----------
    unloaded : function
        What is known of it before anything presses, with bounds of the capacitance as near as given [-].
    sensed : function
        The sensor itself, of a law of compression and of that.
    printed : Piece or None
        What is pressed, where that is not the drawing.
    """

    unloaded: Callable[[float], Unloaded]
    sensed: Callable[[str | Law, Unloaded], Sensed]
    printed: Piece | None = None

    def rough(self, law: str) -> Sensed:
        """The sensor by what costs next to nothing."""
        return self.sensed("" if law == "solved" else law, self.unloaded(inf))


@dataclass(frozen=True)
class Outline:
    """A prediction that is planned and not yet worked out.

    Attributes
    ----------
    makers, press : Makers, Press
        As they were given.
    options : function
        Laws of compression that could be had, by what is known of the capacitance.
    rough : Sensed
        The sensor by what costs next to nothing.
    by_capacitance : float
        Relative change of abs(Z) over that of the capacitance [-].
    plan : Plan
        What should do.
    """

    makers: Makers
    press: Press
    options: Callable[[Answer], list[Option]]
    rough: Sensed
    by_capacitance: float
    plan: Plan


def drawn(design: Design, **tip: Any) -> Makers:
    """The sensor as drawn, under a tip as of :func:`sensorgen.prediction.sensor_of_design.sensor_of`."""
    return Makers(partial(unloaded, design), lambda law, known: sensor_of(design, law, known=known, **tip))


def sensed(
    design: Design, makers: Makers, press: Press, accuracy: float = inf, law: str = ""
) -> tuple[Sensed, Plan | None]:
    """The sensor, and how it was planned where an accuracy is wanted; parameters and errors as of :func:`outlined`."""
    if accuracy == inf:
        return makers.sensed(law, makers.unloaded(inf)), None
    return carried_out(outlined(design, makers, press, accuracy, law))


def usual(design: Design, law: str = "", **tip: Any) -> Sensed:
    """The sensor to ``ACCURACY`` at a press in its middle, where nobody asks for another; as near as it comes to that.

    Parameters
    ----------
    design : Design
        As drawn.
    law : str
        As of :func:`outlined`.
    **tip
        As of :func:`sensorgen.prediction.sensor_of_design.sensor_of`.

    Raises
    ------
    SensorgenError
        As :func:`outlined`.
    """
    makers = drawn(design, **tip)
    press = Press(_TONES_HZ, FORCE_N, design.params.length_mm * M_PER_MM / 2)
    if _bears(makers.rough(law).sensor, press):
        return sensed(design, makers, press, ACCURACY, law)[0]
    return makers.sensed(law, makers.unloaded(ACCURACY))


def _bears(sensor: Sensor, press: Press) -> bool:
    """Whether a sensor can take a press."""
    try:
        Seen(sensor, press.frequency_hz, press.force_n, press.position_m)
    except OutOfRange:
        return False
    return True


def outlined(design: Design, makers: Makers, press: Press, accuracy: float, law: str = "") -> Outline:
    """What an accuracy takes: by models that cost next to nothing, and by what the others are expected to do.

    Parameters
    ----------
    design : Design
        As drawn.
    makers : Makers
        Of its sensor.
    press : Press
        At which abs(Z) is wanted.
    accuracy : float
        Of abs(Z), relative, all levels together [-].
    law : str
        The only law of compression to take, or "".

    Raises
    ------
    OutOfRange
        An accuracy that is not above 0; a press that the sensor cannot take.
    Unpredictable, MissingValue, UnknownName, BadInput
        As :func:`sensorgen.prediction.sensor_of_design.sensor_of`.
    """
    if not accuracy > 0:
        raise OutOfRange(f"an accuracy of {accuracy:g}; expected a number above 0, as 1e-3")
    rough = makers.rough(law)
    sensor = rough.sensor
    line = _expected(_line(sensor, press, accuracy / 3))
    share = (accuracy - min(_reach(line), accuracy / 3)) / 2
    by_capacitance = _by_capacitance(sensor, press)

    def laws(known: Answer) -> list[Option]:
        return options(design, known, law, printed=makers.printed)

    cell = _cell(rough, min(accuracy, 2 * share / by_capacitance))
    compression = _compression(laws(rough.unloaded.answer), sensor, press, share)
    at = f"|Z| at {press.force_n:g} N and {press.position_m * 1e3:g} mm, at the worst tone"
    return Outline(makers, press, laws, rough, by_capacitance, Plan(accuracy, at, (cell, compression, line)))


def carried_out(outline: Outline) -> tuple[Sensed, Plan]:
    """The sensor as nearly as planned, or as nearly as anyone can tell; and the plan with what came of it.

    Raises
    ------
    SensorgenError
        As :func:`outlined`; what the last law said, where none can be had.
    """
    plan, press = outline.plan, outline.press
    cell, compression, line = plan.levels
    known = outline.makers.unloaded(cell.allowed)
    rough, bounds = outline.rough.sensor, known.answer.capacitance_f
    sensor = _thicker(rough, bounds.middle() / rough.capacitance_f())
    spent = _off(sensor, press, *(_thicker(sensor, end / bounds.middle()) for end in (bounds.lower, bounds.upper)))
    law, compression = walked(
        replace(compression, allowed=_left(plan.accuracy - spent - _reach(line), compression)),
        {option.name: option.find for option in outline.options(known.answer)},
        lambda law: _law_off(sensor, press, law),
    )
    spent += _width(compression)
    sensed = outline.makers.sensed(_told(law, compression), known)
    line = _line(sensed.sensor, press, _left(plan.accuracy - spent, line), line)
    levels = (_asked(cell, known.answer), compression, line)
    return _cut(sensed, _NAMES[line.chosen]), replace(plan, levels=levels, width=spent + _width(line))


def _cut(sensed: Sensed, sections: int) -> Sensed:
    """With the tip in that many sections; what a flat one would be cut into if it were another is left as it is."""
    if sensed.sensor.profile == UNIFORM:
        return sensed
    return replace(sensed, sensor=replace(sensed.sensor, pieces=sections))


def _left(accuracy: float, level: Level) -> float:
    """What the levels before left over; where that is nothing, no more is worth while than was planned."""
    return accuracy if accuracy > 0 else level.allowed


def _by_capacitance(sensor: Sensor, press: Press) -> float:
    """Relative change of abs(Z) over that of the capacitance [-]."""
    seen = Seen(sensor, press.frequency_hz, press.force_n, press.position_m)
    found = seen.change(_thicker(sensor, 1 + _NUDGE))
    return found["magnitude"] / _NUDGE if found else 1.0


def _thicker(sensor: Sensor, factor: float) -> Sensor:
    """A sensor with that many times the capacitance."""
    return replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * factor)


def _cell(rough: Sensed, width: float) -> Level:
    """Models of the capacitance; the cheapest one has answered already."""
    answer = rough.unloaded.answer
    candidates = tuple(
        replace(c, expected_width=answer.width(), expected_seconds=answer.seconds()) if c.model == answer.model else c
        for c in weighed(rough.piece.scene, width)
    )
    return Level("cell", _OF_C, width, candidates, cheapest(candidates, width))


def _asked(cell: Level, answer: Answer) -> Level:
    """What came of the models of the capacitance; a print's is by several conventions at once."""
    candidates = answer.plan or (Candidate(answer.model, width=answer.width()),)
    return replace(cell, candidates=candidates, chosen=answer.model)


def _compression(laws: list[Option], sensor: Sensor, press: Press, allowed: float) -> Level:
    candidates = tuple(Candidate(o.name, _law_off(sensor, press, o.expected), o.seconds) for o in laws)
    return Level("compression", _OF_Z, allowed, candidates, cheapest(candidates, allowed))


def _told(law: Law, level: Level) -> Law:
    """A law of no known error says why no better one was found."""
    failed = () if law.bounded else tuple(f"{c.model}: {c.passed_over}" for c in level.candidates if c.passed_over)
    return replace(law, doubts=(*law.doubts, *failed))


def _law_off(sensor: Sensor, press: Press, law: Law) -> float:
    """What a law's own error makes of abs(Z); infinite where nobody knows it [-]."""
    if press.force_n == 0:
        return 0.0
    pressed = replace(sensor, compression=law.compression)
    return _off(pressed, press, *(replace(sensor, compression=other) for other in law.others)) if law.bounded else inf


def _off(sensor: Sensor, press: Press, *others: Sensor, factor: float = 1.0) -> float:
    """By how much abs(Z) of other sensors is off, at the worst tone; infinite where one cannot take the press [-]."""
    try:
        found = Seen(sensor, press.frequency_hz, press.force_n, press.position_m).change(*others, factor=factor)
    except OutOfRange:
        return inf
    return found["magnitude"] if found else inf


def _line(sensor: Sensor, press: Press, allowed: float, expected: Level | None = None) -> Level:
    """Sections under the tip until there are enough: one where its pressure is uniform, which is exact."""
    before = {c.model: c for c in expected.candidates} if expected else {}
    found: list[Candidate] = []
    for name, pieces in _NAMES.items():
        if (pieces == 1) is (sensor.profile == UNIFORM) and not (found and _within(found[-1], allowed)):
            begun = time.perf_counter()
            cut = replace(sensor, pieces=pieces)
            off = 0.0 if pieces == 1 else _off(cut, press, replace(cut, pieces=2 * pieces), factor=_RICHARDSON)
            seconds = time.perf_counter() - begun
            found.append(replace(before.get(name, Candidate(name)), width=off, seconds=seconds))
    return Level("line", _OF_Z, allowed, tuple(found), found[-1].model)


def _within(candidate: Candidate, allowed: float) -> bool:
    return candidate.width is not None and candidate.width <= allowed


def _expected(level: Level) -> Level:
    """What was found on a rough sensor, as what to expect."""
    candidates = (Candidate(c.model, c.width, c.seconds) for c in level.candidates)
    return replace(level, candidates=tuple(candidates))


def _reach(level: Level) -> float:
    """What the chosen one is expected to come to [-]."""
    return next(c.reach() for c in level.candidates if c.model == level.chosen)


def _width(level: Level) -> float:
    """What the chosen one came to [-]."""
    return next(c.width or 0.0 for c in level.candidates if c.model == level.chosen)
