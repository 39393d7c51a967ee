"""``batch.json`` of a print bed to rows of the log: which specimens came from it, their designs and predictions."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sensorgen import __version__
from sensorgen.core.errors import BadInput
from sensorgen.core.records import shown
from sensorgen.measure.log.entries import Batch, Entry, Prediction, Print, RawFile
from sensorgen.measure.log.verify import prediction_uid
from sensorgen.measure.log.words import named

MOST_BYTES = 64_000_000


def rows(path: Path, file: RawFile) -> Iterator[Entry]:
    """Everything that a print bed brings into the log.

    Parameters
    ----------
    path : Path
        ``batch.json``.
    file : RawFile
        The same, as it is kept.

    Raises
    ------
    BadInput
        Not the record of a batch; with the file's name, and the specimen's.
    """
    record = _record(path)
    batch = str(record.get("batch") or path.absolute().parent.name)
    yield file
    yield Batch(uid=file.uid, batch=batch, file=file.uid)
    printed = _as_printed(record, str(path))
    pieces = _mapping(record.get("specimens"), f"{path}: specimens").items()
    predictions = _mapping(record.get("predictions") or {}, f"{path}: predictions")
    found = (
        row
        for written, piece in pieces
        for row in _of_piece(
            file.uid, written, _mapping(piece, f"{path}: specimen {written}"), predictions, printed, str(path)
        )
    )
    yield from dict.fromkeys(found)  # copies of one design share a prediction


def _as_printed(record: Mapping[str, Any], where: str) -> dict[str, dict[str, Any]]:
    """What each slicer prints of each design, by the design and the slicer; none where the print was not read back."""
    found: dict[str, dict[str, Any]] = {}
    for slicer, used in _mapping(record.get("slicers") or {}, f"{where}: slicers").items():
        printed = _mapping(used, f"{where}: slicer {slicer}").get("printed") or {}
        for design_id, report in _mapping(printed, f"{where}: printed by {slicer}").items():
            found.setdefault(design_id, {})[slicer] = report
    return found


def _of_piece(
    batch: str,
    written: str,
    piece: Mapping[str, Any],
    predictions: Mapping[str, Any],
    printed: Mapping[str, Any],
    where: str,
) -> Iterator[Entry]:
    design_id, design = piece.get("design_id"), piece.get("design")
    if not isinstance(design_id, str) or not isinstance(design, str) or not design_id:
        raise BadInput(f"{where}: specimen {written}: design_id is {shown(design_id)}; expected text")
    try:
        specimen, _ = named(written)
    except BadInput as error:
        raise error.within(where) from None
    uid = f"{batch} {specimen['specimen']}"
    yield Print(uid=uid, batch_uid=batch, design_id=design_id, design=design, **specimen)  # type: ignore[arg-type]
    if design_id in predictions:
        yield prediction(design_id, design, _mapping(predictions[design_id], f"{where}: prediction of {design}"))
    elif piece.get("expected"):  # of version 0.1.0
        expected = _mapping(piece["expected"], f"{where}: specimen {written}: expected")
        beside = {"printed": printed[design_id]} if design_id in printed else {}
        yield prediction(design_id, design, expected | beside)


def prediction(design_id: str, design: str, data: Mapping[str, Any]) -> Prediction:
    """What a design is expected to measure, as a row of the log.

    Parameters
    ----------
    design_id, design : str
        Identity and name of the design.
    data : mapping
        The prediction, as plain data.
    """
    text = json.dumps(data, ensure_ascii=False, sort_keys=True)
    unnamed = Prediction(uid="", design_id=design_id, design=design, version=__version__, data=text)
    return Prediction(**vars(unnamed) | {"uid": prediction_uid(unnamed)})


def _record(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise BadInput(f"{path}: {path.stat().st_size} bytes; expected the record of a batch")
        return _mapping(json.loads(path.read_text("utf-8")), str(path))
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the record of a batch: {str(error)[:100]}") from None


def _mapping(data: object, where: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise BadInput(f"{where} holds {shown(data)}; expected a mapping, as in the record of a batch")
    return data
