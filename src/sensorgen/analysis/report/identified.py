"""Identifiability of every variant: standard errors of force and position that impedance allows."""

from collections.abc import Sequence
from math import nan

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.report import charts
from sensorgen.analysis.report.charts import Axis, Chart, Content, Trace
from sensorgen.analysis.report.tables import Cell, Column, Table, table
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.identifiability import FORCE_N, Identifiability

_COLUMNS = (
    Column("design"), Column("standard error of force", "N"), Column("standard error of position", "mm"),
    Column("correlation"), Column("verdict"),
)  # fmt: skip
_COLOURS = (charts.SKY, charts.BLUE, charts.ORANGE)


def table_of(found: Comparison) -> Table | None:
    """A row for each variant with a prediction; None where there is none."""
    rows = [_row(name, of.prediction.identifiability, of.reason) for name, of in found.predictions.items()]
    if not rows:
        return None
    caption = (
        f"Identifiability: predicted standard errors at {FORCE_N:g} N in the middle, seven frequencies (Cramér-Rao)"
    )
    return table("identifiability", caption, _COLUMNS, rows)


def _row(name: str, found: Identifiability | None, reason: str) -> list[Cell]:
    if found is None:
        return [name, None, None, None, reason or "no prediction"]
    place = found.sigma_position_m
    return [name, found.sigma_force_n, place and place / M_PER_MM, found.correlation, found.verdict]


def figure(found: Comparison) -> tuple[Chart, ...]:
    """Standard errors over the place of a press, for weak, middling and strong ones, of every variant with a card."""
    known: dict[str, Content] = {
        name: _lines(card) for name, of in found.predictions.items() if (card := of.prediction.identifiability)
    }
    if not known:
        return ()
    return (
        Chart(
            "identifiability-map", "Identifiability: standard errors of force and position",
            "Least standard error (Cramér-Rao) of force above, of position below, over the place of the press, as the "
            "prediction of the chosen variant has it for its frequencies and noise. Dashed: required. "
            "A gap in a line: undefined there.",
            known, Axis("position of the tip's centre [mm]"),
            (Axis("of force [N]", log=True), Axis("of position [mm]", log=True)), "variant",
        ),
    )  # fmt: skip


def _lines(card: Identifiability) -> tuple[Trace, ...]:
    over, need = card.map, card.required
    place = [x / M_PER_MM for x in over.position_m]
    traces: list[Trace] = []
    for row, (sigma, needed, unit) in enumerate(
        [(over.sigma_force_n, need.sigma_force_n, 1.0), (over.sigma_position_m, need.sigma_position_m, M_PER_MM)]
    ):
        for k, colour in zip((1, len(sigma) // 2, len(sigma) - 1), _COLOURS, strict=True):
            name = f"press of {over.force_n[k]:g} N" if row == 0 else ""
            traces.append(Trace("line", name, place, _known(sigma[k], unit), colour=colour, row=row))
        ends, level = [place[0], place[-1]], _known([needed] * 2, unit)
        traces.append(Trace("line", "" if row else "required", ends, level, colour=charts.GREY, dash="dash", row=row))
    return tuple(traces)


def _known(values: Sequence[float | None], unit: float) -> list[float]:
    return [nan if value is None else value / unit for value in values]
