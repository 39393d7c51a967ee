"""Labels of specimens: a page to print on A4 with QR codes, and tabs with the name in raised letters at the far end.

::

    ____________________ _________
     sensor             | 26 TRIX |
     contacts at x = 0  | .2MM 1  |
    ____________________|_________|

Letters on a tab are made of squares wider than a printed line, so that every stroke is one line at least; the tab is of
the dielectric and touches the sensor with its edge alone.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from markupsafe import Markup

from sensorgen.analysis.plots import pages
from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.design.design import Design
from sensorgen.scene.lettering import FONT, LINE_DOTS, dots, runs
from sensorgen.scene.scene import Body, Prism, box
from sensorgen.workflows.batch.plan import PrintPiece


@dataclass(frozen=True)
class Label:
    """Content of one label.

    Attributes
    ----------
    piece : PrintPiece
        The specimen.
    batch : str
        Name of the batch.
    place : int
        Its number on the plate.
    log_head : str
        Identity of the last record of the log then, which anchors the predictions in it; "" without a log.
    """

    piece: PrintPiece
    batch: str
    place: int
    log_head: str = ""

    @property
    def code(self) -> str:
        """Content of the QR code: the name first, then batch and design, a line each."""
        return f"{self.piece.name}\n{self.batch}\n{self.piece.design_id}"


def page(labels: Iterable[Label], title: str) -> str:
    """HTML of a page of labels; it needs nothing but itself.

    Parameters
    ----------
    labels : iterable of Label
        In the order of the plate.
    title : str
        Name of the batch.

    Raises
    ------
    MissingValue
        The library for QR codes is not installed.
    """
    return pages.render("sensorgen.workflows.batch", "labels.html", title=title, labels=labels, qr=_qr)


def _qr(text: str) -> Markup:
    """A QR code as SVG; error correction M bears a scratch or a stain."""
    try:
        import segno
    except ImportError:
        raise MissingValue(
            "QR codes need the library segno: pip install segno, or set 'labels: {sheet: false}' in the plan"
        ) from None
    svg = segno.make(text, error="m", micro=False).svg_inline(border=4, omitsize=True)
    return Markup(svg)  # noqa: S704 - of squares alone


PLATE_MM = 0.6
RAISED_MM = 0.3
MARGIN_DOTS = 1


def dot_mm(design: Design) -> float:
    """Side of the squares that letters are made of: a tenth wider than a printed line [mm]."""
    return math.ceil(design.machine.line_mm() * 110) / 100


def size_mm(design: Design, name: str) -> tuple[float, float]:
    """Length and width of a tab [mm].

    Raises
    ------
    BadInput
        The sensor is narrower than a line of letters, or the name has a letter that the font lacks.
    """
    dot, width_mm = dot_mm(design), design.printed.size_mm[1]
    lines = _lines(name, width_mm / dot)
    if not lines:
        raise BadInput(
            f"{design.name} is {width_mm:g} mm wide, too little for a tab with {name!r}: "
            "set 'labels: {tab: false}' in the plan, the sheet has the names too"
        )
    length = max(map(dots, lines)) + 2 * MARGIN_DOTS
    return length * dot, width_mm


def bodies(design: Design, name: str) -> tuple[Body, ...]:
    """The tab of a specimen, in the coordinates of its printed sensor, at the end x = length.

    Parameters
    ----------
    design : Design
        The sensor; its dielectric prints the tab.
    name : str
        What is written on it.

    Raises
    ------
    BadInput
        See :func:`size_mm`.
    """
    long_mm, width_mm = size_mm(design, name)
    x0, dot = design.printed.size_mm[0], dot_mm(design)
    plate = box(x0, x0 + long_mm, 0.0, width_mm, 0.0, PLATE_MM)
    letters = _letters(_lines(name, width_mm / dot), x0, width_mm, dot)
    material = design.slot("dielectric")[0].name
    return (Body("label", material, (plate, *letters)),)


def _letters(lines: Sequence[str], x0: float, width_mm: float, dot: float) -> Iterator[Prism]:
    """The squares of all letters, rows of a stroke as one piece."""
    deep = (len(lines) * (LINE_DOTS + 1) - 1) * dot
    top = (width_mm + deep) / 2
    for number, line in enumerate(lines):
        for row in range(LINE_DOTS):
            y = top - (number * (LINE_DOTS + 1) + row + 1) * dot
            for start, end in runs(line, row):
                x = x0 + MARGIN_DOTS * dot
                yield box(x + start * dot, x + end * dot, y, y + dot, PLATE_MM, PLATE_MM + RAISED_MM)


def _lines(name: str, width_dots: float) -> list[str]:
    """The name on as many lines as the width has room for, the longest as short as can be; none if there is no room."""
    words = name.upper().split()
    lacking = sorted(set(name.upper()) - set(FONT) - {" "})
    if lacking:
        raise BadInput(f"no letter {lacking[0]!r} for the tab of {name!r}; expected {''.join(sorted(FONT))}")
    most = int((width_dots - 2 * MARGIN_DOTS + 1 + 1e-9) // (LINE_DOTS + 1))
    choices = [
        _broken(words, limit)
        for limit in sorted({dots(" ".join(words[a:b])) for a, b in combinations(range(len(words) + 1), 2)})
    ]
    return next((lines for lines in choices if lines and len(lines) <= most), [])


def _broken(words: Sequence[str], limit: int) -> list[str]:
    """Words on lines of at most ``limit`` dots; none where a word is longer."""
    lines: list[str] = []
    for word in words:
        if lines and dots(f"{lines[-1]} {word}") <= limit:
            lines[-1] += f" {word}"
        elif dots(word) <= limit:
            lines.append(word)
        else:
            return []
    return lines
