"""The form for a plate's readings: written with comments, filled in with units, gaps allowed."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from sensorgen.analysis.characterise.catalogue import Coupon, CouponSize, Meters
from sensorgen.analysis.characterise.posterior import Observation
from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName
from sensorgen.core.records import shown
from sensorgen.core.units import FORCE_N, LENGTH_MM, M_PER_MM, NUMBER, Quantity
from sensorgen.models.coupons import secant_stiffening
from sensorgen.workflows.characterise.plate import COMBS, FILMS, STEP_MM, WALLS

LINES = "lines"
_HEAD = ("plate", "printer", "quality", "conductor", "dielectric", "tools", "meters", "coupons")
_UNITS = {
    "mm": LENGTH_MM,
    "n": FORCE_N,
    "ohm": Quantity("resistance", {u: Decimal(v) for u, v in
                                   (("ohm", "1"), ("kohm", "1e3"), ("Mohm", "1e6"), ("mohm", "1e-3"))}),
    "pf": Quantity("capacitance", {u: Decimal(v) for u, v in
                                   (("pF", "1"), ("fF", "1e-3"), ("nF", "1e3"), ("uF", "1e6"), ("F", "1e12"))}),
}  # fmt: skip
_PERCENT = {"resistance_percent": "resistance", "capacitance_percent": "capacitance", "force_percent": "force"}
_SIZES, _DEFECT = 3.0, 1e5  # by which a size, a reading of a dead coupon, may differ from what is expected


@dataclass(frozen=True)
class LineReadings:
    """Readings of the piece for lines and shorts; None where nothing was.

    Attributes
    ----------
    walls_mm : tuple
        Widths of the walls of 1, 2, 3 and 4 lines [mm].
    offsets_mm : tuple
        Of the dielectric's tool against the conductor's, along x and y [mm].
    films_short, combs_short : tuple
        Whether the film of 1, 2, ... layers, and the comb of 1, 2, ... lines, conducts.
    """

    walls_mm: tuple[float | None, ...]
    offsets_mm: tuple[float | None, ...]
    films_short: tuple[bool | None, ...]
    combs_short: tuple[bool | None, ...]


@dataclass(frozen=True)
class Form:
    """A form as read, before its names are looked up.

    Attributes
    ----------
    plate, printer, quality, conductor, dielectric : str
        As in the form's head.
    tools : mapping of str to int
        Material to tool, in the printer's own numbers.
    meters : Meters
        Of the lab.
    coupons : mapping
        Fields by coupon.
    """

    plate: str
    printer: str
    quality: str
    conductor: str
    dielectric: str
    tools: Mapping[str, int]
    meters: Meters
    coupons: Mapping[str, Mapping[str, Any]]


def blank(head: Mapping[str, str], coupons: Sequence[Coupon], expected: Mapping[str, Sequence[float]]) -> str:
    """The form of a plate, without readings.

    Parameters
    ----------
    head : mapping of str to str
        Values of plate, printer, quality, conductor, dielectric and tools.
    coupons : sequence of Coupon
        In the order of the plate.
    expected : mapping
        Readings that the materials' sources let expect, by coupon [ohm, F, N/m].
    """
    lines = [
        "# Readings of the plate. Leave ~ where nothing was measured; a coupon that is broken or leaks may stay in.",
        "# Numbers are in the unit at the end of a key, or have a unit of their own, as in 1.2 kohm.",
        "# plate.svg shows each coupon, its strips, films and pads by number, and where terminals are to be made.",
        *(f"{key}: {value}" for key, value in head.items()),
        "meters:  # standard deviations of one reading",
        "  resistance_percent: 1", "  capacitance_percent: 1", "  force_percent: 1",
        "  calipers_mm: 0.01", "  compression_mm: 0.002  # after the compliance of the stand is subtracted",
        "coupons:",
    ]  # fmt: skip
    for coupon in coupons:
        lines.append(f"  {coupon.name}:")
        lines += [f"    {s.key}: ~  # calipers, mean of three; drawn {s.drawn:g}" for s in coupon.sizes if s.measured]
        for reading, value in zip(coupon.readings, expected[coupon.name], strict=True):
            if reading.kind == "stiffness":
                lines.append(f"    {reading.key}_load_n: {reading.load_n:g}  # change it to the load that was used")
                lines.append(
                    f"    {reading.key}_mm: ~  # {reading.how}, under this load; expected about "
                    f"{_about(reading.load_n / value * 1e3)}"
                )
            else:
                scale = 1e12 if reading.kind == "capacitance" else 1.0
                lines.append(f"    {reading.key}: ~  # {reading.how}; expected about {_about(value * scale)}")
    lines.append(f"  {LINES}:")
    several = [(k, f"{k} line{'s' * (k > 1)}") for k in range(1, WALLS + 1)]
    lines += [f"    wall_{k}_mm: ~  # calipers, wall of {words}; 0 if it is not there" for k, words in several]
    for axis, way in (("x", "from left to right"), ("y", "from front to back")):
        lines.append(f"    vernier_{axis}: ~  # number of the pair of lines that meet, -5 to 5 {way}; 0 is the middle")
    films = range(1, FILMS + 1)
    lines += [
        f"    film_{k}_short: ~  # {k} layer{'s' * (k > 1)}: true or false; ohmmeter from strip to pad, below 1 Mohm"
        for k in films
    ]
    lines += [
        f"    comb_{k}_short: ~  # true or false: between the tracks {words} apart" for k, words in several[:COMBS]
    ]
    return "\n".join(lines) + "\n"


def _about(value: float) -> str:
    """Two digits, as people write them."""
    return f"{float(f'{value:.2g}'):.12g}"


def read(path: Path) -> Form:
    """Read a form.

    Raises
    ------
    BadInput
        Not readable, a key is missing or unknown, or a number makes no sense; the message names the key.
    """
    data = yamlfile.read(path)
    try:
        if strange := [key for key in data if key not in _HEAD]:
            raise UnknownName("key", strange[0], _HEAD)
        names = [data.get(key) for key in _HEAD[:5]]
        for key, value in zip(_HEAD, names, strict=False):
            if not isinstance(value, str) or not value:
                raise BadInput(f"{key} is {shown(value)}; expected its name, as the plate's form has it")
        coupons: Any = data.get("coupons")
        tools = data.get("tools") or {}
        if not _maps_to(coupons, Mapping):
            raise BadInput("coupons: expected each coupon's name with its readings, as the plate's form has them")
        if not _maps_to(tools, int) or bool in map(type, tools.values()):
            raise BadInput(f"tools is {shown(tools)}; expected each material's tool, as the plate's form has them")
        plate, printer, quality, conductor, dielectric = map(str, names)
        meters = _meters(data.get("meters") or {})
        return Form(plate, printer, quality, conductor, dielectric, tools, meters, coupons)
    except SensorgenError as error:
        raise error.within(str(path)) from None


def _maps_to(data: Any, kind: type) -> bool:
    return isinstance(data, Mapping) and all(isinstance(value, kind) for value in data.values())


def refuse_filled(path: Path) -> None:
    """Refuse to replace a form that somebody has filled in.

    Raises
    ------
    BadInput
        It has readings, or cannot be read, so that it may have some.
    """
    if not path.exists():
        return
    try:
        full = any(value is not None for fields in read(path).coupons.values() for value in fields.values())
    except SensorgenError:
        full = True
    if full:
        raise BadInput(f"{str(path)!r} has readings, or is damaged: move it away, or choose another plate's --name")


def _meters(given: object) -> Meters:
    if not isinstance(given, Mapping):
        raise BadInput(f"meters is {shown(given)}; expected a mapping of names to numbers")
    own: dict[str, float] = {}
    for key, value in given.items():
        if key not in (*_PERCENT, "calipers_mm", "compression_mm"):
            raise UnknownName("key of meters", key, (*_PERCENT, "calipers_mm", "compression_mm"))
        number = _number(f"meters.{key}", value)
        if number is None or not 1e-6 <= number <= 50:
            raise OutOfRange(f"meters.{key} is {shown(value)}; expected 1e-6 to 50")
        own[_PERCENT.get(str(key), str(key))] = number / 100 if key in _PERCENT else number
    return Meters(**own)


def _number(key: str, value: object) -> float | None:
    """A number in the unit of its key, 0 or more; None for a gap."""
    if value is None:
        return None
    if isinstance(value, str):
        quantity = _UNITS.get(key.rpartition("_")[2], NUMBER)
        try:
            value = quantity.read(value)
        except BadInput as error:
            raise error.within(key) from None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInput(f"{key} is {shown(value)}; expected a number, or ~ where nothing was measured")
    if value < 0:
        raise OutOfRange(f"{key} is {value:g}; expected a number above 0, or ~ where nothing was measured")
    return float(value)


def observations(form: Form, known: Sequence[Coupon], expected: Mapping[str, Sequence[float]]) -> list[Observation]:
    """Readings of all coupons in a form.

    Parameters
    ----------
    form : Form
        As read.
    known : sequence of Coupon
        All coupons that there are; copies have a letter after their name.
    expected : mapping
        Readings that the sources let expect, by coupon [ohm, F, N/m].

    Raises
    ------
    UnknownName
        No such coupon, or no such reading of it.
    BadInput, OutOfRange
        A value that is no number, negative, or so far from the expected one that its unit is wrong; no reading at all.
    """
    coupons = {coupon.name: coupon for coupon in known}
    observed = []
    for name, fields in form.coupons.items():
        if name == LINES:
            continue
        base = re.sub(r"-[b-d]$", "", name)
        if base not in coupons:
            raise UnknownName("coupon", name, [*coupons, LINES])
        observed.append(_observation(name, coupons[base], fields, form.meters, expected[base]))
    if not any(o.read.any() for o in observed):
        raise BadInput("no reading in the form: fill in the numbers in place of ~")
    return observed


def _observation(
    name: str, coupon: Coupon, fields: Mapping[str, Any], meters: Meters, expected: Sequence[float]
) -> Observation:
    keys = [size.key for size in coupon.sizes if size.measured]
    for reading in coupon.readings:
        keys += [f"{reading.key}_load_n", f"{reading.key}_mm"] if reading.kind == "stiffness" else [reading.key]
    for key in fields:
        if key not in keys:
            raise UnknownName(f"reading of {name}", key, keys)
    values = {key: _number(f"{name}.{key}", fields.get(key)) for key in keys}
    sizes = [_size(name, size, values, meters) if size.measured else size for size in coupon.sizes]
    logs, noise = [], []
    for reading, usual in zip(coupon.readings, expected, strict=True):
        value = _si(name, reading.key, reading.kind, values, sizes)
        if value is not None and not usual / _DEFECT <= value <= usual * _DEFECT:
            raise OutOfRange(
                f"{name}.{reading.key} is {fields.get(reading.key, fields.get(f'{reading.key}_mm'))}, more than "
                f"{_DEFECT:g} times off what the sources let expect: check its unit, or leave ~"
            )
        logs.append(math.log(value) if value else math.nan)
        load = values.get(f"{reading.key}_load_n") or reading.load_n
        noise.append(meters.noise(replace(reading, load_n=load), value or usual))
    return Observation(replace(coupon, name=name), tuple(sizes), np.array(logs), np.array(noise))


def _size(name: str, size: CouponSize, values: Mapping[str, float | None], meters: Meters) -> CouponSize:
    """A size as it was measured, or as drawn."""
    value = values[size.key]
    if value is None:
        return size
    if not size.drawn / _SIZES <= value <= size.drawn * _SIZES:
        raise OutOfRange(f"{name}.{size.key} is {value:g}, drawn {size.drawn:g} mm: check number and unit")
    return replace(size, drawn=value, spread=meters.calipers_mm)


def _si(
    name: str, key: str, kind: str, values: Mapping[str, float | None], sizes: Sequence[CouponSize]
) -> float | None:  # fmt: skip
    """A reading in SI units: ohm, F, or the small-strain stiffness [N/m]; None for a gap."""
    value = values[f"{key}_mm"] if kind == "stiffness" else values[key]
    if value is None:
        return None
    if value == 0:
        raise OutOfRange(f"{name}.{key} is 0; expected a number above 0, or ~ where nothing was measured")
    if kind != "stiffness":
        return value * (1e-12 if kind == "capacitance" else 1.0)
    load, height = values[f"{key}_load_n"], next(size.drawn for size in sizes if size.key == "height_mm")
    if not load:
        raise BadInput(f"{name}.{key}_load_n is missing; expected the load under which {key}_mm was read [N]")
    if value >= 0.5 * height:
        raise OutOfRange(f"{name}.{key}_mm is {value:g} of {height:g} mm; expected a compression below half the height")
    return load / (value * M_PER_MM) / float(secant_stiffening(value / height))


def _check_lines(fields: Mapping[str, Any], shorts: Sequence[str], verniers: Sequence[str]) -> None:
    """Refuse shorts that are neither true nor false, and numbers of lines that verniers do not have."""
    for key in shorts:
        if fields.get(key) not in (None, True, False):
            raise BadInput(f"{LINES}.{key} is {shown(fields[key])}; expected true, false or ~")
    for key in verniers:
        value = fields.get(key)
        if value is not None and (isinstance(value, bool) or value not in range(-5, 6)):
            raise OutOfRange(f"{LINES}.{key} is {shown(value)}; expected a whole number from -5 to 5, or ~")


def lines_of(form: Form) -> LineReadings:
    """Entries of the form for the piece for lines and shorts.

    Raises
    ------
    UnknownName, BadInput, OutOfRange
        As :func:`observations`.
    """
    fields = form.coupons.get(LINES, {})
    walls, films, combs = ([f"{kind}_{k}_{end}" for k in range(1, count + 1)] for kind, end, count in
                           (("wall", "mm", WALLS), ("film", "short", FILMS), ("comb", "short", COMBS)))  # fmt: skip
    verniers = ["vernier_x", "vernier_y"]
    if strange := [key for key in fields if key not in (*walls, *films, *combs, *verniers)]:
        raise UnknownName(f"reading of {LINES}", strange[0], (*walls, *verniers, *films, *combs))
    _check_lines(fields, (*films, *combs), verniers)
    return LineReadings(
        tuple(_number(f"{LINES}.{key}", fields.get(key)) for key in walls),
        tuple(None if fields.get(key) is None else STEP_MM * fields[key] for key in verniers),
        tuple(fields.get(key) for key in films), tuple(fields.get(key) for key in combs),
    )  # fmt: skip
