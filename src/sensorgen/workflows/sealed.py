"""Sealed folders: what a folder's record says of its files, of itself and of other records, beside what is there.

A build is recorded in ``manifest.json``, a batch in ``batch.json``, a sliced file in ``NAME.gcode.json``: each has the
SHA-256 of its files and the identity of its design. Whoever rewrites a file and its record is found by the log.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sensorgen.core import files as store
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.core.files import SEAL, seal
from sensorgen.core.records import shown
from sensorgen.design.design import Design

if TYPE_CHECKING:
    from sensorgen.measure.log import Log

STALE = ".stale"  # suffix of G-code of another design
_WORDS = {"links": "link"}


@dataclass(frozen=True)
class Differences:
    """Differences of a folder from its record.

    Attributes
    ----------
    missing, changed, extra, links : tuple of str
        Names of files; a link is none of ours, whatever it leads to.
    record : tuple of str
        What is wrong with the record itself.

    Examples
    --------
    >>> bool(Differences())
    False
    """

    missing: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    record: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        """Test whether anything differs."""
        return any(vars(self).values())

    def document(self) -> Iterator[Part]:
        """A line for each file that differs."""
        yield from (f"{_WORDS.get(key, key):8} {name}" for key, names in vars(self).items() for name in names)
        yield "differs from its record" if self else "as recorded"


def read(path: Path, what: str) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A record, and the keys that it has twice.

    Raises
    ------
    BadInput
        There is none, or it is damaged; ``what`` names what was expected.
    """
    twice: list[str] = []

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        names = [name for name, _ in items]
        twice.extend(sorted({name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else ()))
        return dict(items)

    try:
        data = json.loads(path.read_text("utf-8"), object_pairs_hook=pairs)
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror or error}; expected the folder of {what}") from None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the record of {what}: {error}") from None
    hashes = data.get("files") if isinstance(data, dict) else None
    if not isinstance(hashes, dict) or not all(isinstance(value, str) for value in hashes.values()):
        raise BadInput(f"{path}: not the record of {what}: 'files' is {shown(hashes)}; expected names to hashes")
    return data, tuple(twice)


def batch_differences(folder: Path, record: str, log: "Log | None" = None) -> Differences:
    """Hash every file of a batch's folder again, and hold it against the record, and that against the log.

    Parameters
    ----------
    folder : Path
        As ``sensorgen batch`` wrote it.
    record : str
        Name of the record.
    log : Log, optional
        For the batch as it was logged.

    Raises
    ------
    BadInput
        No record, a damaged one, or a file that cannot be read.
    """
    from sensorgen.measure.log import Batch

    data, twice = read(folder / record, "a batch")
    wrong = [*_of_record(folder / record, data, twice)]
    logged = {row.file for row in log.entries(Batch, superseded=True) if row.batch == data.get("batch")} if log else ()
    if logged and sha256((folder / record).read_bytes()).hexdigest() not in logged:
        wrong.append(f"{record} is not the one that the log has of batch {data['batch']}")
    return _compared(folder, record, data["files"], tuple(wrong), others=False)


def build_differences(folder: Path, design: Design, log: "Log | None" = None) -> Differences:
    """Hash the files of a build again, and hold G-code, design and prediction against each other and the log.

    Parameters
    ----------
    folder : Path
        As ``sensorgen build`` wrote it.
    design : Design
        What it should hold.
    log : Log, optional
        For the design and its predictions as they were logged.

    Raises
    ------
    BadInput
        No record, a damaged one, or a file that cannot be read.
    """
    data, twice = read(folder / store.MANIFEST, "a build")
    wrong = [*_of_record(folder / store.MANIFEST, data, twice)]
    key = data.get("design")
    if key != design.id():
        wrong.append(f"the files are of design {shown(key)}; this one is {design.id()}")
    if log:
        wrong += _against_log(folder, str(key), data, log)
    for note in sorted(folder.glob("*.gcode.json")):
        sliced = _note(note)
        if sliced.get("design") != key:
            wrong.append(f"{note.stem} was sliced from design {shown(sliced.get('design'))}, not from this one")
        elif sliced.get(SEAL) != sha256(note.with_suffix("").read_bytes()).hexdigest():
            wrong.append(f"{note.stem} is not what was sliced")
    return _compared(folder, store.MANIFEST, data["files"], tuple(wrong), others=True)


def _of_record(path: Path, data: Mapping[str, Any], twice: tuple[str, ...]) -> Iterator[str]:
    yield from (f"key {name!r:.60} stands twice" for name in twice)
    if data.get(SEAL, "" if "batch" in data else seal(data)) != seal(data):  # builds of version 0.1.0 have none
        yield "it does not hold what was written"
    if path.is_symlink():
        yield f"{path.name} is a link"


def _against_log(folder: Path, key: str, data: Mapping[str, Any], log: "Log") -> Iterator[str]:
    from sensorgen.measure.log import DesignRow, Prediction

    row = next(log.entries(DesignRow, superseded=True, uid=key), None)
    if row and json.loads(row.data) != data.get("resolved"):
        yield f"{store.MANIFEST} has another design {key} than the log"
    stored = [json.loads(row.data) for row in log.entries(Prediction, superseded=True, design_id=key)]
    with suppress(OSError, ValueError):
        here = json.loads((folder / "prediction.json").read_text("utf-8"))
        if stored and "schema" in stored[-1] and here not in stored:
            yield f"prediction.json is none of the {len(stored)} predictions that the log has of design {key}"


def _compared(
    folder: Path, record: str, known: Mapping[str, str], wrong: tuple[str, ...], *, others: bool
) -> Differences:
    links, here = _there(folder, record)
    links = [name for name in links if name != record and (not others or name in known)]
    return Differences(
        missing=tuple(sorted(set(known) - set(here) - set(links))),
        changed=tuple(sorted(name for name in set(known) & set(here) if known[name] != here[name])),
        extra=() if others else tuple(sorted(set(here) - set(known))),
        links=tuple(links), record=wrong,
    )  # fmt: skip


def _there(folder: Path, record: str) -> tuple[list[str], dict[str, str]]:
    """Links in a folder, and the hashes of its files but for these and the record."""
    try:
        links = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_symlink())
        return links, {name: value for name, value in store.hashes(folder).items() if name not in (record, *links)}
    except OSError as error:
        raise BadInput(f"cannot read {error.filename!r}: {error.strerror or error}") from None


def set_aside(folder: Path, design: Design) -> tuple[str, ...]:
    """Rename G-code of another design, so that none lies under a good name beside this one; what was done, in words."""
    done = []
    for note in sorted(folder.glob("*.gcode.json")):
        other = _note(note).get("design")
        if isinstance(other, str) and other != design.id():
            for path in (note, note.with_suffix("")):
                with suppress(OSError):
                    path.replace(path.with_name(path.name + STALE))
            done.append(f"{note.stem} is of another design, {shown(other)}: it is {note.stem}{STALE} now; slice again")
    return tuple(done)


def _note(path: Path) -> dict[str, Any]:
    with suppress(OSError, ValueError, RecursionError):
        data = json.loads(path.read_text("utf-8"))
        if isinstance(data, dict):
            return data
    return {}
