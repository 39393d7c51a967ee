"""A print batch as it is planned in a YAML file, and its specimens in the order in which the plate is filled."""

import difflib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, SensorgenError, UnknownName
from sensorgen.core.records import Line, Strict, checked
from sensorgen.design import design as design_files
from sensorgen.design import packs
from sensorgen.design.design import Design, Slot
from sensorgen.design.materials import Texts
from sensorgen.design.specimen_name import SpecimenName, named

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
        if self.design:
            return _of_file(self, folder / self.design)
        return {"shape": self.shape, "parameters": self.parameters, "materials": self.materials}


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

    def words(self) -> str:
        """The step as a line of a checklist."""
        return f"Bake at {self.temperature_c:g} C for {self.hours:g} h" + (f": {self.note}" if self.note else "")


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

    def design(self, item: Item, folder: Path) -> Design:
        """The design of an item, printed as the plan says; one that this makes another design loses its name.

        Raises
        ------
        SensorgenError
            It is unknown, or wrong.
        """
        data = item.data(folder)
        over = {key: value for key in ("printer", "quality") if (value := getattr(self, key)) and not data.get(key)}
        if self.tools:
            over["tools"] = _over(data.get("tools", {}), self.tools)
        if all(data.get(key) == value for key, value in over.items()):
            return design_files.make(packs.with_files(data, folder))
        changed = {key: value for key, value in (data | over).items() if key != "name"}
        made = design_files.make(packs.with_files(changed, folder))
        with suppress(SensorgenError):  # it may need what the plan says
            own = design_files.make(packs.with_files(data, folder))
            made = own if own.id() == made.id() else made
        return made


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


def _of_file(item: Item, path: Path) -> dict[str, Any]:
    """The design of an item's file; nameless where values of the item go before the file's."""
    if not path.exists():
        raise _unknown(item.design, path)
    base = design_files.with_own_files(yamlfile.read(path), path.parent)
    changes = {"parameters": item.parameters, "materials": packs.slots(item.materials)}
    changes = {key: own for key, own in changes.items() if own}
    if not changes:
        return {"name": path.stem} | base
    unnamed = {key: value for key, value in base.items() if key != "name"}
    return unnamed | {key: _over(base.get(key, {}), own) for key, own in changes.items()}


def _over(base: Any, own: dict[str, Any]) -> Any:
    """A file's values with an item's own before them; what is no mapping is left for the design to complain of."""
    return base | own if isinstance(base, dict) else base


def _unknown(given: str, path: Path) -> SensorgenError:
    """No such design file: the nearest in its folder."""
    there = [p.name for p in path.parent.glob("*.yaml")] if path.parent.is_dir() else []
    if difflib.get_close_matches(path.name, there, n=1):
        return UnknownName("design", path.name, there).within(str(path.parent))
    return BadInput(f"unknown design {given!r}: there is no file {str(path)!r}; name a design file, or a shape")


@dataclass(frozen=True, eq=False)
class PrintPiece:
    """One specimen to be printed.

    Attributes
    ----------
    specimen : SpecimenName
        Its name.
    design : Design
        What it is; copies share one.
    design_id : str
        The design's hash, worked out once for all copies.
    """

    specimen: SpecimenName
    design: Design
    design_id: str

    @property
    def name(self) -> str:
        """The specimen's name."""
        return self.specimen.name


def pieces(plan: BatchPlan, folder: Path) -> tuple[PrintPiece, ...]:
    """All specimens of a plan, in its own order.

    Parameters
    ----------
    plan : BatchPlan
        Checked.
    folder : Path
        What the plan's design files are relative to.

    Raises
    ------
    BadInput
        Two specimens of one name, or designs that cannot be printed together.
    SensorgenError
        A design is unknown or wrong; the message names its place in the plan.
    """
    specimens: list[PrintPiece] = []
    for number, item in enumerate(plan.designs):
        try:
            design = plan.design(item, folder)
        except SensorgenError as error:
            raise error.within(f"designs.{number}") from None
        copies, key = range(item.first, item.first + item.replicates), design.id()
        specimens += [PrintPiece(named(design, plan.iteration, copy), design, key) for copy in copies]
    _refuse_twins(specimens)
    _refuse_strangers([piece.design for piece in specimens])
    return tuple(specimens)


def shuffled(specimens: Sequence[PrintPiece], seed: int) -> tuple[PrintPiece, ...]:
    r"""The specimens in the order in which the plate is filled.

    Parameters
    ----------
    specimens : sequence of PrintPiece
        In any order.
    seed : int
        Another seed, another order.

    Notes
    -----
    They are sorted by the SHA-256 of seed and name, ``"7\n26 triX .2mm 1 fine"`` in UTF-8: no generator of random
    numbers whose next version draws otherwise, and the order in the plan does not count.
    """
    return tuple(sorted(specimens, key=lambda piece: sha256(f"{seed}\n{piece.name}".encode()).digest()))


def _refuse_twins(specimens: Iterable[PrintPiece]) -> None:
    seen: dict[str, PrintPiece] = {}
    for piece in specimens:
        other = seen.setdefault(piece.name, piece)
        if other is not piece:
            raise BadInput(
                f"two specimens are called {piece.name!r}, of the designs {other.design.name} and {piece.design.name}: "
                "let the copies of one count on from another number, as in 'first: 6'"
            )


def _refuse_strangers(designs: Sequence[Design]) -> None:
    """One plate has one printer, one quality, one nozzle, and one spool on each tool."""
    first = designs[0]
    for design in designs[1:]:
        for word, one, other in (
            ("printer", first.machine.name, design.machine.name),
            ("quality", first.layers.name, design.layers.name),
            ("nozzle [mm]", f"{first.machine.nozzle_mm:g}", f"{design.machine.nozzle_mm:g}"),
        ):
            if one != other:
                key = word.partition(" ")[0]
                raise BadInput(
                    f"one plate, two of a kind: {word} {one} for {first.name} and {other} for {design.name}; "
                    f"give both the same {key}, or make two plans"
                )
    tools(designs)
    texts(designs)


def texts(designs: Iterable[Design]) -> Texts:
    """Material files of all designs.

    Raises
    ------
    BadInput
        Two of one name that differ.
    """
    by_name: dict[str, str] = {}
    for design in designs:
        for name, text in design.own.get("materials", {}).items():
            if by_name.setdefault(name, text) != text:
                raise BadInput(f"one plate, two materials {name}, from different files: give each a name of its own")
    return {"materials": by_name}


def tools(designs: Iterable[Design]) -> dict[int, str]:
    """Materials by the printer's own tool number.

    Raises
    ------
    BadInput
        Two materials on one tool, or one on two.
    """
    by_tool: dict[int, str] = {}
    for design in designs:
        for material in design.used():
            tool = design.tool(material)
            clash = {t: m for t, m in by_tool.items() if (t == tool) != (m == material)}
            if clash:
                other, loaded = clash.popitem()
                raise BadInput(
                    f"{design.name} wants {material} on tool {tool}, but {loaded} is on tool {other}: "
                    "one plate has one spool on each tool"
                )
            by_tool[tool] = material
    return dict(sorted(by_tool.items()))
