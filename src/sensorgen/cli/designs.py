"""Words on the command line to a design, a shape with options or a file with changes to it; and to its body.

A body is the print (by default), its G-code, by a slicer or walls of its own, or the drawing.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, cast

import click

from sensorgen.cli import commands, render
from sensorgen.cli.commands import arguments, completed, options_of
from sensorgen.cli.options import DesignTip
from sensorgen.core import lazy as registry
from sensorgen.core import units
from sensorgen.core.errors import BadInput, within
from sensorgen.core.options import Option
from sensorgen.design import shapes
from sensorgen.design.walls import SLICERS, TITLES, WALLS, rule

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.design.body import Body
    from sensorgen.design.design import Design
    from sensorgen.design.shape_files import Shape
    from sensorgen.prediction.slices import PrintReview
    from sensorgen.workflows.trial import Adjustment

Data = dict[str, Any]
Parts = Callable[["Design", Data], "Sequence[Design]"]


@dataclasses.dataclass(frozen=True)
class _TipOption:
    """Tip in place of the design's own."""

    tip: DesignTip = None


class DesignGroup(commands.FirstWord):
    """A command whose first word is a shape or a design file; each shape brings its own options."""

    def __init__(
        self, name: str, work: commands.Work, *more: click.Parameter, tip: bool = False, parts: Parts | None = None,
        **attributes: Any,
    ) -> None:  # fmt: skip
        """Command of a function, which gets the design and the values of its own options; ``more`` come after them.

        ``parts`` names the designs that it is done with in turn in place of an array, by it and these values.
        """
        super().__init__(
            name,
            work,
            thing="shape",
            form="{{SHAPE|DESIGN.yaml}} {option} ...",
            subcommand_metavar="{SHAPE|DESIGN.yaml} [OPTIONS]",
            epilog="SHAPE --help lists the options of the shape and of its print, too.",
            **attributes,
        )
        self.parts = parts
        self.own = [*(options_of(_TipOption) if tip else []), *options_of(work), *more]

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002
        """Names of the shapes."""
        return sorted([ARRAY, *registry.names(shapes)])

    def get_command(self, ctx: click.Context, name: str) -> click.Command:  # noqa: ARG002
        """The command for a shape, or for a design file."""
        if name == ARRAY or name in registry.names(shapes):
            return self._command(name, _shape_of({"shape": name}), {"shape": name})
        if name.endswith(".py") or not _is_file(name):
            base = _of_packs({"shape": name}, Path())
            return self._command(base["shape"], _shape_of(base), base)
        from sensorgen.core import yamlfile

        base = {"name": Path(name).stem} | yamlfile.read(Path(name))
        with within(name):
            base = _of_packs(base, Path(name).parent)
            return self._command(name, _shape_of(base), base)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the command's options, then the shapes."""
        with formatter.section("Options"):
            formatter.write_dl([row for p in (*self.own, *self.get_params(ctx)) if (row := p.get_help_record(ctx))])
        with formatter.section("Shapes"):
            formatter.write_text(", ".join(self.list_commands(ctx)))

    def _command(self, name: str, module: "Shape | ModuleType | None", base: Data) -> click.Command:
        def run(**given: Any) -> int:
            own = {p.name: given.pop(p.name) for p in self.own if p.name in given}
            given["tip"] = own.pop("tip", None)
            design = _design(base, given, name)
            parts = self.parts(design, own) if self.parts and design.layout else (design,)
            _refuse_one_result(len(parts), own)
            return max(commands.ended(self.work(part, **arguments(self.work, own))) for part in parts)

        others = [*options_of(DesignOptions), *self.own]
        taken = {"--help", *(word for other in others for word in other.opts)}
        params = _parameter_options(module.Params, taken) if module else []
        about = _about(module)
        short = about.partition("\n")[0]
        return click.Command(name, params=[*params, *others], callback=run, help=about, short_help=short)


def of_design(
    name: str, *more: click.Parameter, tip: bool = False, group: click.Group | None = None, about: str = "",
    **attributes: Any,
) -> Callable[[commands.Work], DesignGroup]:  # fmt: skip
    """Make a command on designs of a function; with ``tip``, its designs may be given another one that presses."""

    def made(work: commands.Work) -> DesignGroup:
        one = DesignGroup(name, work, *more, tip=tip, help=about or commands.described(work)[0], **attributes)
        if group is not None:
            group.add_command(one)
        return one

    return made


