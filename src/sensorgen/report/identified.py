"""The identifiability card of every variant: whether impedance could tell force and position at all."""

from collections.abc import Mapping

from sensorgen.card import FORCE_N
from sensorgen.comparison import Comparison
from sensorgen.report.tables import Cell, Column, Table, table

_COLUMNS = (
    Column("design"), Column("standard error of force", "N"), Column("standard error of position", "mm"),
    Column("correlation"), Column("verdict"),
)  # fmt: skip


def table_of(found: Comparison) -> Table | None:
    """A row for each variant with a prediction; None where there is none."""
    rows = [_row(name, of.card) for name, of in found.predictions.items()]
    if not rows:
        return None
    caption = f"Identifiability: what seven tones tell of {FORCE_N:g} N in the middle, by the prediction (Cramér-Rao)"
    return table("identifiability", caption, _COLUMNS, rows)


def _row(name: str, card: Mapping[str, object]) -> list[Cell]:
    force, place, together = (_number(card.get(key)) for key in ("sigma_force_n", "sigma_position_m", "correlation"))
    said = card.get("verdict") or card.get("reason") or "no prediction"
    return [name, force, place * 1e3 if place is not None else None, together, str(said)]


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None
