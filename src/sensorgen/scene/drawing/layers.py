"""The layer grid over the detail views: boundaries, the heights at which slicers sample, numbers."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from sensorgen.scene.drawing.paper import ViewFrame, element, line, number, text

LABEL_PITCH, LINE_PITCH, MID_PITCH = 2.7, 0.4, 1.4  # least distance on paper [mm]
MANY = 60  # above so many layers every tenth number is enough
STEPS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
WIDTH = 19.0  # room for numbers and heights [mm]


def grid(frame: ViewFrame, boundaries_mm: Sequence[float], right: float) -> Iterator[str]:
    """Lines at the boundaries up to ``right`` on the page [mm], and dashed ones where slicers sample."""
    pitch = _pitch(frame, boundaries_mm)
    mids = [(a + b) / 2 for a, b in pairwise(boundaries_mm)] if pitch >= MID_PITCH else []
    step, last = _step(pitch, LINE_PITCH), len(boundaries_mm) - 1
    lines = _path(frame, [z for k, z in enumerate(boundaries_mm) if k % step == 0 or k == last], right)
    if pitch >= MID_PITCH:
        yield element("path", "under", d=lines)
    yield element("path", "grid" if pitch >= MID_PITCH else "grid dense", d=lines)
    if mids:
        yield element("path", "mid", d=_path(frame, mids, right))


def labels(frame: ViewFrame, boundaries_mm: Sequence[float], left: float) -> Iterator[str]:
    """Number of each layer at its middle, height at its boundary, from ``left`` on the page [mm]."""
    step = _step(_pitch(frame, boundaries_mm), LABEL_PITCH)
    step = max(step, 10) if len(boundaries_mm) > MANY + 1 else step
    decimals = max(len(number(z).partition(".")[2]) for z in boundaries_mm)
    yield text("small faint middle", left + 4, frame.top - 2.2, "layer")
    yield text("small faint end", left + 18, frame.top - 2.2, "z [mm]")
    yield text("small end", left + 18, frame.bed + 0.8, "0")
    for k, (low, high) in enumerate(pairwise(boundaries_mm), start=1):
        if k % step == 0:
            yield text("small bold middle", left + 4, frame.y((low + high) / 2) + 0.8, str(k))
            yield text("small end", left + 18, frame.y(high) + 0.8, f"{high:.{decimals}f}")
            yield line("grid", left + 7.5, frame.y(high), left + 9.5, frame.y(high))


def words(frame: ViewFrame, boundaries_mm: Sequence[float]) -> str:
    """The layers in one line, for the title block."""
    count = len(boundaries_mm) - 1
    if count < 1:
        return "no layers given"
    first, later = boundaries_mm[1], boundaries_mm[min(2, count)] - boundaries_mm[min(1, count - 1)]
    drawn = _step(_pitch(frame, boundaries_mm), LINE_PITCH)
    other = f", the first {number(first)} mm" if abs(first - later) > 1e-9 else ""
    every = f" (a line every {drawn})" if drawn > 1 else ""
    return f"{count} layer{'s' * (count > 1)} of {number(later)} mm{other}{every}"


def _pitch(frame: ViewFrame, boundaries_mm: Sequence[float]) -> float:
    """Least height of a layer on paper [mm]."""
    return min((frame.y(a) - frame.y(b) for a, b in pairwise(boundaries_mm)), default=1.0)


def _step(pitch: float, least: float) -> int:
    return next((step for step in STEPS if step * pitch >= least), STEPS[-1])


def _path(frame: ViewFrame, heights_mm: Sequence[float], right: float) -> str:
    return "".join(f"M{number(frame.left - 1)} {number(frame.y(z))}H{number(right)}" for z in heights_mm)