def _of_packs(base: Data, folder: Path) -> Data:
    """A design's data with its shape's file, where that does not ship."""
    if not isinstance(base.get("shape"), str) or base["shape"] in (IMPORTED, ARRAY, *registry.names(shapes)):
        return base
    from sensorgen.design import packs

    with_files = packs.with_files({key: base[key] for key in ("shape", "own") if key in base}, folder)
    return base | with_files


def _shape_of(base: Data) -> "Shape | ModuleType | None":
    """The shape of a design's data; None where the design is to be refused later."""
    name = base.get("shape")
    if not isinstance(name, str) or name == IMPORTED:
        return None
    if name == ARRAY:
        from sensorgen.design import arrays

        return cast("Shape", arrays)
    if name in registry.names(shapes):
        return registry.load(shapes, name)
    from sensorgen.design import shape_files

    kinds = base.get("own")
    texts = kinds.get("shapes") if isinstance(kinds, dict) else None
    text = texts.get(name) if isinstance(texts, dict) else None
    return shape_files.load(name, text) if isinstance(text, str) else None


def _about(module: "Shape | ModuleType | None") -> str:
    """Description by a shape's file; click leaves a picture alone that follows a backspace."""
    about = (module.__doc__ or "").strip() if module else ""
    return about.replace("\n\n::\n\n", "\n\n\b\n").replace("::\n\n", ":\n\n\b\n")


def _is_file(word: str) -> bool:
    return word.endswith((".yaml", ".yml", ".py")) or "/" in word


IMPORTED = "imported"  # shape of a design whose bodies came from a CAD file: it has no parameters
ARRAY = "array"  # shape of crossing tracks, with cells of another one
_OF_SHAPE = "of_shape_"  # before names of parameters, which a command's own may equal


def _refuse_one_result(count: int, own: Data) -> None:
    """Refuse of several tiles what takes one result."""
    if count > 1 and own.get("apply") is not None:
        raise BadInput(f"--apply of {count} tiles; expected no change of each: change the design's file")
    if count > 1 and not render.early():
        raise BadInput(f"{count} tiles have {count} results; expected no --json, --csv, --markdown and --output")


def _parameter_options(params: type, taken: set[str]) -> list[click.Parameter]:
    """Options for a shape's parameters; one that the command has itself is led by "shape", as ``--shape-tip``."""
    options: list[click.Parameter] = []
    for field in dataclasses.fields(params):
        default = f"{field.default:g}" if isinstance(field.default, float) else field.default
        option = f"--{field.name.removesuffix('_mm').removesuffix('_deg').replace('_', '-')}"
        option = f"--shape{option[1:]}" if option in taken else option
        options.append(
            click.Option(
                [option, _OF_SHAPE + field.name],
                type=_kind(field),
                help=f"{field.metadata['help']}  [default: {default}]",
            )
        )
    return options


def _kind(field: "dataclasses.Field[Any]") -> "click.ParamType[Any]":
    """Kind of a parameter's words: one of its choices, a number, or a length."""
    if choices := field.metadata.get("choices"):
        return commands.OneOf(choices)
    return click.FLOAT if field.name.endswith("_deg") or field.metadata.get("count") else commands.KINDS["length"]


