"""Answers of ``sensorgen cell`` as text: for people, and as rows of a sweep."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from sensorgen.cli import show, sweeps

Data = dict[str, Any]

QUANTITIES = {
    "relative_permittivity": "relative permittivity",
    "loss_tangent": "loss tangent",
    "resistivity_ohm_m": "resistivity [ohm m]",
}
COLUMNS = (
    "lower_f_per_m2",
    "upper_f_per_m2",
    "loss_lower_f_per_m2",
    "loss_upper_f_per_m2",
    "relative_width",
    "model",
    "seconds",
    "reached",
    "reason",
)
OF_FORMULAS = ("value_f_per_m2", "model", "reason")


def lines(data: Data, *, explain: bool) -> Iterator[str]:
    """An answer for a person, with what came of the plan if asked for."""
    low, high = data["lower_f_per_m2"], data["upper_f_per_m2"]
    if explain:
        yield "measured"
        yield from (f"  {line}" for line in measured(data["plan"]))
        yield ""
    low_f, high_f = (show.si(end * data["area_m2"], "F") for end in (low, high))
    yield f"{data['design']}, {data['body']}: {low_f} to {high_f}"
    yield f"{'per area':12}{low:.10g} to {high:.10g} F/m2"
    if "loss_lower_f_per_m2" in data:
        yield from _loss(data)
    yield f"{'width':12}{data['relative_width']:.2g} relative (target {data['accuracy']:g})"
    when = ", stored" if data["known"] else ""
    yield f"{'model':12}{data['model']}, {data['seconds']:.2g} s{when}"
    for quantity in dict.fromkeys(v["quantity"] for v in data["values"]):
        here = [v for v in data["values"] if v["quantity"] == quantity]
        values = ", ".join(f"{v['material']} {v['value']:g} ({v['source']})" for v in here)
        yield f"{'with':12}{QUANTITIES[quantity]} of {values}"


def _loss(data: Data) -> Iterator[str]:
    low, high = data["loss_lower_f_per_m2"], data["loss_upper_f_per_m2"]
    at = f" at {show.si(data['frequency_hz'], 'Hz')}" if data["frequency_hz"] else ""
    yield f"{'loss':12}{low:.10g} to {high:.10g} F/m2, minus the imaginary part{at}"
    if data["tan_delta"]:
        yield f"{'tan delta':12}{data['tan_delta'][0]:.6g} to {data['tan_delta'][1]:.6g}"


def measured(plan: Iterable[Data]) -> Iterator[str]:
    """What each model of a plan gave, or why it was not asked."""
    for c in plan:
        yield f"{c['model']:10}{_reached(c):32}{c['passed_over']}".rstrip()


def _reached(c: Data) -> str:
    return (
        "not run" if c["seconds"] is None else f"{c['width']:.2g} in {show.si(float(format(c['seconds'], '.2g')), 's')}"
    )


def table(key: str, rows: Sequence[Data]) -> Iterator[str]:
    """A sweep for a person."""
    yield f"{key:>16}  {'lower [F/m2]':>16}  {'upper [F/m2]':>16}  {'width':>9}  {'seconds':>8}  model\n"
    for row in rows:
        if row["model"] is None:
            yield f"{sweeps.cell(row[key]):>16}  no answer: {row['reason']}\n"
        else:
            yield (
                f"{sweeps.cell(row[key]):>16}  {row['lower_f_per_m2']:16.9g}  {row['upper_f_per_m2']:16.9g}  "
                f"{row['relative_width']:9.2g}  {row['seconds']:8.2g}  {row['model']}\n"
            )


def formula_table(key: str, rows: Sequence[Data], model: str) -> Iterator[str]:
    """What a formula gives along a sweep, for a person."""
    yield f"{key:>16}  {f'{model} [F/m2]':>24}  without bounds\n"
    for row in rows:
        why = "" if row["model"] else row["reason"]
        yield f"{sweeps.cell(row[key]):>16}  {sweeps.cell(row['value_f_per_m2']):>24}  {why}".rstrip() + "\n"


def formula_lines(data: Data) -> Iterator[str]:
    """What a formula gives, for a person."""
    pressed = f", pressed by {data['press_mm']:g} mm" if data["press_mm"] is not None else ""
    yield f"{data['design']}: {data['value_f_per_m2']:.10g} F/m2 by {data['model']}{pressed}\n"
    yield f"{data['reason']}\n"
