"""The record of a batch, ``batch.json``: what is where on the plate, made of what, and what it should measure."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import geometric_mean
from typing import Any

from sensorgen.core.display import Boundless
from sensorgen.core.document import Column, Part, Table, to_json
from sensorgen.core.errors import MissingValue
from sensorgen.core.files import seal
from sensorgen.core.findings import Finding, LayerVolume
from sensorgen.core.units import si
from sensorgen.design import materials
from sensorgen.export.gcode.results import Checked
from sensorgen.prediction.results import Prediction
from sensorgen.workflows.batch.layout import Plate, Rect
from sensorgen.workflows.batch.plan import Bake, BatchPlan, Filament, Layout, PrintPiece

RECORD = "batch.json"
_COLUMNS = (
    Column("no.", key="order"), Column("specimen"), Column("design"), Column("x", "mm", key="x_mm"),
    Column("y", "mm", key="y_mm"), Column("R of an electrode", "ohm", key="resistance_ohm", si=True),
    Column("C", "F", key="capacitance_f", si=True),
)  # fmt: skip


@dataclass(frozen=True)
class PlateSpecimen:
    """A specimen on the plate.

    Attributes
    ----------
    order : int
        Its number on the plate, from 1.
    design, design_id : str
        Name and identity of its design.
    iteration, copy : int or None
        Of its name.
    centre_mm, size_mm : (float, float)
        Middle on the bed, and length and width [mm].
    """

    order: int
    design: str
    design_id: str
    iteration: int | None
    copy: int | None
    centre_mm: tuple[float, float]
    size_mm: tuple[float, float]


@dataclass(frozen=True)
class Spool:
    """Spool on a tool; None for what neither the plan nor the material's file gives."""

    material: str
    title: str
    lot: str | None
    drying: str | None
    cam_dial: float | None
    note: str

    @property
    def name(self) -> str:
        """Material with its lot."""
        return f"{self.material} ({f'lot {self.lot}' if self.lot else 'lot not named: write it down'})"


@dataclass(frozen=True)
class ResolvedDesign:
    """A design with all that decides it, as plain data."""

    name: str
    resolved: dict[str, Any]


@dataclass(frozen=True)
class PrintedDesign:
    """The print of a design: one specimen as it is read from the G-code of the plate.

    Attributes
    ----------
    specimen, design : str
        Name of the specimen that was read, and of its design.
    prediction : Prediction or None
        Its prediction; None if the print cannot be read.
    layers : tuple of LayerVolume
        Printed over drawn volume.
    findings : tuple of Finding
        Rule 7.
    reason : str
        Why the print cannot be read, or "".
    """

    specimen: str
    design: str
    prediction: Prediction | None = None  # no union of two types for read and unread: JSON would lose infinities
    layers: tuple[LayerVolume, ...] = ()
    findings: tuple[Finding, ...] = ()
    reason: str = ""

    @property
    def lost(self) -> int:
        """Number of layers of bodies that are not printed at all, against the will of the design [-]."""
        return sum(f.severity == "error" and not f.waiver for f in self.findings)

    @property
    def words(self) -> str:
        """Gap, resistance and capacitance; or the reason."""
        prediction = self.prediction
        if prediction is None:
            return self.reason
        gaps = [f"{p.gap.value * 1e3:g} mm" for p in (prediction, prediction.drawn) if p and p.gap]
        gap = f"electrode gap {gaps[0]} (drawn {gaps[1]}), " if len(gaps) > 1 else ""
        lost = f"; {self.lost} layers of bodies are not printed at all" if self.lost else ""
        resistance, capacitance = _expected(prediction)
        if resistance is None or capacitance is None:
            return f"{gap}no prediction{lost}"
        return f"{gap}R {si(resistance, 'ohm')}, C {si(capacitance, 'F')}{lost}"


@dataclass(frozen=True, kw_only=True)
class SlicedPlate(Checked):
    """G-code of the plate by one slicer.

    Attributes
    ----------
    version : str
        Of the slicer.
    gcode, raw, profile : str
        Files for the printer, of the slicer itself, and with its settings.
    printed : dict of str to PrintedDesign
        The print of each design, by its identity.
    """

    version: str
    gcode: str
    raw: str
    profile: str
    printed: dict[str, PrintedDesign]

    def in_short(self, slicer: str) -> Iterator[str]:
        """Time, filament, findings and prints."""
        spools = (
            f"T{t.tool} {t.filament_mm / 1000:.2f} m" + ("" if t.mass_g is None else f", {t.mass_g:.1f} g")
            for t in self.tools
        )
        taken = f"at least {self.time_s / 3600:.1f} h; {'; '.join(spools)}; {self.tool_changes} tool changes"
        yield f"{slicer} {self.version}: {taken}"
        yield from (f"  {f.severity}: line {f.line}: {f.message}; {f.advice}" for f in self.findings)
        yield from (f"  {one.design} as printed: {one.words}" for one in self.printed.values())


