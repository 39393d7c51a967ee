"""Where everything in a report comes from: versions, hashes, sources."""

import platform
from hashlib import file_digest
from importlib.metadata import version
from pathlib import Path

from sensorgen import __version__
from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.report.tables import Column, Table, table
from sensorgen.design.materials import SET, citations
from sensorgen.measure.log import Log, RawFile

LIBRARIES = ("numpy", "scipy", "plotly", "matplotlib")


def origins(log: Log, found: Comparison) -> Table:
    """Versions, the log, raw files, designs with the predictions of each, and sources of material values."""
    rows = [("program", "sensorgen", __version__)]
    rows += [("program", "Python", platform.python_version())]
    rows += [("library", name, version(name)) for name in LIBRARIES]
    rows += [("log", log.path.name, f"SHA-256 {_sha256(log.path)}, at the time of the report")]
    rows += [("raw file", file.name, f"SHA-256 {file.uid}, {file.size} bytes") for file in log.entries(RawFile)]
    rows += [
        ("source of readings", name, f"{count} readings")
        for name, count in sorted(_counts([r.reading.source for r in found.rows]).items())
    ]
    rows += [("prediction", f"{p.design} ({p.design_id})", p.provenance) for p in found.predictions.values()]
    rows += [("source of values", name, text) for name, text in _sources(found)]
    return table(
        "provenance", "Programs, files, designs and sources", (Column("kind"), Column("name"), Column("which")), rows
    )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def _counts(names: list[str]) -> dict[str, int]:
    return {name: names.count(name) for name in set(names)}


def _sources(found: Comparison) -> list[tuple[str, str]]:
    used: dict[str, set[str]] = {}
    for of in found.predictions.values():
        for value in of.prediction.values:
            used.setdefault(value.source, set()).add(f"{value.material} {value.quantity} = {value.value:.6g}")
    known = citations() | {SET: "by the design itself"}
    return [(name, f"{known.get(name, name)}: {', '.join(sorted(values))}") for name, values in sorted(used.items())]
