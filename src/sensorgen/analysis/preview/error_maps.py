"""Maps of the standard errors of force and position in four grades."""

from dataclasses import dataclass

from sensorgen.prediction.identifiability.results import GUESS, Identifiability, Rows, metres, newtons


@dataclass(frozen=True)
class MapSquare:
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
    cells: tuple[MapSquare, ...]
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
            cells.append(MapSquare(c, len(of.force_n) - 1 - r, grade, f"{force:g} N at {place * 1e3:.3g} mm: {shown}"))
    ends = (f"{min(of.position_m) * 1e3:g}", f"{max(of.position_m) * 1e3:g} mm", f"{min(of.force_n):g}",
            f"{max(of.force_n):g} N")  # fmt: skip
    rows = len(of.force_n) - (0.0 in of.force_n)
    return ErrorMapShown(
        f"error of {quantity}", f"{words(need)} or better", len(of.position_m), rows, tuple(cells), ends
    )
