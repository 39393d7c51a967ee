"""A target as written in a YAML file: what to vary, what to reach, what is not accepted; and its designs.

Those are every combination of its values, heights in layers and widths in half lines.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import filterfalse, product
from math import ceil, floor, inf, prod
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from sensorgen.checks.rules import RULES
from sensorgen.core import yamlfile
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import BadInput, SensorgenError, UnknownName, within
from sensorgen.core.records import Strict, checked
from sensorgen.core.units import M_PER_MM
from sensorgen.design import best, packs
from sensorgen.design.design import Design, make, with_own_files
from sensorgen.prediction.identifiability.results import GUESS
from sensorgen.prediction.query import DEFAULT, FORCE_N, NOISE, Query
from sensorgen.scene.scene import Envelope
from sensorgen.workflows.moves import Candidate, Value, lengths, with_values
from sensorgen.workflows.trial import Numbers, Toolpath, Trial


@dataclass(frozen=True)
class Number:
    """A number that a target may name.

    Attributes
    ----------
    field, unit : str
        Its place in a trial, and the unit in its name.
    size : float
        That unit in the trial's.
    of_path : bool
        Whether it is known of G-code alone.
    like : str
        Of a best value alone: the number that its models leave open as much of.
    """

    field: str
    unit: str
    size: float = 1.0
    of_path: bool = False
    like: str = ""

    @property
    def words(self) -> str:
        """Name for people.

        >>> NUMBERS["position_resolution_mm"].words, NUMBERS["exposure_mm"].words
        ('position resolution', 'exposure')
        """
        return self.field.removesuffix("_mm").removesuffix("_s").replace("_", " ")

    def of(self, found: Numbers, path: Toolpath | None = None) -> Bounds | None:
        """Value with its range, in the unit of its name; None where unknown."""
        value = getattr(path, self.field, None) if self.of_path else getattr(found, self.field)
        if value is None:
            return None
        if isinstance(value, float):
            wide = getattr(found, self.like) if self.like else None
            value = Bounds.of(value, self.unit, model=wide.model.times(value / wide.value) if wide else None)
        bounds: Bounds = value.times(1 / self.size, self.unit)
        return bounds

    def of_print(self, trial: Trial) -> Bounds | None:
        """Value of the print of a trial; None where unknown."""
        return self.of(trial.printed, trial.toolpath)

    def uninformed(self, trial: Trial) -> float:
        """The error without any reading, length or load over sqrt(12) [unit of the name]; infinite of other numbers."""
        if self.field.startswith("position"):
            return GUESS * trial.length_m / self.size
        return GUESS * trial.force_n if self.field in ("force_resolution", "force_calibrated") else inf


NUMBERS = {
    "force_resolution_n": Number("force_resolution", "N"),
    "position_resolution_mm": Number("position_resolution", "mm", M_PER_MM),
    "force_calibrated_n": Number("force_calibrated", "N"),
    "position_calibrated_mm": Number("position_calibrated", "mm", M_PER_MM),
    "force_typical_n": Number("force_typical", "N", like="force_resolution"),
    "position_typical_mm": Number("position_typical", "mm", M_PER_MM, like="position_resolution"),
    "sensitivity_per_kpa": Number("sensitivity", "1/kPa"),
    "pressure_resolution_kpa": Number("pressure_resolution", "kPa"),
    "wires": Number("wires", ""),
    "capacitance_pf": Number("capacitance", "pF", 1e-12),
    "gap_mm": Number("gap", "mm", M_PER_MM),
    "top_electrode_ohm": Number("top_electrode", "ohm"),
    "bottom_electrode_ohm": Number("bottom_electrode", "ohm"),
    "print_time_min": Number("time_s", "min", 60.0, of_path=True),
    "exposure_mm": Number("exposure_mm", "mm", of_path=True),
}
_NOT_PREDICTED = {
    "hysteresis": "cannot be predicted: no material file has the viscoelastic data (loss factor or relaxation times) "
    "that a model of it needs; leave it out, and measure the printed designs (sensorgen bench hysteresis)"
}
OURS = ("plate bonded",)  # doubts that targets which sensorgen writes accept, of whatever shape
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Range(Strict):
    """Values from one to another: on the printable grid where no step is given."""

    first: Finite = Field(alias="from")
    to: Finite
    step: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        default=None, description="If not given, a layer for heights, half a line for widths."
    )

    @model_validator(mode="after")
    def _rises(self) -> "Range":
        if self.to < self.first:
            raise ValueError(f"from {self.first:g} to {self.to:g} is empty; expected numbers that rise")
        return self


class Near(Strict):
    """A value to come near; no number is negative."""

    near: Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Limit(Strict):
    """Range of a number, in the unit of its name."""

    least: Finite = -inf
    most: Finite = inf

    @model_validator(mode="after")
    def _holds_something(self) -> "Limit":
        if self.most < self.least:
            raise ValueError(f"least {self.least:g} and most {self.most:g} contradict each other")
        return self

    def beyond(self, value: float) -> float:
        """Distance of a value outside, relative to the limit [-]; 0 within."""
        over = max(self.least - value, value - self.most, 0.0)
        return over / (abs(self.least if value < self.least else self.most) or 1.0)


class Loading(Strict):
    """The load at which resolutions are stated, and the pressures of the sensitivity."""

    force_n: Annotated[float, Field(gt=0, allow_inf_nan=False)] = FORCE_N
    position_mm: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        default=None, description="The sensor's middle if not given [mm]."
    )
    tip_mm: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = Field(
        default=None, description="Of the tip along the sensor; the design's own if not given [mm]."
    )
    noise: Annotated[float, Field(gt=0, lt=1)] = NOISE
    frequency_hz: Annotated[tuple[float, ...], Field(min_length=1, strict=False)] | None = Field(
        default=None, description="Of a reading; those of predict if not given, 10 kHz of an array [Hz]."
    )
    pressures_kpa: Annotated[tuple[float, ...], Field(min_length=2, max_length=2, strict=False)] | None = Field(
        default=None, description="Of the sensitivity; from rest to the load if not given [kPa]."
    )


class Target(Strict):
    """Aim of a search, and the designs that it is among."""

    design: dict[str, Any] | str = Field(description="The design that is varied, as in a design file; or its file.")
    parameters: dict[str, Range | list[float | str]] = Field(
        min_length=1,
        description="Parameters of the shape, or keys of a design file as materials.film, to their values.",
    )
    objectives: dict[str, Literal["minimise", "maximise"] | Near] = Field(min_length=1)
    limits: dict[str, Limit] = Field(default={}, description="Of numbers, as printed.")
    refuse_warnings: tuple[str, ...] = Field(
        default=(), strict=False, description="Rules whose warnings are refused as errors are: 2-film."
    )
    accept_doubts: tuple[str, ...] = Field(
        default=(), strict=False, description="Parts of doubts that are accepted; a design with another one is out."
    )
    load: Loading = Loading()
    also: tuple[dict[str, float | str], ...] = Field(
        default=(), strict=False, description="Further designs: values in place of those of the varied design."
    )
    slicer: Literal["", "prusa", "cura"] = Field(
        default="", description="Slice every design that is evaluated; estimated if not given."
    )
    tolerance_mm: Annotated[float, Field(ge=0, le=1)] = Field(
        default=0.05, description="By which lengths in the plane may differ in print, for the recommended designs [mm]."
    )

    @model_validator(mode="after")
    def _makes_sense(self) -> "Target":
        for key in (*self.objectives, *self.limits):
            self._refuse_number(key)
        for name in self.refuse_warnings:
            if name not in RULES:
                raise ValueError(f"refuse_warnings: {UnknownName('rule', name, RULES)}")
        if empty := [key for key, values in self.parameters.items() if values == []]:
            raise ValueError(f"parameters.{empty[0]} is an empty list; expected at least one value")
        for key, goal in self.objectives.items():
            limit = self.limits.get(key, Limit())
            if isinstance(goal, Near) and limit.beyond(goal.near):
                raise ValueError(f"{key}: near {goal.near:g} contradicts its limit {limit.least:g} to {limit.most:g}")
        return self

    def _refuse_number(self, key: str) -> None:
        """Refuse a number that is not predicted, that does not exist, or that is known of G-code alone."""
        for word, reason in _NOT_PREDICTED.items():
            if key.startswith(word):
                raise ValueError(f"{key} {reason}")
        if key not in NUMBERS:
            raise ValueError(str(UnknownName("number", key, NUMBERS)))
        if NUMBERS[key].of_path and not self.slicer:
            raise ValueError(f"{key} is known of G-code alone: add slicer: prusa")

    def query(self) -> Query:
        """Question about every design."""
        load = self.load
        at = None if load.position_mm is None else load.position_mm * M_PER_MM
        pressures = None if load.pressures_kpa is None else (load.pressures_kpa[0], load.pressures_kpa[1])
        return Query(load.frequency_hz or DEFAULT.frequency_hz, load.force_n, at, noise=load.noise, range_kpa=pressures)

    def badness(self, key: str, value: Interval) -> Interval:
        """An objective's interval, the lower the better."""
        goal = self.objectives[key]
        if goal == "minimise":
            return value
        if goal == "maximise":
            return Interval(-value.upper, -value.lower)
        ends = [abs(end - goal.near) for end in (value.lower, value.upper)]
        inside = value.lower <= goal.near <= value.upper
        return Interval(0.0 if inside else min(ends), max(ends))

    def worth(self, key: str, value: float) -> float:
        """An objective's badness at one value."""
        return self.badness(key, Interval(value, value)).lower

    def violated(self, trial: Trial) -> dict[str, float]:
        """Constraints that a trial violates, and by how much, relative [-]."""
        beyond = {f"check {f.rule}": 1.0 for f in trial.findings if self.refuses(f.severity, f.rule)}
        if trial.status != "predicted":
            beyond[trial.status] = 1.0
        beyond |= {f"doubt: {doubt}": 1.0 for doubt in filterfalse(self.accepts, trial.doubts)}
        beyond |= {f"limit {key}": share for key in self.limits if (share := self._beyond_limit(key, trial))}
        if trial.status == "predicted":
            beyond |= {f"unknown {key}": 1.0 for key in self.objectives if NUMBERS[key].of_print(trial) is None}
        return beyond

    def _beyond_limit(self, key: str, trial: Trial) -> float:
        """Distance of a number beyond its limit, relative [-]; 1 of an unknown one."""
        value = NUMBERS[key].of_print(trial)
        return 1.0 if value is None else self.limits[key].beyond(value.value)

    def accepts(self, doubt: str) -> bool:
        """Test whether there is no doubt, or an accepted one."""
        return not doubt or any(part in doubt for part in self.accept_doubts)

    def refuses(self, severity: str, rule: str) -> bool:
        """Test whether a design with such a finding is out."""
        return severity == "error" or (severity == "warning" and rule in self.refuse_warnings)


