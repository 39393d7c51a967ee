"""``--set``, ``--sweep`` and ``--apply``: parameters, keys of the design file, and values of materials."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli.words import NumberRange
from sensorgen.core import units
from sensorgen.core.errors import BadInput, SensorgenError, UnknownName

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.workflows.decision import Advice, Change

Data = dict[str, Any]

SYMBOLS = {"eps": "relative_permittivity", "loss": "loss_tangent", "nu": "poisson_ratio", "rho": "resistivity_ohm_m"}


def pairs(words: tuple[str, ...], option: str) -> list[tuple[str, str]]:
    """Words of the form KEY=VALUE, taken apart."""
    for word in words:
        if "=" not in word.strip("="):
            raise BadInput(f"{option} {word!r}: expected KEY=VALUE")
    return [(k.strip(), v.strip()) for k, _, v in (word.partition("=") for word in words)]


def setting(key: str, value: str, parameters: set[str]) -> Data:
    """One setting as the part of a design file that it stands for.

    Parameters
    ----------
    key : str
        A parameter of the shape, a material's value as ``eps_x60``, or a key of the file with dots between its parts.
    value : str
        As typed.
    parameters : set of str
        Names of the shape's parameters.

    Raises
    ------
    UnknownName
        The key is none of these; the nearest is offered.

    Examples
    --------
    >>> setting("dielectric_mm", "100um", {"dielectric_mm"}), setting("eps_x60", "3", set())
    ({'parameters': {'dielectric_mm': 0.1}}, {'material_values': {'x60': {'relative_permittivity': 3}}})
    """
    from sensorgen.design.design import Design

    path = ["parameters", key] if key in parameters else key.split(".")
    if len(path) == 1 and key not in Design.model_fields:
        path = _of_material(key) or path
    if path[0] not in Design.model_fields or len(path) > 3:
        raise UnknownName("key of --set", key, parameters | set(Design.model_fields) | {"eps_x60"})
    end: Any = _parameter(value) if path[0] == "parameters" else _plain(value)
    if path == ["materials", "electrode"]:
        return {"materials": {"top_electrode": end, "bottom_electrode": end}}
    for part in reversed(path):
        end = {part: end}
    return dict(end)


def _of_material(key: str) -> list[str] | None:
    """The place of a material's value: ``eps_x60`` or ``youngs_modulus_x60``, its unit left out if one likes."""
    from sensorgen.design import materials, packs

    word, _, name = key.rpartition("_")
    quantity = SYMBOLS.get(word) or next((q for q in materials.quantities() if f"{q}_".startswith(f"{word}_")), "")
    known = materials.names()
    if not word or not (quantity or name in known):
        return None
    if name not in known and name not in (known := packs.names("materials")):
        raise packs.unknown("materials", name, known)
    if not quantity:
        raise UnknownName(f"quantity of {name}", word, {*SYMBOLS, *materials.quantities()})
    return ["material_values", name, quantity]


def sweep(text: str, design: "Design") -> tuple[str, list[tuple[float | str, "Design"]]]:
    """A sweep as typed: its key, and the design for each value.

    Parameters
    ----------
    text : str
        KEY=START:STOP:STEP or KEY=VALUE,VALUE,...; keys as of :func:`setting`.
    design : Design
        That is varied.

    Raises
    ------
    SensorgenError
        A key or values that mean nothing, or a value that this design cannot have: before any work.
    """
    from sensorgen.design import design as designs

    ((key, typed),) = pairs((text,), "--sweep")
    fields = {field.name: field for field in dataclasses.fields(design.form.Params)}
    same = design.model_dump(exclude={"name"})
    return key, [
        (value, designs.make(merged(same, setting(key, str(value), set(fields))), f"{key}={value}"))
        for value in _values(typed, fields.get(key))
    ]


def _values(typed: str, field: Any) -> list[Any]:
    """Numbers, or the words that a parameter may be."""
    if field is not None and "choices" in field.metadata:
        return typed.split(",")
    return list(units.values(typed, units.NUMBER if field is None else units.LENGTH_MM))


def merged(base: Any, change: Any) -> Any:
    """Plain data with a change to it: mappings key by key, anything else in place of what was there."""
    if isinstance(base, dict) and isinstance(change, dict):
        return base | {k: merged(base[k], v) if k in base else v for k, v in change.items()}
    return change


def _parameter(value: str) -> float | str:
    try:
        return units.length_mm(value)
    except SensorgenError:
        return value


def _plain(value: str) -> Any:
    for kind in (int, float):
        try:
            return kind(value)
        except ValueError:
            continue
    return None if value == "none" else value


def advice_options() -> list[click.Parameter]:
    """``--budget`` and ``--apply``: changes of a design that are tried, and written into its file."""
    return [
        click.Option(
            ["--budget"], type=NumberRange(0, 3600), default=60.0, show_default=True, metavar="SECONDS",
            envvar="SENSORGEN_BUDGET",
            help="Processor time for prediction and for changes to try; 0 tries none.",
        ),
        click.Option(
            ["--apply", "apply_change"], is_flag=False, flag_value=1, type=click.IntRange(1, 9), metavar="[K]",
            help="Write the first, or the K-th, of these changes into the design's file.",
        ),
    ]  # fmt: skip


def applied(design: "Design", advice: "Advice | None", number: int | None) -> None:
    """Write the change that ``--apply`` asks for, and say so.

    Raises
    ------
    BadInput
        There is no such change, or no file to write it into.
    """
    if number is None:
        return
    tried = advice.tried if advice else ()
    if number > len(tried):
        above = f"expected the number of a change above, at most {len(tried)}"
        raise BadInput(f"--apply {number}: {above if tried else 'no change that was tried helps'}")
    change = tried[number - 1]
    word = click.get_current_context().info_name or ""
    if not (word.endswith((".yaml", ".yml")) or "/" in word):
        raise BadInput(f"--apply: {word} is no design file; use these options: {' '.join(_options(change.changes))}")
    from sensorgen.workflows.apply import apply

    apply(Path(word), design, change)
    from sensorgen.cli import render

    changes = ", ".join(one.words() for one in change.changes)
    render.say(f"{word} is changed: {changes}; all above is of the design before: run the command again", err=True)


def _options(changes: "tuple[Change, ...]") -> list[str]:
    """The changes as options of the command line."""
    return [f"--set {one.key}={one.after:g}" if isinstance(one.after, float) else f"--set {one.key}={one.after}"
            for one in changes]  # fmt: skip
