"""The log as a person at a terminal, or a program, wants to read it."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sensorgen.cli.show import si

if TYPE_CHECKING:
    from sensorgen.measure.log import BenchRun, Entry, Log, Reading

_REMARK = 20  # letters of a remark in a list


def visible(text: str) -> str:
    """Text of strangers, its control characters shown instead of obeyed by the terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def ohms(values: Sequence[float]) -> str:
    """Readings for people; nothing where nothing was measured."""
    return ", ".join("OL" if math.isinf(value) else si(value, "ohm") for value in values) or "-"


def short(values: Sequence[float]) -> str:
    """Readings for a list, as people write them [ohm]; below 1 ohm without a prefix, for m would be taken for mega.

    >>> short((0.8, 650.0, 2300.0, 1.1e6, math.inf)), short(())
    ('0.8 / 650 / 2.3k / 1.1M / OL', '-')
    """
    return " / ".join(f"{value:g}" if abs(value) < 1 else _prefixed(value) for value in values) or "-"


def _prefixed(value: float) -> str:
    return "OL" if math.isinf(value) else si(value, "").replace(" ", "")


def readings(found: Sequence["Reading"]) -> Iterator[str]:
    """A line for each reading, "?" where something is to be doubted."""
    yield f"{'no.':>6}  {'specimen':21} {'Y [ohm]':>11} {'Z [ohm]':>15}   remark"
    for r in found:
        state = {None: "", True: "baked; ", False: "" if "bake" in r.remark else "not baked; "}[r.baked]
        remark = visible(state + r.remark)
        said = remark if len(remark) <= _REMARK else remark[: _REMARK - 1] + "…"
        doubt = "?" if r.doubts else " "
        line = f"{r.number:6}  {visible(r.specimen):21} {short(r.y_ohm):>11} {short(r.z_ohm):>15} {doubt} {said}"
        yield line.rstrip("; ")


def runs(found: Sequence["BenchRun"]) -> Iterator[str]:
    """A line for each recording of the bench."""
    for run in found:
        yield f"{run.number:6}  {visible(run.specimen):21} recording {run.file[:12]}  {visible(run.remark)}".rstrip()


def reading(r: "Reading") -> Iterator[str]:
    """Everything about one reading."""
    yield f"reading {r.number}: {visible(r.specimen)}" + (
        f", written {visible(r.written)!r}" if r.written != r.specimen else ""
    )
    facts = {
        "Y": _said(r.y_words, r.y_ohm),
        "Z": _said(r.z_words, r.z_ohm),
        "baked": {None: "", True: "yes", False: "no"}[r.baked],
        "remark": r.remark,
        "measured": r.measured_at,
        "instrument": r.instrument,
        "design": f"{r.design} ({r.design_id})" if r.design_id else "",
        "batch": r.batch,
        "source": r.source + (f", row {r.source_row}" if r.source_row is not None else ""),
        "logged": r.logged_at,
    }
    yield from (f"  {name:11}{visible(fact)}" for name, fact in facts.items() if fact)
    yield from (f"  {'doubtful':11}{visible(doubt)}" for doubt in r.doubts)


def _said(words: str, ohm: Sequence[float]) -> str:
    return f"{ohms(ohm)}, written {words!r}" if words else ""


def run(b: "BenchRun") -> Iterator[str]:
    """Everything about one recording."""
    yield f"recording {b.number}: {visible(b.specimen)}"
    facts = {name: getattr(b, name) for name in ("file", "rig_file", "remark", "design", "batch", "logged_at")}
    yield from (f"  {name:11}{visible(fact)}" for name, fact in facts.items() if fact)
    yield from (f"  {visible(line)}" for line in _summary(b))


def _summary(run: "BenchRun") -> Iterator[str]:
    """Samples, marks and clocks of a recording as it was logged."""
    from sensorgen.measure.log import facts

    logged = facts.from_json(run.facts)
    for one in logged.lockins:
        yield from counted(one.lockin, one.counts, one.tones_hz, one.seconds, one.program or one.format)
    if logged.rig:
        marked = f"; {logged.rig.samples} samples beside them, or while it was silent" if logged.rig.samples else ""
        yield rig_counted({"rows": logged.rig.rows, "errors": logged.rig.errors}) + marked
        yield from (f"{'':11}{line}" for line in (logged.rig.clocks, *logged.rig.notes))


def counted(
    lockin: int, counts: Mapping[str, int], tones_hz: Sequence[float], seconds: float, by: str
) -> Iterator[str]:
    """Samples of one lock-in, those that are sound, and marks."""
    said = ", ".join(f"{n} {mark}" for mark, n in counts.items() if n and mark not in ("samples", "valid"))
    yield f"lock-in {lockin}  {counts['samples']} samples, {counts['valid']} of them sound; {said or 'no marks'}"
    yield f"{'':11}{', '.join(si(tone, 'Hz') for tone in tones_hz)}; {seconds:.5g} s by {by}"


def rig_counted(counts: Mapping[str, int]) -> str:
    """Rows of the rig's log, and those with errors."""
    return f"{'rig':11}{counts['rows']} rows, {counts['errors']} with errors"


def plain(entry: "Entry") -> dict[str, Any]:
    """A row as data for JSON, which has no infinity: an overload is "OL"."""
    return {name: _plain(value) for name, value in dataclasses.asdict(entry).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return "OL" if isinstance(value, float) and math.isinf(value) else value


def of(entry: "Entry") -> Iterator[str]:
    """Everything about any row."""
    from sensorgen.measure.log import BenchRun, Reading

    if isinstance(entry, Reading):
        return reading(entry)
    if isinstance(entry, BenchRun):
        return run(entry)
    return other(entry)


def corrections(entry: "Entry", log: "Log") -> Iterator[str]:
    """Which row this one corrects, and which one corrects it."""
    from sensorgen.measure.log import BenchRun, Reading

    if isinstance(entry, Reading | BenchRun):
        if entry.supersedes:
            yield from (
                f"  {'corrects':11}row {old.number}"
                for old in log.entries(type(entry), superseded=True, uid=entry.supersedes)
            )
        yield from (
            f"  {'corrected':11}by row {new.number}"
            for new in log.entries(type(entry), superseded=True, supersedes=entry.uid)
        )


def other(entry: "Entry") -> Iterator[str]:
    """A print or a prediction, in a few words."""
    names = ("specimen", "design", "design_id", "batch_uid")
    said = ", ".join(f"{name} {visible(str(value))}" for name, value in vars(entry).items() if name in names)
    yield f"{type(entry).__name__.lower()} {entry.number}: {said}"
    yield f"  {'logged':11}{entry.logged_at}"
