"""Bind specimens to the design that they were printed of, one by one or by a print bed's record; log its prediction."""

import hashlib
import json
import re
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import Field

from sensorgen.core import files as store
from sensorgen.core.errors import BadInput, MissingValue, NotTrusted, SensorgenError, within
from sensorgen.core.records import Strict, checked, shown
from sensorgen.core.version import __version__
from sensorgen.design.design import Design, load, of_resolved
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import notes
from sensorgen.measure.log.entries import Batch, BenchRun, DesignRow, Entry, Prediction, Print, RawFile, Reading
from sensorgen.measure.log.logbook import Log

MOST_BYTES = 64_000_000


class _Piece(Strict, extra="ignore"):
    """One specimen on the bed; version 0.1.0 has its prediction in ``expected``."""

    design_id: str = Field(min_length=1)
    design: str
    expected: dict[str, Any] | None = None


class _Design(Strict, extra="ignore"):
    """A design on the bed, with everything that decides it."""

    name: str
    resolved: dict[str, Any]


class _Slicer(Strict, extra="ignore"):
    """Predictions of the designs as one slicer prints them, by design."""

    printed: dict[str, dict[str, Any]] | None = None


class _Record(Strict, extra="ignore"):
    """The parts of ``batch.json`` that are logged."""

    specimens: dict[str, _Piece]
    designs: dict[str, _Design] = Field(default_factory=dict)
    predictions: dict[str, dict[str, Any]] | None = None
    batch: str | None = None
    slicers: dict[str, _Slicer] | None = None


def rows(path: Path, file: RawFile) -> Iterator[Entry]:
    """Rows of a print bed: its file, the batch, and the prints with their predictions.

    Parameters
    ----------
    path : Path
        ``batch.json``.
    file : RawFile
        Its row as a raw file.

    Raises
    ------
    BadInput
        Not the record of a batch, or one that was changed; with the file's name, and the key.
    """
    data = _json(path)
    with within(str(path)):
        record = checked(_Record, data)
        if data.get(store.SEAL, "") not in ("", store.seal(data)):
            raise BadInput("it does not hold what was written; see: sensorgen batch verify FOLDER")
        yield file
        yield Batch(uid=file.uid, batch=record.batch or path.absolute().parent.name, file=file.uid)
        for key, design in record.designs.items():
            yield design_row(key, design.name, design.resolved)
        pieces = (row for name, piece in record.specimens.items() for row in _piece(file.uid, name, piece, record))
        yield from dict.fromkeys(pieces)  # copies of one design share a prediction


def _piece(batch: str, name: str, piece: _Piece, record: _Record) -> Iterator[Entry]:
    of = notes.named(name).specimen
    yield Print(
        **vars(of), uid=f"{batch} {of.specimen}", batch_uid=batch, design_id=piece.design_id, design=piece.design
    )
    if record.predictions and piece.design_id in record.predictions:
        yield prediction(piece.design_id, piece.design, record.predictions[piece.design_id])
    elif piece.expected:
        slicers = (record.slicers or {}).items()
        printed = {slicer: used.printed[piece.design_id] for slicer, used in slicers
                   if used.printed and piece.design_id in used.printed}  # fmt: skip
        yield prediction(piece.design_id, piece.design, piece.expected | ({"printed": printed} if printed else {}))


def designs(log: Log, refused: dict[str, str] | None = None) -> dict[str, Design]:
    """Designs in the log by their identity when they were logged; without those that cannot be read here.

    Of those whose shape the user has not trusted, ``refused`` gets the reason.
    """
    by_identity = dict[str, Design]()
    recorded = [(row.uid, row.design, row.data) for row in log.entries(DesignRow)]
    for batch in log.batches():  # before version 3 the log had them in the files of batches only
        with suppress(SensorgenError):
            data = _json(log.raw(batch.file)).get("designs", {})
            recorded += [(key, of["name"], json.dumps(of["resolved"])) for key, of in data.items()]
    for key, name, data in recorded:
        try:
            by_identity.setdefault(key, of_resolved(name, json.loads(data)))
        except NotTrusted as error:
            if refused is not None:
                refused[key] = str(error)
        except (SensorgenError, KeyError, TypeError):
            continue
    return by_identity


def design_row(design_id: str, name: str, resolved: Mapping[str, Any]) -> DesignRow:
    """Row of a design."""
    return DesignRow(uid=design_id, design=name, data=_text(resolved))


def prediction(design_id: str, design: str, data: Mapping[str, Any]) -> Prediction:
    """Row of a design's prediction.

    Parameters
    ----------
    design_id, design : str
        Identity and name of the design.
    data : mapping
        The prediction, as JSON has it.
    """
    text = _text(data)
    content = json.dumps([design_id, design, __version__, text])
    uid = hashlib.sha256(content.encode()).hexdigest()
    return Prediction(uid=uid, design_id=design_id, design=design, version=__version__, data=text)


def _text(data: Mapping[str, Any]) -> str:
    return json.dumps(data, ensure_ascii=False, sort_keys=True)


def _json(path: Path) -> Any:
    checked_head(path, MOST_BYTES, "the record of a batch", foreign=False)
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the record of a batch: {str(error)[:100]}") from None


_NAME = re.compile(r"(?=.*[^\W\d_])[^\W_][\w .,:+#()/-]{0,59}")
_EXPECTED = "at most 60 letters, digits, blanks and . , : + # ( ) / - _, a letter among them, as S1 or plate-2 left"


