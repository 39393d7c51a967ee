"""The designs of a target: every combination of its values, heights in layers and widths in half lines."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import product
from math import ceil, floor, prod
from pathlib import Path
from typing import Any

from sensorgen.core.errors import BadInput, SensorgenError, UnknownName
from sensorgen.design.design import Design, make, with_own_files
from sensorgen.workflows.moves import Candidate, Value, lengths, with_values
from sensorgen.workflows.optimise.target import Range, Target

MOST = 20_000  # designs: their checks alone take half an hour on two cores
_NEAR = 1e-9
Data = dict[str, Any]
Part = tuple[dict[str, Value], dict[str, list[Value]]]  # choices, and values that they leave the shape's parameters


@dataclass(frozen=True)
class Space:
    """Every combination of the values of a target.

    Attributes
    ----------
    base : dict
        The design that is varied, as data.
    folder : Path
        From which files of materials, printers and shapes are seen.
    lengths : frozenset of str
        Parameters of the shape.
    parts : tuple
        Choices, and the values of the shape's parameters that they leave.
    """

    base: Data
    folder: Path
    lengths: frozenset[str]
    parts: tuple[Part, ...]

    @property
    def size(self) -> int:
        """Number of designs."""
        return sum(prod(len(values) for values in inside.values()) for _, inside in self.parts)

    def candidate(self, values: dict[str, Value]) -> Candidate:
        """The design with these values."""
        try:
            return Candidate(values, make(with_own_files(_with(self.base, self.lengths, values), self.folder)))
        except SensorgenError as error:
            return Candidate(values, discarded=str(error))

    def at(self, part: int, shares: Mapping[str, float]) -> Candidate:
        """The design of a part, by the share of each range that lies below its value, from 0 to below 1."""
        chosen, inside = self.parts[part]
        return self.candidate(chosen | {k: values[int(shares[k] * len(values))] for k, values in inside.items()})


def candidates(target: Target, folder: Path = Path()) -> list[Candidate]:
    """Every design of a target.

    Parameters
    ----------
    target : Target
        Its base design and the values that it takes.
    folder : Path
        Of the target's file, from which files of materials, printers and shapes are seen.

    Raises
    ------
    UnknownName
        A parameter that neither the shape nor a design file has.
    BadInput
        No design at all, none with one of the values that are listed, or more than ``MOST``.
    """
    whole = space(target, folder)
    if whole.size > MOST:
        longest = max(((len(v), k) for _, inside in whole.parts for k, v in inside.items()), default=(0, ""))
        raise BadInput(
            f"{whole.size:.3g} designs; expected at most {MOST}: give a larger step, narrower ranges or fewer choices "
            f"({longest[1]} alone has {longest[0]} values), or --sample 400, which proves nothing"
        )
    every = [whole.candidate(chosen | values) for chosen, inside in whole.parts for values in _combinations(inside)]
    for key, given in target.parameters.items():
        if not isinstance(given, Range):
            _refuse_impossible(key, given, every)
    return every


def _refuse_impossible(key: str, values: list[Value], every: list[Candidate]) -> None:
    """Refuse a value that no design can have."""
    for value in values:
        own = [candidate for candidate in every if candidate.values.get(key) == value]
        if own and not any(candidate.made for candidate in own):
            raise BadInput(f"parameters.{key}: no design can have {value!r}: {own[0].discarded}")


def space(target: Target, folder: Path = Path()) -> Space:
    """The space of a target, of any size; raises as :func:`candidates`."""
    design = target.design if isinstance(target.design, Mapping) else {}
    base = with_own_files({k: v for k, v in design.items() if k != "name"}, folder)
    known = frozenset(asdict(make(base).params))
    _refuse_unknown(target, known)
    whole = Space(base, folder, known, tuple(_parts(target, base, folder, known)))
    if not whole.size:
        raise BadInput(
            f"no printable value of {', '.join(_empty(whole, target))} in its range: expected a whole layer or half "
            "line in it"
        )
    return whole


def _parts(target: Target, base: Data, folder: Path, known: frozenset[str]) -> Iterator[Part]:
    """Choices, as of a nozzle, which set the grid of lengths, with the values on it; then further single designs."""
    lengths_of_shape = {key: given for key, given in target.parameters.items() if key in known}
    others = {key: _listed(given) for key, given in target.parameters.items() if key not in known}
    for chosen in _combinations(others):
        yield chosen, {
            key: _values(key, given, with_own_files(_with(base, known, chosen), folder))
            for key, given in lengths_of_shape.items()
        }
    for one in target.also:
        yield {}, {key: [value] for key, value in one.items()}


def _empty(whole: Space, target: Target) -> list[str]:
    """Parameters without a printable value."""
    inner = {key for _, inside in whole.parts for key, values in inside.items() if not values}
    outer = {key for key, given in target.parameters.items() if key not in whole.lengths and not _listed(given)}
    return sorted(inner | outer)


def _refuse_unknown(target: Target, known: frozenset[str]) -> None:
    """Refuse a parameter that no design has, and a range without a step that has no printable grid."""
    for key, given in target.parameters.items():
        if key not in known and key.partition(".")[0] not in Design.model_fields:
            raise UnknownName(
                "parameter to vary", key, [*known, "quality", "materials.film", "orientation", "nozzle_mm"]
            )
        if isinstance(given, Range) and key not in known and given.step is None:
            raise BadInput(f"parameters.{key}: a range without a step; only lengths of the shape have a printable grid")


def _combinations(space: Mapping[str, list[Value]]) -> Iterator[dict[str, Value]]:
    for values in product(*space.values()):
        yield dict(zip(space, values, strict=True))


def _with(base: Data, known: frozenset[str], values: Mapping[str, Value]) -> Data:
    """The base design as data with other values."""
    return with_values(
        {k: v for k, v in base.items() if k != "name"},
        {("parameters", key) if key in known else tuple(key.split(".")): value for key, value in values.items()},
    )


def _listed(given: Range | list[Value]) -> list[Value]:
    """Choices as written, or numbers by their step."""
    if isinstance(given, list):
        return list(dict.fromkeys(given))
    step = given.step or 1.0
    return _steps(given.first, step, floor((given.to - given.first) / step + _NEAR) + 1)


def _values(key: str, given: Range | list[Value], data: Data) -> list[Value]:
    """Values of a parameter: on the printable grid where a range has no step."""
    if isinstance(given, list) or given.step is not None:
        return _listed(given)
    step = grid_mm(make(data), key)
    low, high = ceil(given.first / step - _NEAR), floor(given.to / step + _NEAR)
    return _steps(low * step, step, high - low + 1)


def _steps(first: float, step: float, count: int) -> list[Value]:
    if count > MOST:
        raise BadInput(
            f"{count:.3g} values from {first:g} in steps of {step:g}; expected at most {MOST} designs in all"
        )
    return [round(first + k * step, 9) for k in range(count)]


def grid_mm(design: Design, key: str) -> float:
    """Printable step of a length: a layer where it moves a face up or down, else half a line [mm]."""
    is_height = {name: up for name, _, up in lengths(design)}.get(key, "height" in key or key == "isolation_mm")
    return design.layers.layer_mm if is_height else design.machine.line_mm() / 2
