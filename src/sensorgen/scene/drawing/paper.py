"""Marks on paper: SVG elements in millimetres, text that keeps to its room, and the layer grid over a view."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from unicodedata import east_asian_width

from sensorgen.scene.drawing.view import View
from sensorgen.scene.scene import Point

ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;"})
PLAIN = 2.5  # height of text; the smallest is 2.3, for less cannot be read on A4 [mm]
# Widths in DejaVu Sans, the widest of the usual fonts, in groups [em].
WIDTHS = ((0.28, "ijl"), (0.34, " .,:;'|!I"), (0.43, "frt()[]-/"), (0.53, "csz"), (0.6, "aekovxy"), (0.83, "w"))
GLYPHS = {c: em for em, letters in (*WIDTHS, (1.0, "mMW@%\N{EM DASH}")) for c in letters}

ARROWS = "".join(
    f'<marker id="sg-{name}" viewBox="-6 -3 12 6" markerWidth="{width}" markerHeight="{height}" '
    f'markerUnits="userSpaceOnUse" orient="auto"><path d="{shape}"/></marker>'
    for name, width, height, shape in (
        ("start", 4, 2, "M0 0L6 -1V1Z"),
        ("end", 4, 2, "M0 0L-6 -1V1Z"),
        ("tick", 4, 2, "M-2 2.4L1.6 -2.4L2 -2.4L-1.6 2.4Z"),
    )
)


@dataclass(frozen=True)
class ViewFrame:
    """Where a view stands on the page.

    Attributes
    ----------
    left, bed : float
        Place of the sensor's corner on the page [mm].
    right, top : float
        Where the view ends on the page [mm].
    per_mm, per_mm_up : float
        Paper per sensor, along the section and in height [mm/mm].
    start_mm : float
        Length along the section at the left end [mm].
    """

    left: float
    bed: float
    right: float
    top: float
    per_mm: float
    per_mm_up: float
    start_mm: float = 0.0

    def x(self, along_mm: float) -> float:
        """Place on the page of a length along the section [mm]."""
        return self.left + (along_mm - self.start_mm) * self.per_mm

    def y(self, height_mm: float) -> float:
        """Place on the page of a height over the bed [mm]."""
        return self.bed - height_mm * self.per_mm_up

    def outline(self, points: Iterable[Point]) -> str:
        """Path of a closed outline [mm]."""
        return "M" + "L".join(f"{number(self.x(u))} {number(self.y(z))}" for u, z in points) + "Z"


@dataclass(frozen=True)
class ViewPanel:
    """A view and where it stands on the page."""

    view: View
    frame: ViewFrame

    def place(self, at_mm: Point) -> Point:
        """Place on the page of a point (along, z) of the section [mm]."""
        return self.frame.x(at_mm[0]), self.frame.y(at_mm[1])


def number(value: float) -> str:
    """A coordinate, to a thousandth; the same text on every machine.

    >>> number(-0.0001), number(12.5)
    ('0', '12.5')
    """
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def element(tag: str, kind: str = "", inside: str = "", **attributes: float | str) -> str:
    """One SVG element of a class; ``_`` in an attribute's name stands for ``-``."""
    named = ({"class": kind} if kind else {}) | attributes
    words = "".join(
        f' {key.replace("_", "-")}="{value.translate(ESCAPES) if isinstance(value, str) else number(value)}"'
        for key, value in named.items()
    )
    return f"<{tag}{words}>{inside}</{tag}>" if inside else f"<{tag}{words}/>"


def line(kind: str, x0: float, y0: float, x1: float, y1: float) -> str:
    """A straight line [mm]."""
    return element("line", kind, x1=x0, y1=y0, x2=x1, y2=y1)


def seen(kind: str, x0: float, y0: float, x1: float, y1: float) -> str:
    """A straight line that shows on dark and on light [mm]."""
    return line("under", x0, y0, x1, y1) + line(kind, x0, y0, x1, y1)


def box(kind: str, x: float, y: float, width: float, height: float, **attributes: float | str) -> str:
    """A rectangle from its upper left corner [mm]."""
    return element("rect", kind, "", x=x, y=y, width=width, height=height, **attributes)


def text(kind: str, x: float, y: float, words: str, **attributes: float | str) -> str:
    """One line of text on its base line [mm]; any string is safe."""
    return element("text", kind, escaped(words), x=x, y=y, **attributes)


def escaped(words: str) -> str:
    """Text that may stand inside an element."""
    return clean(words).translate(ESCAPES)


def clean(words: str) -> str:
    """Text without the characters that XML forbids or that no font shows."""
    return "".join(c if c.isprintable() else " " for c in words)


def width(words: str, size: float = PLAIN) -> float:
    """Room that a text takes at most [mm], for a letter height of ``size`` [mm]."""

    def em(c: str) -> float:
        return 1.05 if east_asian_width(c) in "WF" else GLYPHS.get(c, 0.72 if c.isupper() else 0.64)

    return size * sum(map(em, words))


def fitted(words: str, room: float, size: float = PLAIN) -> str:
    """The text, or as much of its beginning as fits into ``room`` [mm]."""
    if width(words, size) <= room:
        return words
    ends = list(accumulate(width(c, size) for c in words))
    keep = sum(end <= room - size for end in ends)
    return words[:keep].rstrip() + "…"


def wrapped(words: str, room: float, lines: int, size: float = PLAIN) -> list[str]:
    """The text in up to so many lines of ``room`` [mm]; what is left over is cut off."""
    rows = [""]
    for word in clean(words).split():
        longer = f"{rows[-1]} {word}".strip()
        if width(longer, size) <= room or len(rows) == lines or not rows[-1]:
            rows[-1] = longer
        else:
            rows.append(word)
    return [fitted(row, room, size) for row in rows]


def spread(wanted: Sequence[float], pitch: Sequence[float], low: float, high: float) -> list[float]:
    """Places nearest to the wanted ones, in their order, with room between neighbours.

    Parameters
    ----------
    wanted : sequence of float
        Where each would like to be, ascending [mm].
    pitch : sequence of float
        Least distance of each to the one before it; the first is not used [mm].
    low, high : float
        Between which all shall stay, if they can [mm].

    Notes
    -----
    Isotonic regression by pooling neighbours, after the least distances are taken out.

    Examples
    --------
    >>> spread([1.0, 1.0, 9.0], [2.0, 2.0, 2.0], 0.0, 10.0)
    [0.0, 2.0, 9.0]
    """
    steps = list(accumulate([0.0, *pitch[1:]])) if wanted else []
    pools: list[tuple[float, int]] = []
    for place, step in zip(wanted, steps, strict=True):
        total, count = place - step, 1
        while pools and pools[-1][0] / pools[-1][1] > total / count:
            total, count = total + pools[-1][0], count + pools.pop()[1]
        pools.append((total, count))
    means = [total / count for total, count in pools for _ in range(count)]
    room = max(high - steps[-1], low) if steps else high
    return [min(max(mean, low), room) + step for mean, step in zip(means, steps, strict=True)]


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
