"""Import the record of a print bed, ``batch.json``: its specimens with their designs and predictions."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field

from sensorgen.core.errors import BadInput, SensorgenError, within
from sensorgen.core.records import Strict, checked
from sensorgen.core.version import __version__
from sensorgen.design.design import Design, of_resolved
from sensorgen.design.shape_files import NotTrusted
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import notes
from sensorgen.measure.log.entries import Batch, DesignRow, Entry, Prediction, Print, RawFile

if TYPE_CHECKING:
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
        Not the record of a batch; with the file's name, and the key.
    """
    data = _json(path)
    with within(str(path)):
        record = checked(_Record, data)
        yield file
        yield Batch(uid=file.uid, batch=record.batch or path.absolute().parent.name, file=file.uid)
        for key, design in record.designs.items():
            yield design_row(key, design.name, design.resolved)
        pieces = (row for name, piece in record.specimens.items() for row in _piece(file.uid, name, piece, record))
        yield from dict.fromkeys(pieces)  # copies of one design share a prediction


def _piece(batch: str, name: str, piece: _Piece, record: _Record) -> Iterator[Entry]:
    of = notes.specimen(name)
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


def designs(log: "Log", refused: dict[str, str] | None = None) -> dict[str, Design]:
    """Designs in the log by their identity when they were logged; without those that cannot be read here.

    Of those whose shape the user has not trusted, ``refused`` gets the reason.
    """
    found = dict[str, Design]()
    recorded = [(row.uid, row.design, row.data) for row in log.entries(DesignRow)]
    for batch in log.batches():  # before version 3 the log had them in the files of batches only
        with suppress(SensorgenError):
            data = _json(log.raw(batch.file)).get("designs", {})
            recorded += [(key, of["name"], json.dumps(of["resolved"])) for key, of in data.items()]
    for key, name, data in recorded:
        try:
            found.setdefault(key, of_resolved(name, json.loads(data)))
        except NotTrusted as error:
            if refused is not None:
                refused[key] = str(error)
        except (SensorgenError, KeyError, TypeError):
            continue
    return found


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