@dataclasses.dataclass(frozen=True)
class DesignOptions:
    """Options that stand for keys of a design file.

    Stated here and not in :class:`sensorgen.design.design.Design`, which loads pydantic: ``--help`` does without.

    Attributes
    ----------
    size : LxW
        Length and width at once, as in 100x10.
    orientation
        How it lies on the bed; as-drawn if not given.
    support : MATERIAL
        Fill the air with a soluble support: bvoh, pla, none.
    material : PART=NAME[@SOURCE]
        Material of a part (electrode, top_electrode, film, dielectric ...) and the source of its values.
    printer : NAME
        A printer that is listed, or a YAML file; diabase-h5 if not given.
    quality : NAME
        A quality that is listed, or a YAML file; fine if not given.
    nozzle_mm
        Nozzle diameter, when not the printer's own.
    tool : MATERIAL=NUMBER
        Tool of a material, in the printer's numbers.
    infill : [MATERIAL=]PERCENT
        Infill of a material; of the dielectric if none is named.
    infill_pattern : [MATERIAL=]PATTERN
        Pattern of the infill: rectilinear, grid ...
    border : FILE
        Outline of the sensor in plan, an SVG or DXF file; its size is the sensor's.
    shrinkage
        Shrinkage in the plane to print against, as in 0.2.
    settings, --set : KEY=VALUE
        Any parameter, a material's value as eps_x60=3.0, or a key of the design file as infill.x60.percent=80.
    name
        Name of folder and files; made from the parameters if not given.
    """

    size: str | None = None
    orientation: Annotated[str | None, Option(kind=("as-drawn", "upside-down"))] = None
    support: Annotated[str | None, Option(more={"shell_complete": completed(lambda: ["bvoh", "none", "pla"])})] = None
    material: tuple[str, ...] = ()
    printer: Annotated[str | None, Option(more={"shell_complete": completed(lambda: _listed("printers"))})] = None
    quality: Annotated[str | None, Option(more={"shell_complete": completed(lambda: _listed("qualities"))})] = None
    nozzle_mm: Annotated[float | None, Option(kind="length")] = None
    tool: tuple[str, ...] = ()
    infill: tuple[str, ...] = ()
    infill_pattern: tuple[str, ...] = ()
    border: str | None = None
    shrinkage: Annotated[float | None, Option(kind="share")] = None
    settings: tuple[str, ...] = ()
    name: str | None = None

    def changes(self, base: Data) -> Data:
        """The part of a design file that the options stand for; None or {} of what was not given."""
        slots: Data = {}
        for part, value in commands.pairs(self.material, "--material"):
            slots |= {"top_electrode": value, "bottom_electrode": value} if part == "electrode" else {part: value}
        if self.support is not None:
            slots["support"] = None if self.support == "none" else self.support
        return {
            "parameters": {} if self.size is None else _size(self.size),
            "materials": slots,
            "tools": {key: _number(value, "--tool", int) for key, value in commands.pairs(self.tool, "--tool")},
            "infill": self._infill(_dielectric(base, slots)),
            "border": None if self.border is None else str(Path(self.border).absolute()),
            **{key: getattr(self, key) for key in ("orientation", "printer", "quality", "nozzle_mm", "shrinkage")},
        }

    def _infill(self, dielectric: str) -> Data:
        infill: Data = {}
        for words, key in ((self.infill, "percent"), (self.infill_pattern, "pattern")):
            for word in words:
                material, _, value = word.rpartition("=")
                entry = _number(value.removesuffix("%"), "--infill", float) if key == "percent" else value
                infill.setdefault(material or dielectric, {})[key] = entry
        return infill


def _listed(kind: Any) -> list[str]:
    from sensorgen.design import packs

    return packs.names(kind)


def _design(base: Data, given: Data, word: str) -> "Design":
    """The design of a file or a shape with the options that were given."""
    from sensorgen.design import design, packs, settings

    unnamed = {k: v for k, v in base.items() if k != "name"}
    if isinstance(unnamed.get("materials"), dict):
        unnamed["materials"] = packs.slots(unnamed["materials"])
    chosen = DesignOptions(**arguments(DesignOptions, given))
    parameters = _of_shape(given)
    data = settings.merged(unnamed, _given(chosen.changes(base) | {"tip": given["tip"]}, parameters))
    for key, value in commands.pairs(chosen.settings, "--set"):
        data = settings.merged(data, settings.setting(key, value, set(parameters)))
    if chosen.name is not None:
        data["name"] = chosen.name
    elif data == unnamed and "name" in base:
        data["name"] = base["name"]
    elif "geometry" in base:  # which has no parameters to be named after
        data["name"] = f"{str(base['name'])[:90]}-{design.digest(str(data))}"
    return design.make(data, word if _is_file(word) else "")


def _of_shape(given: Data) -> Data:
    """Parameters of the shape, None where they were not given."""
    return {key.removeprefix(_OF_SHAPE): value for key, value in given.items() if key.startswith(_OF_SHAPE)}


def _given(changes: Data, parameters: Data) -> Data:
    """Changes of a design and of its shape's parameters, without those that were not given; a material may be none."""
    given = {key: value for key, value in parameters.items() if value is not None}
    changes["parameters"] = given | changes["parameters"]
    return {key: value for key, value in changes.items() if value not in (None, {})}


def _size(text: str) -> Data:
    try:
        length, width = map(units.length_mm, text.lower().replace("×", "x").split("x"))
    except (ValueError, BadInput):
        raise BadInput(f"--size {text!r}: expected LENGTHxWIDTH, as in 100x10") from None
    return {"length_mm": length, "width_mm": width}


