"""Answers of ``sensorgen compress`` as text: for people, and as rows of a sweep."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import Any

from sensorgen.cli import plan_text, sweeps

Data = dict[str, Any]

_PF_PER_F = 1e12
_LOADS = ("stress_kpa", "displacement_um", "lower_f_per_m2", "upper_f_per_m2")
COLUMNS = (*_LOADS, "converged_kpa", "relative_width", "model", "reached", "reason")
_HEAD = f"{'stress [kPa]':>12}  {'displacement [um]':>17}  capacitance [pF/m2]"


def lines(data: Data, *, explain: bool) -> Iterator[str]:
    """An answer for a person, with what came of the plan if asked for."""
    if explain:
        from sensorgen.prediction.plan import of_plain

        yield from (*plan_text.lines(of_plain(data["plan"])), "")
    yield _HEAD
    yield from (_load(load) for load in loads([data]))
    if "accuracy" in data and data["relative_width"] is not None:
        yield f"largest relative width {data['relative_width']:.2g} (target {data['accuracy']:g})"
    yield f"{data['model']}, converged up to {data['converged_kpa']:.4g} kPa; {_held(data)}"
    yield f"body: {data['body']}"
    yield from (f"doubt: {doubt}" for doubt in data["doubts"])


def table(key: str, rows: Sequence[Data]) -> Iterator[str]:
    """A sweep for a person: a line for each value and stress, and below them what else there is to say of which."""
    wide = max(16, len(key))
    yield f"{key:>{wide}}  {_HEAD}"
    for row in rows:
        value = f"{sweeps.cell(row[key]):>{wide}}"
        if row["model"] is None:
            yield f"{value}  no answer: {row['reason']}"
        else:
            yield from (f"{value}  {_load(load)}" for load in loads([row]))
    remarks = [_remarks(row) for row in rows]
    for remark in dict.fromkeys(chain(*remarks)):
        where = [sweeps.cell(row[key]) for row, own in zip(rows, remarks, strict=True) if remark in own]
        yield f"{remark} ({key} {', '.join(where)})" if len(where) < len(rows) else remark


def _remarks(data: Data) -> list[str]:
    """How a piece was held, what is wrong with its answer, and what is to be doubted."""
    if data["model"] is None:
        return []
    body = [f"body: {data['body']}"]
    wrong = [f"fault: {fault}" for fault in data["faults"]]
    return [f"{data['model']}: {_held(data)}", *body, *wrong, *(f"doubt: {doubt}" for doubt in data["doubts"])]


def _held(data: Data) -> str:
    return ", ".join(f"{key} {value}" for key, value in data["held"].items())


def loads(rows: Iterable[Data]) -> Iterator[Data]:
    """Answers taken apart, a row for each stress; one without an answer is a row with its reason."""
    for row in rows:
        if row["model"] is None:
            yield row
            continue
        common = {name: row[name] for name in row if name not in _LOADS}
        why = "; ".join(row["faults"])
        for load in zip(*(row[name] for name in _LOADS), strict=True):
            yield common | dict(zip(_LOADS, load, strict=True)) | {"reason": why}


def _load(load: Data) -> str:
    lower, upper = load["lower_f_per_m2"], load["upper_f_per_m2"]
    bounds = f"{lower * _PF_PER_F:.7g} to {upper * _PF_PER_F:.7g}" if lower is not None else "not known"
    return f"{load['stress_kpa']:12.4g}  {load['displacement_um']:17.4g}  {bounds}"