@dataclass(frozen=True)
class BatchRecord(Boundless):
    """The record of a batch.

    Attributes
    ----------
    batch, iteration, seed
        As in the plan.
    printer, quality : str
        Names.
    layout : Layout
        As in the plan.
    tower : tuple of Rect
        What specimens stay clear of.
    tools : dict of str to Spool
        By the printer's own number.
    checklist : tuple of str
        What is done by hand before, at and after the print.
    bake : tuple of Bake
        As in the plan.
    specimens : dict of str to PlateSpecimen
        By name, in the order of the plate.
    predictions : dict of str to Prediction
        What each design should measure, by its identity: of the first slicer's print, else of the estimated one.
    designs : dict of str to ResolvedDesign
        By identity.
    slicers : dict of str to SlicedPlate
        By the slicer's name.
    versions : dict of str to str
        Of this software and its libraries.
    files : dict of str to str
        SHA-256 of every file.
    sha256 : str
        Of all the rest of the record, so that a change by hand shows.
    """

    batch: str
    iteration: int
    seed: int
    printer: str
    quality: str
    layout: Layout
    tower: tuple[Rect, ...]
    tools: dict[str, Spool]
    checklist: tuple[str, ...]
    bake: tuple[Bake, ...]
    specimens: dict[str, PlateSpecimen]
    predictions: dict[str, Prediction]
    designs: dict[str, ResolvedDesign]
    slicers: dict[str, SlicedPlate]
    versions: dict[str, str]
    files: dict[str, str]
    sha256: str = ""

    def sealed(self) -> "BatchRecord":
        """The record with its own SHA-256."""
        return replace(self, sha256=seal(json.loads(to_json(self))))

    def document(self) -> Iterator[Part]:
        """Specimens, checklist, and what the slicers made."""
        yield f"{self.batch}: {len(self.specimens)} specimens on {self.printer}, {self.quality}"
        rows = (
            (s.order, name, s.design, *s.centre_mm, *_expected(self.predictions[s.design_id]))
            for name, s in self.specimens.items()
        )
        yield Table("specimens", "", _COLUMNS, tuple(rows))
        yield ""
        yield "checklist"
        yield from (f"  [ ] {line}" for line in self.checklist)
        for slicer, plate in self.slicers.items():
            yield from ("", *plate.in_short(slicer))


def _expected(prediction: Prediction) -> tuple[float | None, float | None]:
    """Resistance along an electrode, as a report has it, and capacitance [ohm], [F]; None where none is predicted."""
    if prediction.capacitance is None:
        return None, None
    return geometric_mean(r.value for r in prediction.resistance.values()), prediction.capacitance.value


def specimens(pieces: Sequence[PrintPiece], plate: Plate) -> dict[str, PlateSpecimen]:
    """Every specimen by its name, in the order of the plate."""
    return {
        (piece := pieces[number]).name: PlateSpecimen(
            order, piece.design.name, piece.design_id, piece.specimen.iteration, piece.specimen.replicate,
            (round(place.centre_mm[0], 6), round(place.centre_mm[1], 6)),
            (round(place.size_mm[0], 6), round(place.size_mm[1], 6)),
        )
        for order, (number, place) in enumerate(plate.items(), 1)
    }  # fmt: skip


def tools(plan: BatchPlan, loaded: Mapping[int, str], texts: materials.Texts) -> dict[str, Spool]:
    """Spools by the printer's own number of the tool; ``texts`` as of :func:`sensorgen.design.materials.load`."""
    spools = {}
    for tool, name in loaded.items():
        material, filament = materials.load(name, texts=texts), plan.filaments.get(name, Filament())
        try:
            cam_dial = material.value("cam_dial").value
        except MissingValue:
            cam_dial = None
        drying = filament.drying or material.drying or None
        spools[str(tool)] = Spool(name, material.title, filament.lot or None, drying, cam_dial, filament.note)
    return spools


def checklist(plan: BatchPlan, loaded: Mapping[str, Spool]) -> tuple[str, ...]:
    """Steps by hand before, at and after the print, in this order."""
    numbers = ", ".join(f"T{tool}" for tool in loaded)
    return (
        *(f"Dry {s.name}: {s.drying or 'no source says how'}" for s in loaded.values()),
        *(f"Load T{tool} with {s.name}" for tool, s in loaded.items()),
        *(f"Cam dial of T{tool}: {s.cam_dial:g}" for tool, s in loaded.items() if s.cam_dial is not None),
        f"Clean the nozzles of {numbers}",
        "Clean the plate, home, and level it",
        "Watch the first layer of every specimen; note which failed",
        "Label every specimen before it leaves the plate",
        *(["Measure R along the electrodes and between them, not baked"] if plan.bake else []),
        *(step.words() for step in plan.bake),
        "Measure R along the electrodes and between them" + (", baked" if plan.bake else ""),
    )