def load(word: str | Path, tip: Mapping[str, Any] | None = None) -> Target:
    """Read a target; its design file is seen from its own folder.

    Parameters
    ----------
    word : str or Path
        Its file; or a shape or the file of a design, for designs like it with the best resolutions.
    tip : mapping, optional
        Keys of the design's tip, in place of the file's.

    Raises
    ------
    BadInput
        Not readable, not YAML, or not a target; the message names file and key.
    UnknownName
        Neither a file nor a shape.
    """
    target = _read(str(word))
    width = {} if target.load.tip_mm is None else {"width_mm": target.load.tip_mm}
    if not isinstance(target.design, dict) or not (width or tip):
        return target
    own = target.design.get("tip") or {}
    return target.model_copy(update={"design": target.design | {"tip": own | width | dict(tip or {})}})


def _read(word: str) -> Target:
    """The target of a shape, a design's file, or its own file."""
    path, names = Path(word), packs.names("shapes")
    if word in names:
        known = next((one.data() for one in best.of(word)), {})
        return around(make({"shape": word} | known))
    if not path.suffix and not path.exists():
        raise UnknownName("shape or file of a target", word, names)
    with within(word):
        data = yamlfile.read(path)
        if "shape" in data:
            return around(make({"name": path.stem} | data, word))
        target = checked(Target, data)
        if isinstance(target.design, str):
            file = path.parent / target.design
            data = with_own_files({k: v for k, v in yamlfile.read(file).items() if k != "name"}, file.parent)
            target = target.model_copy(update={"design": data})
    return target


