"""The identifiability card of every variant: whether impedance could tell force and position at all."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.report import charts
from sensorgen.analysis.report.charts import Axis, Chart, Content, Trace
from sensorgen.analysis.report.tables import Cell, Column, Table, table
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.identifiability import FORCE_N

_COLUMNS = (
    Column("design"), Column("standard error of force", "N"), Column("standard error of position", "mm"),
    Column("correlation"), Column("verdict"),
)  # fmt: skip
_COLOURS = (charts.SKY, charts.BLUE, charts.ORANGE)


def table_of(found: Comparison) -> Table | None:
    """A row for each variant with a prediction; None where there is none."""
    rows = [
        _row(name, of.prediction.identifiability or {"reason": of.reason}) for name, of in found.predictions.items()
    ]
    if not rows:
        return None
    caption = f"Identifiability: what seven tones tell of {FORCE_N:g} N in the middle, by the prediction (Cramér-Rao)"
    return table("identifiability", caption, _COLUMNS, rows)


def _row(name: str, card: Mapping[str, object]) -> list[Cell]:
    force, place, together = (_number(card.get(key)) for key in ("sigma_force_n", "sigma_position_m", "correlation"))
    said = card.get("verdict") or card.get("reason") or "no prediction"
    return [name, force, place / M_PER_MM if place is not None else None, together, str(said)]


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def figure(found: Comparison) -> tuple[Chart, ...]:
    """Standard errors over the place of a press, for weak, middling and strong ones, of every variant with a card."""
    known: dict[str, Content] = {
        name: _lines(card)
        for name, of in found.predictions.items()
        if (card := of.prediction.identifiability or {}).get("map")
    }
    if not known:
        return ()
    return (
        Chart(
            "identifiability-map", "What impedance could tell: standard errors of force and position",
            "Least standard error (Cramér-Rao) of force above, of position below, over the place of the press, as the "
            "prediction of the chosen variant has it for its tones and noise. Dashed: what a press has to be known to. "
            "A gap in a line: undefined there.",
            known, Axis("position of the tip's centre [mm]"),
            (Axis("of force [N]", log=True), Axis("of position [mm]", log=True)), "variant",
        ),
    )  # fmt: skip


def _lines(card: Mapping[str, Any]) -> tuple[Trace, ...]:
    over, required = card["map"], card["required"]
    forces, place = over["force_n"], [x / M_PER_MM for x in over["position_m"]]
    traces: list[Trace] = []
    for row, key, unit in ((0, "sigma_force_n", 1.0), (1, "sigma_position_m", M_PER_MM)):
        for k, colour in zip((1, len(forces) // 2, len(forces) - 1), _COLOURS, strict=True):
            name = f"press of {forces[k]:g} N" if row == 0 else ""
            traces.append(Trace("line", name, place, _known(over[key][k], unit), colour=colour, row=row))
        needed = [required[key] / unit] * 2
        traces.append(
            Trace("line", "" if row else "required", [place[0], place[-1]], needed, colour=charts.GREY, dash="dash",
                  row=row)
        )  # fmt: skip
    return tuple(traces)


def _known(values: Sequence[float | None], unit: float) -> list[float]:
    return [nan if value is None else value / unit for value in values]