def _dielectric(base: Data, slots: Data) -> str:
    """Name of the dielectric's material."""
    stated = base.get("materials")
    named = slots.get("dielectric") or (stated.get("dielectric") if isinstance(stated, dict) else None) or "x60"
    return str(named).partition("@")[0]


def _number(value: str, option: str, kind: type[int] | type[float]) -> float:
    try:
        return kind(value)
    except ValueError:
        raise BadInput(f"{option}: {value!r} is not a {'whole ' if kind is int else ''}number") from None


@dataclass(frozen=True)
class BodyChoice:
    """Body that is meant, by one option at most; the body of a design by a call.

    Attributes
    ----------
    drawn
        The drawing, in place of the print.
    gcode : FILE
        The print by this file, whoever has sliced it; if not given, the G-code in out/NAME, else by the slicer that is
        installed (SENSORGEN_SLICER: prusa, cura or none), else an estimate.
    slicer
        Slice now for the print.
    walls
        Estimate the print for these walls alone; for all of them if not given, Arachne's as the best value.
    """

    drawn: bool = False
    gcode: str = ""  # fmt: skip
    slicer: Annotated[str, Option(kind=tuple(SLICERS))] = ""
    walls: Annotated[str, Option(kind=tuple(WALLS))] = ""

    def __post_init__(self) -> None:
        """Refuse two bodies at once."""
        given = [f"--{one.name}" for one in fields(self) if getattr(self, one.name)]
        if len(given) > 1:
            raise BadInput(f"{given[0]} and {given[1]} at once; expected one of them")

    def __call__(self, design: "Design") -> "Body":
        """The body of a design."""
        from sensorgen.prediction import bodies

        if self.drawn:
            given = click.get_current_context().params
            if given.get("infill") or given.get("infill_pattern"):  # which would do nothing
                raise BadInput(
                    "--drawn and --infill at once: a drawing is solid; leave out --drawn to predict the print"
                )
            return bodies.drawn(design)
        if self.gcode:
            return bodies.from_gcode(design, self.gcode)
        if self.slicer:
            return sliced(self.slicer, design)
        return bodies.estimated(design, self.walls) if self.walls else bodies.default_body(design)

    def printed(self, design: "Design") -> "tuple[Printed | None, PrintReview]":
        """The print of a design, None for the drawing, and all findings about it."""
        from sensorgen.checks.review import STEPS, review
        from sensorgen.prediction import bodies, slices

        with render.progress((*STEPS, "slicing")) as step:
            if self.gcode:
                printed = bodies.registered(design, Path(self.gcode))
                return printed, slices.combined(design, review(design, step), printed.provenance, printed.findings())
            findings = slices.reviewed(design, step, self.slicer, walls=self.walls)
            return None if self.drawn else findings.printed(design, self.walls), findings


Compensate = Annotated[
    str,
    Option(
        "Change the design so that what is asked for comes out: whole layers, widths of a line, electrode gap and "
        "capacitance; with bake also larger by the 20 % that the bake takes off; with stiffness as stiff, too.",
        kind=("print", "bake", "stiffness"),
    ),
]


def compensated(
    design: "Design", word: str, slicer: str = "", program: str = ""
) -> "tuple[Design, list[Adjustment]]":  # fmt: skip
    """The design to print, and what was changed: by prints of the slicer, the deciding one if none is named."""
    if not word:
        return design, []
    from sensorgen.prediction.print_files import NONE, deciding
    from sensorgen.workflows.compensation import compensated as changed

    decides = slicer or deciding()
    walls = rule("prusa" if decides == NONE else decides, design.walls)
    with render.progress(("designs",)) as step:
        printable, changes = changed(
            design, walls, bake=word == "bake", stiffness=word == "stiffness",
            sliced=None if decides == NONE else partial(sliced, slicer, program=program), step=step,
        )  # fmt: skip
    if not changes:
        by = f"the estimate for {walls} walls" if decides == NONE else TITLES[decides]
        render.say(f"--compensate {word}: nothing to change, by {by}", err=True)
    return printable, changes


def sliced(slicer: str, design: "Design", program: str = "") -> "Body":
    """The print of a design by a slicer."""
    from sensorgen.export import slicing
    from sensorgen.prediction import bodies, print_files

    with render.progress(slicing.STEPS) as step:
        return bodies.of_file(design, print_files.at_hand(design, None, slicer, step, program)[0])