def around(design: Design) -> Target:
    """The target of the nearest designs to one, and of the best known of its shape, with the best resolutions.

    One length changes at a time: heights by a layer, those of films and electrodes upwards alone, and lengths in the
    plane by a quarter.
    """
    several = list(lengths(design))
    own: dict[str, float | str] = {name: value for name, value, _ in several} | {"quality": design.quality}
    near: list[dict[str, float | str]] = [
        {name: to} for name, value, vertical in several for to in _beside(design, name, value, vertical)
    ]
    return checked(Target, {
        "design": design.model_dump(mode="json", exclude_unset=True, exclude={"name"}),
        "parameters": {key: [value] for key, value in own.items()}, "accept_doubts": OURS,
        "objectives": dict.fromkeys(("force_resolution_n", "position_resolution_mm"), "minimise"),
        "also": [{**own, **one} for one in near]
        + [{**own, **one.parameters, "quality": one.quality} for one in best.of(design.shape)],
    })  # fmt: skip


def _beside(design: Design, name: str, value: float, vertical: bool) -> list[float]:
    """The values next to a length's own."""
    if not vertical:
        return [round(share * value, 3) for share in (0.8, 1.25)]
    layer, grows = design.layers.layer_mm, name in asdict(Envelope()) or name.endswith("dielectric_mm")
    whole = max(round(value / layer), 1)
    return [round(n * layer, 6) for n in ((whole + 1,) if grows else (whole - 1, whole + 1)) if n]


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
        yield (
            chosen,
            {
                key: _values(key, given, with_own_files(_with(base, known, chosen), folder))
                for key, given in lengths_of_shape.items()
            },
        )
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
