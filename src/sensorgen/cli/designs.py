"""Words on the command line to a design: a shape with options, or a file with changes to it."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

import click
from click.shell_completion import CompletionItem

from sensorgen.cli.settings import pairs
from sensorgen.cli.words import Length, OneOf, Share, completed
from sensorgen.core import plugins as registry
from sensorgen.core import units
from sensorgen.core.errors import BadInput, SensorgenError, within
from sensorgen.design import shapes

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.design.shape_files import Shape

Data = dict[str, Any]
Work = Callable[..., int]
Parts = Callable[["Design", Data], "Sequence[Design]"]


class DesignGroup(click.Group):
    """A command whose first word is a shape or a design file; each shape brings its own options."""

    def __init__(
        self, work: Work, own: list[click.Parameter], parts: Parts = lambda design, _: (design,), **attributes: Any
    ) -> None:
        """``work`` gets the design and the values of the command's ``own`` options; it returns the exit code.

        ``parts`` names the designs that it is done with in turn, by the design and these values.
        """
        super().__init__(
            options_metavar="",
            subcommand_metavar="{SHAPE|DESIGN.yaml} [OPTIONS]",
            epilog="SHAPE --help lists the options of the shape and of its print, too.",
            context_settings={"ignore_unknown_options": True},
            **attributes,
        )
        self.work, self.own, self.parts = work, own, parts

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

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Take the first word; an option in its place is the user's slip."""
        if ctx.resilient_parsing:  # the shell asks for words to complete
            try:
                return args[0], self.get_command(ctx, args[0]), args[1:]
            except SensorgenError:
                return None, None, []
        if args[0].startswith("-"):
            raise BadInput(
                f"{args[0]} stands before the shape; write {ctx.command_path} {{SHAPE|DESIGN.yaml}} {args[0]} ..."
            )
        return args[0], self.get_command(ctx, args[0]), args[1:]

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Files, and the shapes."""
        return [CompletionItem(incomplete, type="file"), *super().shell_complete(ctx, incomplete)]

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
            return max(self.work(part, **own) for part in self.parts(_design(base, given, name), own))

        others = [*_design_options(), *self.own]
        params = _parameter_options(module.Params, {word for other in others for word in other.opts}) if module else []
        about = _about(module)
        return click.Command(
            name,
            params=[*params, *others],
            callback=run,
            help=about,
            short_help=about.partition("\n")[0],
        )


def _of_packs(base: Data, folder: Path) -> Data:
    """A design's data with its shape's file, where that does not ship."""
    if not isinstance(base.get("shape"), str) or base["shape"] in (IMPORTED, ARRAY, *registry.names(shapes)):
        return base
    from sensorgen.design import packs

    found = packs.with_files({key: base[key] for key in ("shape", "own") if key in base}, folder)
    return base | found


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


def option_of(field: str) -> str:
    """Option for a parameter: ``hang_height_mm`` is ``--hang-height``."""
    return "--" + field.removesuffix("_mm").removesuffix("_deg").replace("_", "-")


def _parameter_options(params: type, taken: set[str]) -> list[click.Parameter]:
    """Options for a shape's parameters; one that the command has itself is led by "shape", as ``--shape-tip``."""
    options: list[click.Parameter] = []
    for field in dataclasses.fields(params):
        choices, option = field.metadata.get("choices"), option_of(field.name)
        option = f"--shape{option[1:]}" if option in taken else option
        options.append(
            click.Option(
                [option, _OF_SHAPE + field.name],
                type=OneOf(choices) if choices else _number_type(field),
                help=f"{field.metadata['help']}  [default: {_plainly(field.default)}]",
            )
        )
    return options


def _number_type(field: "dataclasses.Field[Any]") -> "click.ParamType[Any]":
    return click.FLOAT if field.name.endswith("_deg") or field.metadata.get("count") else Length()


def _plainly(default: Any) -> str:
    return f"{default:g}" if isinstance(default, float) else str(default)


