"""A design: one variant of a sensor, with everything that decides how it is printed and what it should do."""

import dataclasses
import hashlib
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, cast

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic.functional_validators import ModelWrapValidatorHandler

from sensorgen.core import display, yamlfile
from sensorgen.core import lazy as registry
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, SensorgenError, UnknownName
from sensorgen.core.findings import Finding
from sensorgen.core.records import Strict, checked, problem, shown, stated
from sensorgen.design import borders, imported, packs, shapes
from sensorgen.design import materials as material_files
from sensorgen.design.effects import Effects, TipData
from sensorgen.design.packs import Kind
from sensorgen.design.printer import Pattern, Printer, Quality, load_printer, load_quality
from sensorgen.design.profile import Profile, with_own
from sensorgen.design.tip import EVEN, STIFF
from sensorgen.scene.scene import Envelope, Fill, Scene

if TYPE_CHECKING:
    from sensorgen.design.arrays import ArrayLayout
    from sensorgen.design.shape_files import Shape

ARRAY = "array"  # shape of crossing tracks, with cells of another one
MAX_CELLS = 50_000  # crossed strips of 330 x 330 mm have 27 225
MAX_LAYERS = 5_000  # 30 mm in layers of 0.06 mm have 500
_NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._-]{0,98}[A-Za-z0-9])?")
# Windows cannot have files of these names.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)

Slot = Annotated[str, Field(pattern=r"^[a-z0-9-]+(@[a-z0-9.-]+)?$", examples=["x60", "x60@thesis-4.1"])]


_Region = Annotated[str, Field(pattern="^[a-z][a-z0-9_]{0,30}$", examples=["heel"])]


class SVG(str):
    """A drawing that a notebook shows."""

    def _repr_svg_(self) -> str:
        return str(self)


