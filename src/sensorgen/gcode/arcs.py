"""Arcs as chords."""

import math
from collections.abc import Iterator

SAG_MM = 0.005  # how far a chord may be from its arc: a tenth of what the printer can place
MOST_CHORDS = 720


def chords(
    start: tuple[float, float, float],
    end: tuple[float, float, float],
    centre: tuple[float, float],
    *,
    clockwise: bool,
) -> Iterator[tuple[float, float, float]]:
    """Ends of the chords of an arc in the plane of the bed; Z rises evenly.

    Parameters
    ----------
    start, end : (float, float, float)
        Where it begins and ends [mm]; the same place means a full circle.
    centre : (float, float)
        Middle of the circle [mm].
    clockwise : bool
        As seen from above: G2.

    Examples
    --------
    >>> ends = list(chords((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0), clockwise=False))
    >>> ends[-1], round(max(y for _, y, _ in ends), 3)
    ((-1.0, 0.0, 0.0), 1.0)
    """
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    turn = (first - last if clockwise else last - first) % math.tau
    if turn < 1e-9:
        turn = math.tau
    count = _count(radius, turn)
    for k in range(1, count):
        share = k / count
        angle = first + (-turn if clockwise else turn) * share
        height = start[2] + (end[2] - start[2]) * share
        yield centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle), height
    yield end


def _count(radius: float, turn: float) -> int:
    if not radius > SAG_MM:
        return 1
    step = 4 * math.asin(math.sqrt(SAG_MM / (2 * radius)))  # acos(1 - sag / radius) would be 0 for a large one
    return max(1, min(MOST_CHORDS, math.ceil(turn / step)))


def centre_of_radius(
    start: tuple[float, float], end: tuple[float, float], radius: float, *, clockwise: bool
) -> tuple[float, float] | None:
    """Middle of the arc of a given radius, or None where none leads from start to end.

    Parameters
    ----------
    start, end : (float, float)
        Its ends [mm].
    radius : float
        Its radius [mm]; negative for the longer way round.
    clockwise : bool
        As seen from above: G2.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(dx, dy)
    if chord == 0 or not chord <= 2 * abs(radius) * (1 + 1e-6):
        return None
    off = math.sqrt(max(0.0, radius**2 - chord**2 / 4)) / chord
    side = off if (radius > 0) != clockwise else -off
    return (start[0] + end[0]) / 2 - dy * side, (start[1] + end[1]) / 2 + dx * side