def bind(
    log: Log, names: Sequence[str], design: str = "", *, printed: str = "", iteration: int | None = None
) -> list[Entry]:
    """Log which design specimens were printed of; those that are bound to it already are passed over.

    Parameters
    ----------
    log : Log
        An open log.
    names : sequence of str
        Names of the specimens, any.
    design : str
        A design file, or identity or name of a design in the log; "" for that of ``printed``.
    printed : str
        Name of one specimen on its print bed; "" if unknown.
    iteration : int or None
        Of the design, to report specimens together; that of ``printed`` if None.

    Returns
    -------
    list of Entry
        The new prints.

    Raises
    ------
    BadInput
        A name that cannot be one, or that has another design; a design or a print that the log does not have.
    """
    if bool(design) == bool(printed):
        raise BadInput(f"{'both' if design else 'neither'} of --design and --printed given; expected one of them")
    if printed and len(names) > 1:
        raise BadInput(f"--printed {shown(printed)} is one specimen; expected one name for it, not {len(names)}")
    on_bed = _on_bed(log, printed) if printed else None
    of = _logged(log, on_bed.design_id) if on_bed else _design(log, design)
    rows = list(_prints(log, names, of, on_bed, iteration))
    new = log.add([design_row(of.id(), of.name, of.resolved()), *rows]) if rows else []
    return [row for row in new if isinstance(row, Print)]


def _prints(log: Log, names: Sequence[str], of: Design, on_bed: Print | None, iteration: int | None) -> Iterator[Print]:
    """Row of each name that is not bound to a design yet, or to the print on its bed."""
    design_id = on_bed.design_id if on_bed else of.id()
    film_mm = getattr(of.params, "dielectric_mm", None)
    for written in names:
        name = " ".join(written.split())
        if not _NAME.fullmatch(name):
            raise BadInput(f"{shown(written)} cannot be a specimen's name; expected {_EXPECTED}")
        bound = log.bound(name)
        if bound and bound.design_id == design_id:
            continue
        _check_measured(log, name, design_id, of.name)
        one = Print(
            uid=uuid.uuid4().hex, specimen=name, iteration=iteration, shape=of.shape,
            axes=str(getattr(of.params, "along", "")).upper(), film_mm=None if film_mm is None else float(film_mm),
            batch_uid="", design_id=design_id, design=of.name,
        )  # fmt: skip
        yield one if on_bed is None else replace(
            one, batch_uid=on_bed.batch_uid, printed=on_bed.specimen,
            iteration=on_bed.iteration if iteration is None else iteration,
        )  # fmt: skip


def _on_bed(log: Log, printed: str) -> Print:
    on_bed = log.bound(" ".join(printed.split())) or log.bound(notes.named(printed).specimen.specimen)
    if on_bed is None:
        raise BadInput(f"no print {shown(printed)} in the log; sensorgen log import batch.json logs those of a bed")
    return on_bed


def _design(log: Log, design: str) -> Design:
    """A design by its file, or by identity or name of one in the log."""
    if Path(design).is_file() or Path(design).suffix.lower() in (".yaml", ".yml"):
        return load(Path(design))
    named = {key: of for key, of in designs(log).items() if design in (key, of.name)}
    if len(named) == 1:
        return next(iter(named.values()))
    known = ", ".join(sorted({of.name for of in designs(log).values()})) or "none"
    why = f"{len(named)} designs have that name, {', '.join(named)}" if named else f"designs in the log: {known}"
    raise BadInput(f"--design {shown(design)}: expected a design file, as mine.yaml, or the identity of one ({why})")


def _logged(log: Log, design_id: str) -> Design:
    if (design := designs(log).get(design_id)) is None:
        raise MissingValue(f"the log has design {design_id} by its identity alone; give its file: --design FILE")
    return design


def _check_measured(log: Log, name: str, design_id: str, design: str) -> None:
    """Refuse a name under which another design was measured: its readings would change their design."""
    rows = chain(log.entries(Reading, specimen=name), log.entries(BenchRun, specimen=name))
    other = next((row for row in rows if row.design_id not in ("", design_id)), None)
    if other:
        raise BadInput(
            f"{shown(name)} was measured as {other.design} ({other.design_id}) and cannot become {design} "
            f"({design_id}): take another name, as '{name} own'"
        )


def predict(log: Log, specimen: str) -> list[Entry]:
    """Log a prediction of a specimen's design, unless the log has one.

    Parameters
    ----------
    log : Log
        An open log.
    specimen : str
        Name of the specimen.

    Returns
    -------
    list of Entry
        The new prediction, if there is one.

    Raises
    ------
    BadInput
        A name that cannot be parsed.
    MissingValue
        The name stands for no design, or the log lacks the design that it is bound to.
    """
    bound = log.bound(notes.named(specimen, log).specimen.specimen)
    design = designs(log).get(bound.design_id) if bound else notes.design_of(specimen)
    design_id = bound.design_id if bound else design.id() if design else ""
    if design_id and log.predictions(design_id=design_id):
        return []
    if design is None:
        raise MissingValue(f"{specimen!r} names no design; log a prediction of its file: sensorgen log predict FILE")
    return [row for row in log.add(predicted_rows(design)) if isinstance(row, Prediction)]


def predicted_rows(design: Design) -> list[Entry]:
    """A design and the prediction of its print, as rows of the log."""
    from sensorgen.prediction import bodies
    from sensorgen.prediction.evaluate import evaluate
    from sensorgen.prediction.results import to_json

    predicted = evaluate(bodies.default_body(design))
    return [
        design_row(design.id(), design.name, design.resolved()),
        prediction(design.id(), design.name, json.loads(to_json(predicted))),
    ]