class Slots(Strict):
    """Materials of the parts, each with the source of its values: ``x60`` or ``x60@thesis-4.1``."""

    top_electrode: Slot = "etpu"
    bottom_electrode: Slot = "etpu"
    film: Slot = "x60"
    dielectric: Slot = stated("x60", "Of film and isolation too, unless they are given.")
    isolation: Slot = "x60"
    support: Slot | None = stated(None, "Fills the air while printing; left empty when not given.")

    @model_validator(mode="before")
    @classmethod
    def _by_part(cls, data: Any) -> Any:
        """Name both electrodes where ``electrode`` is given."""
        return packs.slots(data) if isinstance(data, Mapping) else data

    @model_serializer(mode="wrap")
    def _apart(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """State a film of the default material too, which is of the dielectric's where it is not given."""
        given: dict[str, Any] = handler(self)
        return given | {"film": self.film, "isolation": self.isolation} if "dielectric" in given else given


class Leads(Strict):
    """Leads between the sensor and the meter: in parallel, in series, and the state of their guard."""

    capacitance_pf: Annotated[float, Field(ge=0)] | None = stated(
        None, "Of the leads; 0 to 5 pF when not given, to 0.1 with a driven guard [pF]."
    )
    resistance_ohm: Annotated[float, Field(ge=0)] | None = stated(
        None, "Of leads and both contacts; 0 with four wires. A range when not given [ohm]."
    )
    guard: Literal["driven", "none"] = "none"


class Infill(Strict):
    """Density that one material is printed with."""

    percent: Annotated[float, Field(gt=0, le=100)] | None = None
    pattern: Pattern | None = None


class Waiver(Strict):
    """A finding that the designer accepts, and why."""

    rule: Annotated[str, Field(pattern=r"^[0-9]+(-[a-z-]+)?$", examples=["5-width", "5"])]
    body: str = stated("", "Name of the body; all bodies when not given.")
    reason: Annotated[str, Field(min_length=5)]


class Cell(Strict):
    """Shape of the cell at each crossing of an array."""

    shape: str = "reference"
    parameters: dict[str, float | str] = stated({}, "Of that shape; its size is that of a crossing.")


class Design(Strict):
    """A named variant of a sensor."""

    @model_validator(mode="wrap")
    @classmethod
    def _constructed(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Errors of a design that is constructed in Python, in the words of a file's."""
        try:
            design = handler(_one_dielectric(data) if isinstance(data, dict) else data)
        except ValidationError as error:
            for key in _parameters_of(data) & set(data if isinstance(data, Mapping) else ()):
                raise BadInput(f"{key} is a parameter; expected parameters: {{{key}: {data[key]}}}") from None
            raise BadInput(problem(error, data, cls)) from None
        if design._shape_text is None and design.shape != imported.SHAPE:
            parameters(design.shape, design.parameters)  # refuses wrong names and numbers now, not at first use
        return design

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """Shape and what differs from the defaults; pydantic's has every field."""
        for key, field in type(self).model_fields.items():
            if getattr(self, key) != field.get_default(call_default_factory=True):
                yield key, getattr(self, key)

    def _repr_html_(self) -> str:
        return display.html(self)

    def show(self) -> "SVG":
        """The dimensioned cross-section with layers and findings, as a notebook shows it; ``str()`` is the SVG."""
        return SVG(display.html(self))

    name: str = stated(
        "",
        "Folder and file name; made from the parameters when not given.",
        json_schema_extra={"pattern": f"^{_NAME.pattern}$"},
    )
    shape: str
    parameters: dict[str, float | str] = Field(default={})
    materials: Slots = Slots()
    material_values: dict[str, dict[str, float]] = stated(
        {},
        "Material to quantity to a value, in its name's unit, that goes before every source's.",
        examples=[{"x60": {"relative_permittivity": 3.0}}],
    )
    printer: str = "diabase-h5"
    quality: str = "fine"
    nozzle_mm: Annotated[float, Field(ge=0.05, le=5.0)] | None = stated(
        None, "Nozzle diameter when it is not the printer's own [mm]."
    )
    tools: dict[str, Annotated[int, Field(ge=0, le=99)]] = stated({}, "Material to tool, in the printer's own numbers.")
    infill: dict[str, Infill] = stated({}, "Material to infill.")
    orientation: Literal["as-drawn", "upside-down"] = "as-drawn"
    shrinkage: Annotated[float, Field(ge=0, lt=0.9)] = stated(
        0.0, "Share that the bake takes off in the plane; the print is made larger by it [-]."
    )
    profile: Profile = Profile()
    tip: TipData = stated(TipData(), "What presses it; no part of its identity.")
    effects: Effects = stated(Effects(), "What readings depend on beside the press.")
    waivers: tuple[Waiver, ...] = Field(default=(), strict=False)  # YAML has lists only
    leads: Leads = Leads()
    own: dict[Kind, dict[str, str]] = stated(
        {}, "Text of each file that the design takes from packs that do not ship, by kind and name."
    )
    geometry: str | None = stated(None, "File of the bodies of an imported sensor, relative to the design's own file.")
    bodies: dict[str, imported.Filled] = stated({}, "Imported body to material and terminal.")
    cell: Cell | None = stated(None, "Of an array: what lies between crossing tracks.")
    border: str | None = stated(
        None,
        "SVG or DXF file of the sensor's outline in plan, relative to the design's own file; or a foot by "
        "its EU size, as: foot 42 left.",
    )
    regions: dict[_Region, list[list[float]]] = stated(
        {},
        "Of an array: named regions, corners in mm from the outline's own, two of a rectangle; a foot has "
        "heel, midfoot, metatarsals, hallux and toes.",
    )

    @field_validator("name")
    @classmethod
    def _safe_name(cls, name: str) -> str:
        if not _NAME.fullmatch(name) or _DEVICES.fullmatch(name):
            raise ValueError(
                f"{shown(name)} cannot be a file name everywhere; expected at most 100 letters a to z, digits, "
                "'.', '-' and '_', with a letter or digit first and last: set it with --name, or 'name:' in a design "
                "file"
            )
        return name

    def __getstate__(self) -> dict[Any, Any]:
        """State without derived values: classes of shape files exist in this process only."""
        state = super().__getstate__()
        given = {key: value for key, value in state["__dict__"].items() if key in type(self).model_fields}
        return state | {"__dict__": given}

    @cached_property
    def params(self) -> Envelope:
        """The shape's parameters, checked and complete."""
        if self.geometry:
            return imported.params(self.geometry)
        return parameters(self.shape, self.parameters, self._shape_text)

    @property
    def _shape_text(self) -> str | None:
        """The shape's file, where it does not ship."""
        return self.own.get("shapes", {}).get(self.shape)

    @property
    def form(self) -> "Shape":
        """The shape: its parameters and its scene."""
        return _shape(self.shape, self._shape_text)

    @cached_property
    def machine(self) -> Printer:
        """The printer, with this design's nozzle."""
        printer = load_printer(self.printer, self.own.get("printers", {}).get(self.printer))
        return printer.model_copy(update={"nozzle_mm": self.nozzle_mm}) if self.nozzle_mm else printer

    @cached_property
    def layers(self) -> Quality:
        """The print quality."""
        return load_quality(self.quality, self.own.get("qualities", {}).get(self.quality))

    def material(self, name: str) -> material_files.Material:
        """A material by name, with the values that this design sets itself."""
        slots = (slot.partition("@") for slot in self._filled())
        sources = sorted({source for material, _, source in slots if material == name and source})
        return material_files.load(name, sources, self.own).with_values(self.material_values.get(name, {}))

    def _filled(self) -> list[str]:
        """Material, with source, of every part that has one, or of every imported body."""
        return [body.material for body in self.bodies.values()] or [slot for _, slot in self.materials if slot]

    def conducts(self, name: str) -> bool:
        """Test whether a material does."""
        return self.material(name).conductor

    def slot(self, part: str) -> tuple[material_files.Material, str]:
        """Material of a part, and the source to take its values from."""
        name, _, source = (getattr(self.materials, part) or "").partition("@")
        return self.material(name), source

    def used(self) -> dict[str, str]:
        """Materials of the scene's bodies with their source; the first slot that names one decides."""
        here = {body.material for body in self.drawn.bodies}
        sources: dict[str, str] = {}
        for name, _, source in (slot.partition("@") for slot in self._filled()):
            if name in here:
                sources[name] = sources.get(name) or source
        return sources

    @cached_property
    def drawn(self) -> Scene:
        """The sensor as it is meant to be, bottom electrode down."""
        if self.geometry:
            return imported.scene(self.geometry, self.bodies)
        names = {part: (value or "").partition("@")[0] for part, value in self.materials.model_dump().items()}
        if self.layout:
            from sensorgen.design import arrays

            return arrays.scene(self.layout, Fill(**names), self.crossing.form.scene, self.crossing.params)
        scene = self.form.scene(self.params, Fill(**names))
        return borders.cut(scene, self.border) if self.border else scene

    @cached_property
    def layout(self) -> "ArrayLayout | None":
        """Tracks of an array in plan; None of any other sensor."""
        if self.shape != ARRAY:
            return None
        from sensorgen.design import arrays

        return arrays.layout(cast(arrays.Params, self.params), self.border)

    @cached_property
    def crossing(self) -> "Design":
        """One crossing of an array as a sensor of its own: cell, materials and printer are those of all crossings."""
        if not self.layout:
            raise BadInput(f"{self.shape} has no crossings; expected shape: {ARRAY}")
        from sensorgen.design import arrays

        cell, params = self.cell or Cell(), self.layout.params
        others = self.model_dump(
            exclude={"name", "shape", "parameters", "cell", "border", "regions", "waivers", "tip"},
            exclude_defaults=True, mode="json",
        )  # fmt: skip
        others["tip"] = arrays.crossing_tip(params, self.tip)
        own = arrays.cell_parameters(params, cell.shape, cell.parameters, self.layers.layer_mm)
        crossing = make(
            {**others, "name": f"{self.name[:80] or 'array'}-crossing", "shape": cell.shape, "parameters": own}
        )
        arrays.check_cell(crossing.params, params)
        return crossing

    @property
    def area_mm2(self) -> float:
        """Area of the sensor in plan [mm2]."""
        return borders.region(self.border).area if self.border else self.params.length_mm * self.params.width_mm

    @cached_property
    def unbordered(self) -> "Design":
        """The design without its border: a rectangle of the same length and width."""
        return checked(Design, self.model_dump(exclude={"border"})) if self.border else self

    @cached_property
    def in_use(self) -> Scene:
        """The sensor as drawn, its soluble support gone."""
        return dataclasses.replace(self.drawn, bodies=tuple(b for b in self.drawn.bodies if not b.is_support()))

    @cached_property
    def printed(self) -> Scene:
        """The sensor as it lies on the bed: enlarged against shrinkage, and turned over if so ordered."""
        scene = self.drawn.stretched(1.0 / (1.0 - self.shrinkage)) if self.shrinkage else self.drawn
        return scene.turned_over() if self.orientation == "upside-down" else scene

    def tool(self, material: str) -> int:
        """The tool that prints a material, in the printer's own number.

        Raises
        ------
        MissingValue
            Neither the design nor the printer says.
        """
        tools = self.machine.default_tools | self.tools
        if material not in tools:
            printing = {body.material for body in self.drawn.bodies}
            taken = {tool for name, tool in tools.items() if name in printing}
            free = [tool for tool in self.machine.tool_numbers if tool not in taken]
            first = free[0] if free else "NUMBER"
            raise MissingValue(
                f"no tool for {material} on {self.machine.name}: name one with --tool {material}={first}, or 'tools: "
                f"{{{material}: {first}}}' in the design (free: {', '.join(map(str, free)) or 'none'})"
            )
        return tools[material]

    def resolved(self) -> dict[str, Any]:
        """Everything that decides the sensor, with all defaults and the values of material and printer filled in."""
        stuff = {}
        for name, source in sorted(self.used().items()):
            stuff[name] = self.material(name).model_dump(exclude=_LIMITS) | {"source": source}
        return {
            **self.model_dump(exclude={"name", "parameters", "printer", "quality"} | self._plain()),
            "parameters": self._decisive_parameters(),
            "materials_values": stuff,
            "printer_values": self.machine.model_dump(exclude=_LIMITS),
            "quality_values": self.layers.model_dump(),
        }

    def _decisive_parameters(self) -> dict[str, Any]:
        """All parameters but those that their shape got later and that are not used: older designs stay the same."""
        unused = {f.name for f in dataclasses.fields(self.params)
                  if f.metadata.get("later") and getattr(self.params, f.name) == f.default}  # fmt: skip
        return {name: value for name, value in dataclasses.asdict(self.params).items() if name not in unused}

    def _plain(self) -> set[str]:
        """Parts that have come later and are not used: without them the identities of older designs last."""
        usual = {
            "profile": Profile(), "tip": TipData(), "effects": Effects(), "own": {}, "geometry": None, "bodies": {},
            "border": None, "leads": Leads(), "cell": None, "regions": {}, "waivers": (),
        }  # fmt: skip
        return {key for key, value in usual.items() if getattr(self, key) == value}

    @property
    def walls(self) -> str:
        """Walls of the print: arachne or classic."""
        return self.profile.walls or "arachne"

    def id(self) -> str:
        """Hash of all resolved parameters and material values; not of the design's name, nor of sensorgen's version."""
        data = _FIRST | self._lasting(self.resolved())
        for key in ("own", "tip", "regions", "waivers"):  # what decides of them is in materials and machines
            data.pop(key, None)
        if self._shape_text is not None:
            data["shape_text"] = self._shape_text
        elif self.own.get("shapes"):  # of an array's cell
            data["cell_text"] = self.own["shapes"]
        text = json.dumps(data, sort_keys=True, allow_nan=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def ids(self) -> set[str]:
        """Identity of the design, and of what it was while its electrodes had the defaults of version 0.1.0."""
        slots = {part: slot for part, slot in _FIRST_SLOTS.items() if getattr(self.materials, part) == "etpu"}
        return {self.id(), self.model_copy(update={"materials": self.materials.model_copy(update=slots)}).id()}

    def _lasting(self, data: dict[str, Any]) -> dict[str, Any]:
        """Resolved data, as version 0.1.0 had them where the design takes the same numbers as it did then."""
        data = data | {"printer_values": self._as_homed(data["printer_values"])}
        slots = dict(self.materials)
        first = slots | {part: slot for part, slot in _FIRST_SLOTS.items() if slots[part] == "etpu"}
        filled = self._filled()
        then = filled if self.bodies else list(filter(None, first.values()))
        if any(map(self._differs, filled, then)):
            return data
        stuff = {name: self._former(name, values, then) for name, values in data["materials_values"].items()}
        return data | {"materials": first, "materials_values": stuff}

    def _as_homed(self, machine: dict[str, Any]) -> dict[str, Any]:
        """Values of the printer as before it homed by G28 alone, which makes no other sensor."""
        if self.machine.name != _HOMED or "printers" in self.own:
            return machine
        start = machine["start_gcode"].replace("G28\nG32\n", "G32\n")
        return machine | {"start_gcode": start, "control": machine["control"] | {"homes": ("G28", "G32")}}

    def _differs(self, slot: str, then: str) -> bool:
        """True if a part has another number of any quantity than in version 0.1.0."""
        (name, _, source), first_source = slot.partition("@"), then.partition("@")[2]
        now, first = self.material(name), material_files.first_form(self.material(name))
        return any(now.chosen(q, source) != first.chosen(q, first_source) for q in first.properties)

    def _former(self, name: str, values: dict[str, Any], then: Iterable[str]) -> dict[str, Any]:
        """Values of a material as version 0.1.0 had them, and the first source of its parts."""
        sources = (slot.partition("@")[2] for slot in then if slot.partition("@")[0] == name)
        first = material_files.first_form(self.material(name)).model_dump(include={"properties"})
        return values | first | {"source": values["source"] or next(filter(None, sources), "")}

    def waived(self, findings: list[Finding]) -> list[Finding]:
        """The findings, with the reason where the design accepts them."""
        return [
            dataclasses.replace(f, waiver=next((w.reason for w in self.waivers if _covers(w, f)), "")) for f in findings
        ]

    def idle_waivers(self, findings: list[Finding]) -> list[Finding]:
        """A finding for each waiver that covers none of ``findings``: misspelt, or no longer needed."""
        idle = (w for w in self.waivers if not any(_covers(w, f) for f in findings))
        advice = "remove it, or correct its rule and body"
        return [
            Finding(
                "10-waiver", "warning", w.body or "sensor", f"the waiver of rule {w.rule} covers no finding", advice
            )
            for w in idle
        ]


# Version 0.1.0 hashed its own number, and its identities last: the logs, labels and batches that name them stay valid.
_FIRST = {"sensorgen": "0.1.0"}
_HOMED = "diabase-h5"  # which homes by G28 alone since it was found that its G32 does not
_FIRST_SLOTS = {"top_electrode": "etpu@thesis-c.1-top", "bottom_electrode": "etpu@thesis-c.1-bottom"}
# What only the check of G-code reads, and how exact the printer is: neither decides a sensor.
_LIMITS: dict[str, Any] = {
    "control": {"commands", "longest_retraction_mm"}, "print": {"max_flow_mm3_s"}, "tool_height_error_mm": True,
    "citations": True, "macros": True,
}  # fmt: skip


def _covers(waiver: Waiver, finding: Finding) -> bool:
    same_rule = finding.rule == waiver.rule or finding.rule.partition("-")[0] == waiver.rule
    return same_rule and waiver.body in ("", finding.body)


def own_texts(materials: Iterable[str], folder: Path | None = None) -> Mapping[Kind, Mapping[str, str]]:
    """Texts of those materials that do not ship: of packs beside a folder, the working one if not given, or the user's.

    Raises
    ------
    UnknownName, BadInput
        A name that no pack has, or a file that cannot be read.
    """
    texts: Mapping[Kind, Mapping[str, str]] = packs.with_files(
        {"tools": dict.fromkeys(materials, 0)}, folder or Path()
    ).get("own", {})
    return texts


def material(name: str, folder: Path | None = None) -> material_files.Material:
    """A material that ships, or of the packs that :func:`own_texts` looks in."""
    return material_files.load(name, (), own_texts([name], folder))


def shape(name: str) -> "Shape":
    """A shape by its name; raises UnknownName with the nearest one."""
    if name in packs.shipped_names("shapes"):
        return cast("Shape", registry.load(shapes, name))
    return _shape(name, packs.find("shapes", name).text())


def _shape(name: str, text: str | None) -> "Shape":
    """A shape by its name, or by the text of its file where that does not ship."""
    if name == imported.SHAPE:
        return cast("Shape", imported)
    if name == ARRAY:
        from sensorgen.design import arrays

        return cast("Shape", arrays)
    if text is None:
        return shape(name)
    from sensorgen.design import shape_files

    return shape_files.load(name, text)


def _parameters_of(data: object) -> set[str]:
    """Names of the parameters of the shape that plain data name, if they do."""
    word = data.get("shape") if isinstance(data, Mapping) else None
    return set(fields(word)) if isinstance(word, str) and word in packs.names("shapes") else set()


def fields(shape_name: str, text: str | None = None) -> dict[str, dataclasses.Field[Any]]:
    """The parameters of a shape, by name."""
    return {f.name: f for f in dataclasses.fields(_shape(shape_name, text).Params)}


def parameters(shape_name: str, given: Mapping[str, float | str], text: str | None = None) -> Envelope:
    """Check the parameters of a shape and fill in its defaults.

    Raises
    ------
    UnknownName
        The shape has no such parameter.
    OutOfRange
        A value is no number, or outside the range of sense.
    """
    known = fields(shape_name, text)
    values = {}
    for name, value in given.items():
        if name not in known:
            raise UnknownName(f"parameter of {shape_name}", name, known)
        values[name] = _checked(known[name], value)
    kind: Any = _shape(shape_name, text).Params
    params: Envelope = kind(**values)
    cells: Any = params.cells()
    if isinstance(cells, bool) or not isinstance(cells, (int, float)) or not cells > 0:
        raise BadInput(f"{shape_name}.py: cells() is {cells!r:.60}; expected a number above 0")
    if cells > MAX_CELLS:  # the mesh would fill the memory
        raise OutOfRange(
            f"{cells:.3g} cells of the pattern on {params.length_mm:g} x {params.width_mm:g} mm; expected at most "
            f"{MAX_CELLS}: use a longer period or a smaller sensor"
        )
    return params


def unit_of(field: dataclasses.Field[Any]) -> str:
    """Unit of a shape's parameter, in words; "" of a number of things."""
    if field.metadata.get("count"):
        return ""
    return "degrees" if field.name.endswith("_deg") else "mm"


def _checked(field: dataclasses.Field[Any], value: float | str) -> float | str:
    choices = field.metadata.get("choices")
    if choices:
        if value not in choices:
            raise UnknownName(f"value of {field.name}", str(value), choices)
        return value
    low, high = field.metadata["range"]
    if isinstance(value, str) or not math.isfinite(value) or not low <= value <= high:
        shown = repr(value) if isinstance(value, str) else f"{value:g}"
        unit = unit_of(field)
        own = f": write it in {unit}, without a unit" if isinstance(value, str) and value[:1].isdigit() else ""
        limits = f"a number from {low:g} to {high:g} {unit}".rstrip()
        raise OutOfRange(f"{field.name} is {shown}; expected {limits}{own}")
    return float(value)


def load(path: Path) -> Design:
    """Read a design file.

    Raises
    ------
    BadInput
        Not readable, not YAML, or not a design; the message names file and key.
    """
    data = yamlfile.read(path)
    return make({"name": path.stem} | data, str(path))


def make(data: Mapping[str, Any], where: str = "") -> Design:
    """Check a design given as plain data; ``where`` names its file in errors."""
    folder = Path(where).parent
    try:
        if isinstance(data, Mapping) and "shape" not in data:
            raise BadInput(f"shape is missing; expected {', '.join(packs.names('shapes', folder))}")
        design = _imported(checked(Design, with_own_files(dict(data), folder) if isinstance(data, Mapping) else data))
        _refuse_cell(design)
        _check_names(design)
        if "own" not in data and design.own.keys() & {"printers"}:  # a record needs no materials that it does not use
            design.machine.check_tools(folder)
    except SensorgenError as error:
        raise error.within(where) from None
    return design if design.name else design.model_copy(update={"name": name_of(design)})


def with_own_files(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's data with the content of all files in place of their names, relative to a folder."""
    data = packs.with_files(with_own(_one_dielectric(data), folder), folder)
    return borders.with_border(imported.with_geometry(data, folder), folder)


def _one_dielectric(data: dict[str, Any]) -> dict[str, Any]:
    """A design's data whose film and isolation are of an own dielectric too, unless they are given."""
    given = data.get("materials")
    word = given.get("dielectric") if isinstance(given, dict) and "bodies" not in data else None
    if not isinstance(given, dict) or not isinstance(word, str) or word.partition("@")[0] == Slots().dielectric:
        return data
    return data | {"materials": {"film": word, "isolation": word} | given}


def _imported(design: Design) -> Design:
    """A design; an imported one with its map checked, and with the materials of its parts."""
    if design.shape != imported.SHAPE and not (design.geometry or design.bodies):
        return design
    if design.shape != imported.SHAPE:
        raise BadInput(f"geometry, bodies: {design.shape} is drawn from parameters; expected shape: {imported.SHAPE}")
    imported.check(design.geometry, design.bodies, design.parameters)
    conductors = {name for slot in design._filled() if design.conducts(name := slot.partition("@")[0])}
    parts = imported.slots(design.geometry or "", design.bodies, conductors)
    given = {part: getattr(design.materials, part) for part in design.materials.model_fields_set}
    return design.model_copy(update={"materials": Slots(**{**parts, **given}), "parameters": {}})


def of_resolved(name: str, data: Mapping[str, Any]) -> Design:
    """The design of that name whose :meth:`Design.resolved` a record holds.

    Raises
    ------
    SensorgenError
        Not a resolved design, or one of a material, printer or quality that has other values here and now.
    """
    try:
        words = data.get("own", {})
        names = {
            key: next(iter(words.get(kind, ())), data[f"{key}_values"]["name"])
            for key, kind in (("printer", "printers"), ("quality", "qualities"))
        }
    except (AttributeError, KeyError, TypeError):
        raise BadInput(f"{name}: not a resolved design; expected one as batch.json has it") from None
    design = make({"name": name, **{key: data[key] for key in Design.model_fields if key in data}, **names})
    now = design.resolved()
    forms = (data, now, design._lasting(now))
    then, *here = ({k: v for k, v in d.items() if k not in ("sensorgen", "own")} for d in forms)
    if then not in json.loads(json.dumps(here)):
        raise BadInput(f"{name}: its materials, printer or quality have other values here than where it was recorded")
    return design


def _check_names(design: Design) -> None:
    """Look up every name that a design uses, so that a wrong one is reported before any work."""
    packs.check_texts(design.own)
    _ = design.params, design.machine, design.layers
    _check_slots(design)
    for name, values in design.material_values.items():
        material_files.check_own(name, values, design.own)
    _one_source_each(design)
    _soluble(design)
    _refuse_stacks(design)
    block = {design.tip.block} - {EVEN, STIFF}
    for name in (*design.tools, *design.infill, *design.profile.materials(), *block):
        design.material(name)
    machine = design.machine
    for name, tool in design.tools.items():
        if tool not in machine.tool_numbers:
            raise BadInput(f"tools.{name}: {machine.name} has no tool {tool}; it has {list(machine.tool_numbers)}")
    _one_tool_each(design)


def _check_slots(design: Design) -> None:
    """Refuse a source that a part's material does not quote, and a material that does not conduct as it has to."""
    for part in ("dielectric", *Slots.model_fields):  # whose material may be that of others
        if getattr(design.materials, part):
            material, source = design.slot(part)
            if source and source not in material.sources():
                raise UnknownName(f"source of {material.name}", source, material.sources() | set(packs.source_names()))
            if material.conductor != part.endswith("_electrode"):
                kind = "conducts" if material.conductor else "does not conduct"
                raise BadInput(f"materials.{part}: {material.name} {kind}")


def _refuse_cell(design: Design) -> None:
    """Refuse a cell, or regions, of a sensor that has no crossings."""
    for key in ("cell", "regions"):
        if getattr(design, key) and design.shape != ARRAY:
            raise BadInput(f"{key}: {design.shape} has no crossings; expected shape: {ARRAY}")
    if design.cell and design.cell.shape == ARRAY:
        raise BadInput(f"cell.shape: {ARRAY}; expected the shape of one crossing, as tri or reference")


def _one_source_each(design: Design) -> None:
    """A dielectric has one permittivity, wherever it is used; the electrodes may differ."""
    chosen: dict[str, str] = {}
    for part in Slots.model_fields:
        if getattr(design.materials, part) and not part.endswith("_electrode"):
            material, source = design.slot(part)
            if source and chosen.setdefault(material.name, source) != source:
                other = chosen[material.name]
                raise BadInput(f"materials.{part}: {material.name} is taken from {other} elsewhere; name one source")


def _soluble(design: Design) -> None:
    """The support is washed out: nothing that stays may be made of it."""
    slots = {part: (value or "").partition("@")[0] for part, value in design.materials.model_dump().items()}
    support = slots.pop("support")
    if support and support in slots.values():
        raise BadInput(
            f"materials.support: the sensor itself is made of {support}; expected a material that dissolves, as bvoh"
        )


def _refuse_stacks(design: Design) -> None:
    """Refuse layers so thin that they would fill the memory."""
    layers = design.drawn.size_mm[2] / design.layers.layer_mm
    if layers > MAX_LAYERS:
        raise OutOfRange(
            f"{layers:.3g} layers of {design.layers.layer_mm:g} mm; expected at most {MAX_LAYERS}: use another quality"
        )


def _one_tool_each(design: Design) -> None:
    owners: dict[int, str] = {}
    for material in sorted({body.material for body in design.drawn.bodies}):
        tool = design.tool(material)
        if tool in owners:
            raise BadInput(
                f"tool {tool} is given to both {owners[tool]} and {material}: choose with --tool {material}=NUMBER"
            )
        owners[tool] = material


def name_of(design: Design) -> str:
    """A name made of the shape and of whatever is not at its default.

    >>> name_of(Design(shape="tri", parameters={"dielectric_mm": 0.1}))
    'trix-d0.1'
    >>> name_of(Design(shape="rect", parameters={"along": "yx", "length_mm": 50}, quality="extrafine"))
    'sqyx-d0.2-length50-extrafine'
    """
    parts, default = list(_shape_in_name(design)), Design.model_construct(shape=design.shape)
    for given, usual in ((design.quality, default.quality), (design.printer, default.printer)):
        parts.append("" if given == usual else _plain(Path(given).stem))
    if design.orientation != default.orientation:
        parts.append("upside-down")
    said_if_set = {key for key in ("material_values", "border", "cell") if getattr(design, key)}
    said_if_set |= {"profile"} - design._plain()
    others = design.model_dump(include={"materials", "nozzle_mm", "tools", "infill", "shrinkage"} | said_if_set)
    if others != default.model_dump(include=set(others)):
        parts.append(digest(others))
    whole = "-".join(filter(None, parts))
    return whole if len(whole) <= 100 else f"{whole[:90].rstrip('.-_')}-{digest(whole)}"


def _shape_in_name(design: Design) -> Iterator[str]:
    """Shape and parameters that are not at their defaults, as parts of a name."""
    params, named = design.params, {"along"}
    yield getattr(design.form, "SHORT", design.shape) + str(getattr(params, "along", ""))
    if hasattr(params, "along"):
        yield f"d{params.dielectric_mm:.10g}"  # type: ignore[attr-defined]
        named |= {"dielectric_mm"}
    for field in dataclasses.fields(design.form.Params):
        value = getattr(params, field.name)
        if field.name not in named and value != field.default:
            in_name = f"-{_plain(value)}" if isinstance(value, str) else f"{value:.10g}"
            yield field.name.removesuffix("_mm").replace("_", "-") + in_name


def _plain(word: str) -> str:
    """A word as a part of a file's name."""
    return re.sub("[^A-Za-z0-9._]+", "-", word).strip(".-_")


def digest(data: object) -> str:
    """Six digits of the hash of plain data, as a part of a name."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:6]
