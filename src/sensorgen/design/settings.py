"""Settings of a design by short names: parameters, keys of its file, and values of materials."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

from sensorgen.core import units
from sensorgen.core.errors import SensorgenError, UnknownName
from sensorgen.design import materials, packs
from sensorgen.design.design import Design, make

Data = dict[str, Any]
Setting = float | str

SYMBOLS = {"eps": "relative_permittivity", "loss": "loss_tangent", "nu": "poisson_ratio", "rho": "resistivity_ohm_m"}


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
    path = ["parameters", key] if key in parameters else key.split(".")
    if len(path) == 1 and key not in Design.model_fields:
        path = _of_material(key) or path
    if path[0] not in Design.model_fields or len(path) > 3:
        raise UnknownName("setting", key, parameters | set(Design.model_fields) | {"eps_x60"})
    end: Any = _parameter(value) if path[0] == "parameters" else _plain(value)
    if path == ["materials", "electrode"]:
        return {"materials": {"top_electrode": end, "bottom_electrode": end}}
    for part in reversed(path):
        end = {part: end}
    return dict(end)


def _of_material(key: str) -> list[str] | None:
    """The place of a material's value: ``eps_x60`` or ``youngs_modulus_x60``, its unit left out if one likes."""
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


def varied(design: Design, settings: Mapping[str, Sequence[Setting]]) -> Iterator[tuple[tuple[Setting, ...], Design]]:
    """Combinations of the values of some settings, with the design of each.

    Parameters
    ----------
    design : Design
        That is varied.
    settings : mapping of str to sequence
        Values by key, as of :func:`setting`.

    Raises
    ------
    SensorgenError
        A key that means nothing, or a value that this design cannot have.

    Examples
    --------
    >>> [d.params.dielectric_mm for _, d in varied(Design(shape="reference"), {"dielectric_mm": (0.2, 0.4)})]
    [0.2, 0.4]
    """
    parameters = {field.name for field in fields(design.form.Params)}
    same = design.model_dump(exclude={"name"})
    for values in itertools.product(*settings.values()):
        data, chosen = same, dict(zip(settings, values, strict=True))
        for key, value in chosen.items():
            data = merged(data, setting(key, str(value), parameters))
        yield values, make(data, ",".join(f"{key}={value}" for key, value in chosen.items()))


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
