"""Import the record of a print bed, ``batch.json``: its specimens with their designs and predictions."""

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
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import notes
from sensorgen.measure.log.entries import Batch, Entry, Prediction, Print, RawFile
from sensorgen.measure.log.verify import prediction_uid

if TYPE_CHECKING:
    from sensorgen.measure.log.logbook import Log

MOST_BYTES = 64_000_000


class _Piece(Strict, extra="ignore"):
    """One specimen on the bed; version 0.1.0 has its prediction in ``expected``."""

    design_id: str = Field(min_length=1)
    design: str
    expected: dict[str, Any] | None = None


class _Slicer(Strict, extra="ignore"):
    """Predictions of the designs as one slicer prints them, by design."""

    printed: dict[str, dict[str, Any]] | None = None


class _Record(Strict, extra="ignore"):
    """The parts of ``batch.json`` that are logged."""

    specimens: dict[str, _Piece]
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


def designs(log: "Log") -> dict[str, Design]:
    """Designs on the log's print beds, by their identity when they were printed; without those that cannot be read."""
    found = {}
    for batch in log.batches():
        with suppress(SensorgenError):
            for key, entry in _json(log.raw(batch.file)).get("designs", {}).items():
                with suppress(SensorgenError, KeyError, TypeError):
                    found[key] = of_resolved(entry["name"], entry["resolved"])
    return found


def prediction(design_id: str, design: str, data: Mapping[str, Any]) -> Prediction:
    """Row of a design's prediction.

    Parameters
    ----------
    design_id, design : str
        Identity and name of the design.
    data : mapping
        The prediction, as JSON has it.
    """
    text = json.dumps(data, ensure_ascii=False, sort_keys=True)
    unnamed = Prediction(uid="", design_id=design_id, design=design, version=__version__, data=text)
    return Prediction(**vars(unnamed) | {"uid": prediction_uid(unnamed)})


def _json(path: Path) -> Any:
    checked_head(path, MOST_BYTES, "the record of a batch", foreign=False)
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the record of a batch: {str(error)[:100]}") from None