def _design_options() -> list[click.Parameter]:
    def option(flag: str, metavar: str | None, about: str, **more: Any) -> click.Option:
        return click.Option([*flag.split()], metavar=metavar, help=about, **more)

    return [
        option("--size", "LxW", "Length and width at once, as in 100x10."),
        option(
            "--orientation", None, "How it lies on the bed; as-drawn if not given.",
            type=OneOf(["as-drawn", "upside-down"]),
        ),
        option(
            "--support", "MATERIAL", "Fill the air with a soluble support: bvoh, pla, none.",
            shell_complete=completed(lambda: ["bvoh", "none", "pla"]),
        ),
        option(
            "--material", "PART=NAME[@SOURCE]",
            "Material of a part (electrode, top_electrode, film, dielectric ...) and the source of its values.",
            multiple=True,
        ),
        option(
            "--printer", "NAME", "A printer that is listed, or a YAML file; diabase-h5 if not given.",
            shell_complete=completed(_printers),
        ),
        option(
            "--quality", "NAME", "A quality that is listed, or a YAML file; fine if not given.",
            shell_complete=completed(_qualities),
        ),
        option("--nozzle nozzle_mm", None, "Nozzle diameter, when not the printer's own.", type=Length()),
        option("--tool", "MATERIAL=NUMBER", "Tool of a material, in the printer's numbers.", multiple=True),
        option(
            "--infill", "[MATERIAL=]PERCENT", "Infill of a material; of the dielectric if none is named.", multiple=True
        ),
        option("--infill-pattern", "[MATERIAL=]PATTERN", "Pattern of the infill: rectilinear, grid ...", multiple=True),
        option("--border", "FILE", "Outline of the sensor in plan, an SVG or DXF file; its size is the sensor's."),
        option("--shrinkage", "SHARE", "Shrinkage in the plane to print against, as in 0.2.", type=Share()),
        option(
            "--set settings", "KEY=VALUE",
            "Any parameter, a material's value as eps_x60=3.0, or a key of the design file as infill.x60.percent=80.",
            multiple=True,
        ),
        option("--name", None, "Name of folder and files; made from the parameters if not given."),
    ]  # fmt: skip


def _printers() -> list[str]:
    from sensorgen.design import packs

    return packs.names("printers")


def _qualities() -> list[str]:
    from sensorgen.design import packs

    return packs.names("qualities")


def _design(base: Data, given: Data, word: str) -> "Design":
    from sensorgen.design import design, packs, settings

    unnamed = {k: v for k, v in base.items() if k != "name"}
    if isinstance(unnamed.get("materials"), dict):
        unnamed["materials"] = packs.slots(unnamed["materials"])
    data = settings.merged(unnamed, _changes(base, given))
    if given["name"] is not None:
        data["name"] = given["name"]
    elif data == unnamed and "name" in base:
        data["name"] = base["name"]
    return design.make(data, word if _is_file(word) else "")


def _changes(base: Data, given: Data) -> Data:
    """The options that were given, as the part of a design file that they stand for."""
    from sensorgen.design.settings import merged, setting

    known = {f.name for f in dataclasses.fields(shape.Params)} if (shape := _shape_of(base)) else set()
    parameters = {k: given[_OF_SHAPE + k] for k in known if given.get(_OF_SHAPE + k) is not None}
    parameters |= _size(given["size"]) if given["size"] is not None else {}
    slots = _slots(given["material"]) | _support(given["support"])
    dielectric = _dielectric(base, slots)
    changes = {
        "parameters": parameters,
        "materials": slots,
        "tools": {key: _integer(value, "--tool") for key, value in pairs(given["tool"], "--tool")},
        "infill": _infill(given, dielectric),
        **{
            k: given[k] for k in ("orientation", "printer", "quality", "nozzle_mm", "shrinkage") if given[k] is not None
        },
    }
    if given["border"] is not None:
        changes["border"] = str(Path(given["border"]).absolute())
    if given["tip"]:
        changes["tip"] = given["tip"]
    for key, value in pairs(given["settings"], "--set"):
        changes = merged(changes, setting(key, value, known))
    return {k: v for k, v in changes.items() if v != {}}


def _size(text: str) -> Data:
    try:
        length, width = map(units.length_mm, text.lower().replace("×", "x").split("x"))
    except (ValueError, BadInput):
        raise BadInput(f"--size {text!r}: expected LENGTHxWIDTH, as in 100x10") from None
    return {"length_mm": length, "width_mm": width}


def _slots(words: tuple[str, ...]) -> Data:
    slots: Data = {}
    for part, value in pairs(words, "--material"):
        slots |= {"top_electrode": value, "bottom_electrode": value} if part == "electrode" else {part: value}
    return slots


def _support(word: str | None) -> Data:
    if word is None:
        return {}
    return {"support": None if word == "none" else word}


def _dielectric(base: Data, slots: Data) -> str:
    own = base.get("materials")
    named = slots.get("dielectric") or (own.get("dielectric") if isinstance(own, dict) else None) or "x60"
    return str(named).partition("@")[0]


def _infill(given: Data, dielectric: str) -> Data:
    found: Data = {}
    for option, key in (("infill", "percent"), ("infill_pattern", "pattern")):
        for word in given[option]:
            material, _, value = word.rpartition("=")
            entry = _number(value.removesuffix("%"), "--infill") if key == "percent" else value
            found.setdefault(material or dielectric, {})[key] = entry
    return found


def _integer(value: str, option: str) -> int:
    try:
        return int(value)
    except ValueError:
        raise BadInput(f"{option}: {value!r} is not a whole number") from None


def _number(value: str, option: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise BadInput(f"{option}: {value!r} is not a number") from None
