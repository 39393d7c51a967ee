"""Origin of everything in a report: versions, hashes, sources."""

import platform
from collections import Counter
from dataclasses import dataclass
from importlib.metadata import version
from typing import Annotated

from sensorgen.analysis.comparison import Comparison
from sensorgen.core.document import Column, Table
from sensorgen.core.version import __version__
from sensorgen.design.materials import SET, citations
from sensorgen.measure.log import Anchor, Log, RawFile

LIBRARIES = ("numpy", "scipy", "plotly", "matplotlib", "jinja2")


@dataclass(frozen=True)
class Origin:
    """A program, file, prediction or source."""

    kind: Annotated[str, Column("kind")]
    name: Annotated[str, Column("name")]
    which: Annotated[str, Column("which")]


def origins(log: Log, comparison: Comparison, *, brief: bool = False) -> Table:
    """Versions, the log, raw files, designs with the predictions of each, and sources of material values.

    Parameters
    ----------
    log : Log
        An open one.
    found : Comparison
        What the report is of.
    brief : bool
        Only program, log and predictions.
    """
    records, head = log.head()
    readings = Counter(r.reading.words.source for r in comparison.rows)
    predictions = [
        Origin("prediction", f"{p.design} ({p.design_id})", p.provenance) for p in comparison.predictions.values()
    ]
    program = Origin("program", "sensorgen", __version__)
    logged = Origin("log", log.path.name, f"{records} records; head {head}")
    if brief:
        return Table.of("provenance", "Program, log and prediction", (program, logged, *predictions))
    anchors = log.entries(Anchor)
    rows = [
        program, Origin("program", "Python", platform.python_version()),
        *(Origin("library", name, version(name)) for name in LIBRARIES),
        logged,
        *(Origin("anchor", a.file, f"{a.logged_at}: record {log.sequence(a.head)}, {a.head}") for a in anchors),
        *(Origin("raw file", f.name, f"SHA-256 {f.uid}, {f.size} bytes") for f in log.entries(RawFile)),
        *(Origin("source of readings", name, f"{count} readings") for name, count in sorted(readings.items())),
        *predictions, *_sources(comparison),
    ]  # fmt: skip
    return Table.of("provenance", "Programs, files, designs and sources", tuple(rows))


def _sources(comparison: Comparison) -> list[Origin]:
    used: dict[str, set[str]] = {}
    for of in comparison.predictions.values():
        for value in of.prediction.values:
            used.setdefault(value.source, set()).add(f"{value.material} {value.quantity} = {value.value:.6g}")
    known = citations() | {SET: "by the design itself"}
    return [
        Origin("source of values", name, f"{known.get(name, name)}: {', '.join(sorted(values))}")
        for name, values in sorted(used.items())
    ]
