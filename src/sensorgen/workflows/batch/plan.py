"""A print batch as it is planned, in a YAML file: which designs, how many of each, and how they are printed."""

import difflib
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, SensorgenError, UnknownName
from sensorgen.core.records import Line, Strict, checked
from sensorgen.design import design as design_files
from sensorgen.design import packs
from sensorgen.design.design import Design, Slot

MOST = 1000  # specimens in one plan
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9]([A-Za-z0-9._-]{0,58}[A-Za-z0-9])?$", examples=["26", "film-study"])]


class Item(Strict):
    """Some copies of one design: a design file, or a shape with parameters."""

    design: str = Field(default="", description="Design file, as seen from the plan's folder.")
    shape: str = Field(default="", description="Shape, where no design file is named.")
    parameters: dict[str, float | str] = Field(default={}, description="Parameters; they go before the file's.")
    materials: dict[str, Slot] = Field(default={}, description="Part to material; they go before the file's.")
    replicates: Annotated[int, Field(ge=1, le=MOST)] = 1
    first: Annotated[int, Field(ge=1, le=9000)] = Field(default=1, description="Number of the first copy.")

    def data(self, folder: Path) -> dict[str, Any]:
        """The design as plain data."""
        if bool(self.design) == bool(self.shape):
            both = "both" if self.design else "neither"
            raise BadInput(f"{both} of design and shape given; expected one: a design file, or a shape with parameters")
        if not self.design:
            return {"shape": self.shape, "parameters": self.parameters, "materials": self.materials}
        path = folder / self.design
        if not path.exists():
            raise _unknown(self.design, path)
        base = design_files.with_own_files(yamlfile.read(path), path.parent)
        changes = {"parameters": self.parameters, "materials": packs.slots(self.materials)}
        changes = {key: own for key, own in changes.items() if own}
        if not changes:
            return {"name": path.stem} | base
        unnamed = {key: value for key, value in base.items() if key != "name"}
        return unnamed | {key: _over(base.get(key, {}), own) for key, own in changes.items()}


class Layout(Strict):
    """Layout of the specimens on the plate; all of them along x, since printed lines have a direction."""

    kind: Literal["column", "packed"] = "packed"
    spacing_mm: Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)] = Field(
        default=5.0, description="Between neighbours [mm]."
    )
    brim_mm: Annotated[float, Field(ge=0, le=50, allow_inf_nan=False)] = Field(
        default=0.0, description="Room kept round each specimen for a brim [mm]."
    )
    per_column: Annotated[int, Field(ge=1, le=MOST)] = Field(default=5, description="Most specimens in one column.")


class Filament(Strict):
    """The spool that a material comes from."""

    lot: Line = ""
    drying: Line = Field(default="", description="How it is dried; as its material's file says when not given.")
    note: Line = ""


class Bake(Strict):
    """One step of the bake after the print."""

    temperature_c: Annotated[float, Field(gt=0, le=400)]
    hours: Annotated[float, Field(gt=0, le=1000)]
    note: Line = ""


class Labels(Strict):
    """Labels of specimens."""

    tab: bool = Field(default=False, description="Print the name on a tab at the far end of each specimen.")
    sheet: bool = Field(default=True, description="A page of labels with QR codes to print.")


class BatchPlan(Strict):
    """A batch: what is on one plate, and where it all came from."""

    name: Name
    iteration: Annotated[int, Field(ge=0, le=9999)]
    seed: Annotated[int, Field(ge=0, le=2**53)] = 0
    designs: Annotated[tuple[Item, ...], Field(min_length=1, strict=False)]
    printer: str = Field(default="", description="Printer of the designs whose files name none.")
    quality: str = Field(default="", description="Quality of the designs whose files name none.")
    tools: dict[str, Annotated[int, Field(ge=0, le=99)]] = Field(
        default={}, description="Material to tool, in the printer's own numbers; goes before each design's."
    )
    layout: Layout = Layout()
    slicers: Annotated[tuple[Literal["prusa", "cura"], ...], Field(min_length=1, max_length=2, strict=False)] = (
        "prusa",
    )
    filaments: dict[str, Filament] = Field(default={}, description="Material to the spool it comes from.")
    bake: tuple[Bake, ...] = Field(default=(), strict=False)
    labels: Labels = Labels()

    @cached_property
    def total(self) -> int:
        """Number of specimens."""
        return sum(item.replicates for item in self.designs)

    def made(self, item: Item, folder: Path) -> Design:
        """The design of an item, printed as the plan says.

        Raises
        ------
        SensorgenError
            It is unknown, or wrong.
        """
        data = item.data(folder)
        over = {key: value for key in ("printer", "quality") if (value := getattr(self, key)) and not data.get(key)}
        if self.tools:
            over["tools"] = _over(data.get("tools", {}), self.tools)
        if any(data.get(key) != value for key, value in over.items()):
            data = {key: value for key, value in (data | over).items() if key != "name"}
        return design_files.make(packs.with_files(data, folder))


def load(path: Path) -> BatchPlan:
    """Read a plan.

    Raises
    ------
    BadInput
        Not readable, not YAML, or not a plan; the message names file and key.
    """
    data = yamlfile.read(path)
    try:
        plan = checked(BatchPlan, {"name": path.stem} | data)
        if plan.total > MOST:
            raise BadInput(f"{plan.total} specimens; expected at most {MOST}: make several plans")
        for name in plan.filaments:
            packs.find("materials", name, path.parent)
    except SensorgenError as error:
        raise error.within(str(path)) from None
    return plan


def _over(base: Any, own: dict[str, Any]) -> Any:
    """A file's values with an item's own before them; what is no mapping is left for the design to complain of."""
    return base | own if isinstance(base, dict) else base


def _unknown(given: str, path: Path) -> SensorgenError:
    """No such design file: the nearest in its folder."""
    there = [p.name for p in path.parent.glob("*.yaml")] if path.parent.is_dir() else []
    if difflib.get_close_matches(path.name, there, n=1):
        return UnknownName("design", path.name, there).within(str(path.parent))
    return BadInput(f"unknown design {given!r}: there is no file {str(path)!r}; name a design file, or a shape")
