"""Shades for the page: colours of bodies on a light and a dark ground, and maps of standard errors in four grades."""

from dataclasses import dataclass

from sensorgen.prediction.identifiability.results import GUESS, Identifiability, Rows, metres, newtons

LIGHT, DARK = "#ffffff", "#14171b"  # the page's grounds, as of page.css
LEAST = {LIGHT: 1.5, DARK: 3.2}  # contrast of a body with the ground, by WCAG 2 [-]
_APART = 0.2  # share of the ink that parts bodies of one material


def shades(colour: str, number: int) -> tuple[str, str]:
    """A material's colour for its ``number``-th body, on a light and on a dark ground.

    >>> shades("#303436", 0)
    ('#303436', '#66696a')
    """
    own = _rgb(colour)
    light, dark = _clear(own, LIGHT, 0.0), _clear(own, DARK, 255.0)
    towards = 255.0 if luminance(own) < 0.4 else 0.0
    return _hex(_moved(light, towards, number)), _hex(_moved(dark, towards, number))


def _moved(colour: tuple[float, ...], end: float, number: int) -> tuple[float, ...]:
    """The shade of the ``number``-th body."""
    share = min(_APART * number, 0.6)
    return tuple(v + (end - v) * share for v in colour)


def _clear(colour: tuple[float, ...], ground: str, end: float) -> tuple[float, ...]:
    """The colour moved towards black or white until it contrasts with the ground."""
    for step in range(101):
        moved = tuple(v + (end - v) * step / 100 for v in colour)
        if contrast(moved, _rgb(ground)) >= LEAST[ground]:
            return moved
    return colour


def contrast(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Contrast ratio of two colours, WCAG 2.2: (L1 + 0.05) / (L2 + 0.05), from 1 to 21 [-]."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: tuple[float, ...]) -> float:
    """Relative luminance of an sRGB colour of 0 to 255, WCAG 2.2 [-]."""
    linear = ((v / 255 / 12.92) if v / 255 <= 0.04045 else ((v / 255 + 0.055) / 1.055) ** 2.4 for v in colour)
    return sum(share * v for share, v in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(float(int(colour[k : k + 2], 16)) for k in (1, 3, 5))


def _hex(colour: tuple[float, ...]) -> str:
    return "#" + "".join(f"{round(v):02x}" for v in colour)


@dataclass(frozen=True)
class Cell:
    """Column and row in the picture, grade from 0, and the value in words."""

    column: int
    row: int
    grade: int
    words: str


@dataclass(frozen=True)
class ErrorMapShown:
    """A map: what it shows, what counts as resolved, numbers of columns and rows, and its cells."""

    title: str
    required: str
    columns: int
    rows: int
    cells: tuple[Cell, ...]
    ends: tuple[str, str, str, str]  # of the position and of the force axis


def maps(known: Identifiability | None) -> tuple[ErrorMapShown, ...]:
    """Both maps; none where nothing is known."""
    if known is None or not known.map.force_n:
        return ()
    of, need = known.map, known.required
    force, length = max(abs(f) for f in of.force_n), max(of.position_m)
    return (
        _map(known, "force", of.sigma_force_n, need.sigma_force_n or 0.0, GUESS * force),
        _map(known, "position", of.sigma_position_m, need.sigma_position_m or 0.0, GUESS * length),
    )


def _map(known: Identifiability, quantity: str, sigma: Rows, need: float, useless: float) -> ErrorMapShown:
    of, words = known.map, newtons if quantity == "force" else metres
    cells = []
    for r, (force, row) in enumerate(zip(of.force_n, sigma, strict=True)):
        for c, (place, value) in enumerate(zip(of.position_m, row, strict=True)):
            if not force:
                continue
            grade = 3 if value is None else 0 if value <= need else 1 if value < useless else 2
            shown = "undefined" if value is None else words(value) if grade < 2 else "no information"
            cells.append(Cell(c, len(of.force_n) - 1 - r, grade, f"{force:g} N at {place * 1e3:.3g} mm: {shown}"))
    ends = (f"{min(of.position_m) * 1e3:g}", f"{max(of.position_m) * 1e3:g} mm", f"{min(of.force_n):g}",
            f"{max(of.force_n):g} N")  # fmt: skip
    rows = len(of.force_n) - (0.0 in of.force_n)
    return ErrorMapShown(
        f"error of {quantity}", f"{words(need)} or better", len(of.position_m), rows, tuple(cells), ends
    )
