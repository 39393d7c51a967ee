"""The record of a batch, ``batch.json``: what is where on the plate, made of what, and what it should measure."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from sensorgen.core import files as store
from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.records import shown
from sensorgen.design import materials
from sensorgen.design.design import Design
from sensorgen.prediction.results import Prediction, to_json
from sensorgen.workflows.batch.layout import Plate
from sensorgen.workflows.batch.pieces import Piece
from sensorgen.workflows.batch.plan import Plan
from sensorgen.workflows.build import json_bytes

RECORD = "batch.json"


def specimens(pieces: Sequence[Piece], plate: Plate) -> dict[str, Any]:
    """Every specimen by its name, in the order of the plate: design, place, copy.

    Parameters
    ----------
    pieces, plate : sequence of Piece, mapping of int to Rect
        The specimens, and where they lie.
    """
    found = {}
    for order, (number, place) in enumerate(plate.items(), 1):
        piece = pieces[number]
        found[piece.name] = {
            "order": order,
            "design": piece.design.name,
            "design_id": piece.design_id,
            "iteration": piece.specimen.iteration,
            "copy": piece.specimen.replicate,
            "centre_mm": [round(c, 6) for c in place.centre_mm],
            "size_mm": [round(place.x1 - place.x0, 6), round(place.y1 - place.y0, 6)],
        }
    return found


def predictions(estimated: Mapping[str, Prediction], sliced: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What each design should measure, by its identity: of the first slicer's print, else of the estimated one.

    Parameters
    ----------
    estimated : mapping of str to Prediction
        By a design's identity.
    sliced : mapping
        Results of every slicer, as in ``batch.json``: each with its prints' predictions.
    """
    found = {key: json.loads(to_json(predicted)) for key, predicted in estimated.items()}
    for made in reversed(list(sliced.values())):
        found |= {key: design["prediction"] for key, design in made["printed"].items() if design.get("prediction")}
    return found


def tools(plan: Plan, loaded: Mapping[int, str]) -> dict[str, Any]:
    """What is on each tool, by the printer's own number: material, lot, drying, cam dial."""
    return {str(tool): _spool(plan, name) for tool, name in loaded.items()}


def _spool(plan: Plan, name: str) -> dict[str, Any]:
    material, filament = materials.load(name), plan.filaments.get(name)
    return {
        "material": name,
        "title": material.title,
        "lot": filament.lot if filament and filament.lot else None,
        "drying": (filament.drying if filament else "") or material.drying or None,
        "cam_dial": _cam_dial(material),
        "note": filament.note if filament else "",
    }


def _cam_dial(material: materials.Material) -> float | None:
    try:
        return material.value("cam_dial").value
    except MissingValue:
        return None


def checklist(plan: Plan, loaded: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """What is done by hand before, at and after the print, in this order.

    Parameters
    ----------
    plan : Plan
        With its bake.
    loaded : mapping
        As of :func:`tools`.
    """
    numbers = ", ".join(f"T{tool}" for tool in loaded)
    bake = [f"Bake at {b.temperature_c:g} C for {b.hours:g} h" + (f": {b.note}" if b.note else "") for b in plan.bake]
    return [
        *(f"Dry {s['material']} ({_lot(s)}): {s['drying'] or 'no source says how'}" for s in loaded.values()),
        *(f"Load T{tool} with {s['material']} ({_lot(s)})" for tool, s in loaded.items()),
        *(f"Cam dial of T{tool}: {s['cam_dial']:g}" for tool, s in loaded.items() if s["cam_dial"] is not None),
        f"Clean the nozzles of {numbers}",
        "Clean the plate, home, and level it",
        "Watch the first layer of every specimen; note which failed",
        "Label every specimen before it leaves the plate",
        *(["Measure R along the electrodes and between them, not baked"] if bake else []),
        *bake,
        "Measure R along the electrodes and between them" + (", baked" if bake else ""),
    ]


def _lot(spool: Mapping[str, Any]) -> str:
    return f"lot {spool['lot']}" if spool["lot"] else "lot not named: write it down"


def designs(found: Mapping[str, Design]) -> dict[str, dict[str, Any]]:
    """Every design under its hash, with all that decides it."""
    return {key: {"name": design.name, "resolved": design.resolved()} for key, design in found.items()}


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """A record as JSON has it, with the SHA-256 of all the rest of it, so that a change by hand shows."""
    plain = json.loads(json_bytes(content))
    return {**plain, "sha256": _seal(plain)}


def _seal(content: Mapping[str, Any]) -> str:
    rest = {key: value for key, value in content.items() if key != "sha256"}
    return sha256(json.dumps(rest, sort_keys=True, ensure_ascii=False).encode()).hexdigest()


@dataclass(frozen=True)
class Differences:
    """How a folder differs from its record; ``record`` says whether the record itself was changed.

    >>> bool(Differences())
    False
    """

    missing: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    record: bool = False

    def __bool__(self) -> bool:
        """Whether anything differs."""
        return bool(self.missing or self.changed or self.extra or self.record)


def read(folder: Path) -> dict[str, Any]:
    """The record of a batch.

    Raises
    ------
    BadInput
        There is none, or it is damaged.
    """
    path = folder / RECORD
    try:
        found = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise BadInput(
            f"cannot read {str(path)!r}: {error.strerror or error}; expected the folder of a batch"
        ) from None
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: not the record of a batch: {error}") from None
    files = found.get("files") if isinstance(found, dict) else None
    if not isinstance(files, dict) or not all(isinstance(value, str) for value in files.values()):
        raise BadInput(f"{path}: not the record of a batch: 'files' is {shown(files)}; expected names to hashes")
    return dict(found)


def differences(folder: Path) -> Differences:
    """Hash every file of a batch's folder again, and hold it against the record.

    Parameters
    ----------
    folder : Path
        As ``sensorgen batch`` wrote it.

    Raises
    ------
    BadInput
        No record, a damaged one, or a file that cannot be read.
    """
    record = read(folder)
    known = record["files"]
    try:
        here = {name: value for name, value in store.hashes(folder).items() if name != RECORD}
    except OSError as error:
        raise BadInput(f"cannot read {error.filename!r}: {error.strerror or error}") from None
    return Differences(
        missing=tuple(sorted(set(known) - set(here))),
        changed=tuple(sorted(name for name in set(known) & set(here) if known[name] != here[name])),
        extra=tuple(sorted(set(here) - set(known))),
        record=record.get("sha256") != _seal(record),
    )
