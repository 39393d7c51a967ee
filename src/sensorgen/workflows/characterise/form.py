"""The form for a plate's readings: written with comments, filled in with units, gaps allowed."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field

from sensorgen.analysis.characterise import Coupon, CouponReading, CouponSize, Meters
from sensorgen.analysis.characterise.posterior import Observation
from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName, within
from sensorgen.core.records import Strict, checked, shown
from sensorgen.core.units import FORCE_N, LENGTH_MM, M_PER_MM, NUMBER, Quantity
from sensorgen.models.coupons import secant_stiffening
from sensorgen.workflows.characterise.plate import COMBS, FILMS, STEP_MM, WALLS

LINES = "lines"
_UNITS = {
    "mm": LENGTH_MM,
    "n": FORCE_N,
    "ohm": Quantity("resistance", {u: Decimal(v) for u, v in
                                   (("ohm", "1"), ("kohm", "1e3"), ("Mohm", "1e6"), ("mohm", "1e-3"))}),
    "pf": Quantity("capacitance", {u: Decimal(v) for u, v in
                                   (("pF", "1"), ("fF", "1e-3"), ("nF", "1e3"), ("uF", "1e6"), ("F", "1e12"))}),
}  # fmt: skip
Name = Annotated[str, Field(min_length=1)]
_given = BeforeValidator(lambda value: {} if value is None else value)  # ~ is as good as an empty mapping
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


class Form(Strict):
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

    plate: Name
    printer: Name
    quality: Name
    conductor: Name
    dielectric: Name
    tools: Annotated[dict[str, int], _given] = Field(default={})
    meters: Annotated[Meters, _given] = Meters()
    coupons: dict[str, dict[str, Any]]


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
        "meters:  # standard deviations of one reading; of a compression, after the stand's compliance is subtracted",
        *(f"  {key}: {value:g}" for key, value in Meters().model_dump().items()),
        "coupons:",
    ]
    for coupon in coupons:
        lines += [f"  {coupon.name}:", *(f"    {field}" for field in _fields(coupon, expected[coupon.name]).values())]
    lines += [f"  {LINES}:", *(f"    {key}: ~  # {about}" for key, about in _line_fields().items())]
    return "\n".join(lines) + "\n"


def _fields(coupon: Coupon, expected: Sequence[float]) -> dict[str, str]:
    """Fields of a coupon by their keys: sizes, and readings beside what is expected of them."""
    fields = {s.key: f"~  # calipers, mean of three; drawn {s.drawn:g}" for s in coupon.sizes if s.measured}
    for reading, value in zip(coupon.readings, expected, strict=True):
        about = f"~  # {reading.how}"
        if reading.kind == "stiffness":
            fields[f"{reading.key}_load_n"] = f"{reading.load_n:g}  # change it to the load that was used"
            about, value = f"{about}, under this load", reading.load_n / value / M_PER_MM
        fields[reading.field] = f"{about}; expected about {float(f'{value / reading.unit:.2g}'):.12g}"
    return {key: f"{key}: {words}" for key, words in fields.items()}


def _line_fields() -> dict[str, str]:
    """Fields of the piece for lines and shorts, and what each is."""
    several = [(k, f"{k} line{'s' * (k > 1)}") for k in range(1, WALLS + 1)]
    fields = {f"wall_{k}_mm": f"calipers, wall of {words}; 0 if it is not there" for k, words in several}
    for axis, way in (("x", "from left to right"), ("y", "from front to back")):
        fields[f"vernier_{axis}"] = f"number of the pair of lines that meet, -5 to 5 {way}; 0 is the middle"
    for k in range(1, FILMS + 1):
        about = f"{k} layer{'s' * (k > 1)}: true or false; ohmmeter from strip to pad, below 1 Mohm"
        fields[f"film_{k}_short"] = about
    return fields | {
        f"comb_{k}_short": f"true or false: between the tracks {words} apart" for k, words in several[:COMBS]
    }


def read(path: Path) -> Form:
    """Read a form.

    Raises
    ------
    BadInput
        Not readable, a key is missing or unknown, or a number makes no sense; the message names the key.
    """
    data = yamlfile.read(path)
    with within(str(path)):
        return checked(Form, data)


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
        coupons = read(path).coupons.values()  # a blank form has loads
        full = any(v is not None for fields in coupons for key, v in fields.items() if not key.endswith("_load_n"))
    except SensorgenError:
        full = True
    if full:
        raise BadInput(f"{str(path)!r} has readings, or is damaged: move it away, or choose another plate's --name")


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
    keys = _fields(coupon, expected)
    _refuse_unknown(name, fields, keys)
    values = {key: _number(f"{name}.{key}", fields.get(key)) for key in keys}
    sizes = [_size(name, size, values, meters) if size.measured else size for size in coupon.sizes]
    logs, noise = [], []
    for reading, usual in zip(coupon.readings, expected, strict=True):
        value = _si(name, reading, values, sizes)
        if value is not None and not usual / _DEFECT <= value <= usual * _DEFECT:
            raise OutOfRange(
                f"{name}.{reading.key} is {fields[reading.field]}, more than "
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
    name: str, reading: CouponReading, values: Mapping[str, float | None], sizes: Sequence[CouponSize]
) -> float | None:  # fmt: skip
    """A reading in SI units: ohm, F, or the small-strain stiffness [N/m]; None for a gap."""
    value = values[reading.field]
    if value is None:
        return None
    if value == 0:
        raise OutOfRange(f"{name}.{reading.key} is 0; expected a number above 0, or ~ where nothing was measured")
    if reading.kind != "stiffness":
        return value * reading.unit
    load, height = values[f"{reading.key}_load_n"], next(size.drawn for size in sizes if size.key == "height_mm")
    if not load:
        raise BadInput(f"{name}.{reading.key}_load_n is missing; expected the load of {reading.field} [N]")
    if value >= 0.5 * height:
        raise OutOfRange(f"{name}.{reading.field} is {value:g} of {height:g} mm; expected less than half the height")
    return load / (value * M_PER_MM) / float(secant_stiffening(value / height))


def _refuse_unknown(name: str, fields: Mapping[str, Any], known: Mapping[str, str]) -> None:
    if strange := [key for key in fields if key not in known]:
        raise UnknownName(f"reading of {name}", strange[0], known)


def lines_of(form: Form) -> LineReadings:
    """Entries of the form for the piece for lines and shorts.

    Raises
    ------
    UnknownName, BadInput, OutOfRange
        As :func:`observations`.
    """
    given = form.coupons.get(LINES, {})
    _refuse_unknown(LINES, given, _line_fields())
    fields = {key: given.get(key) for key in _line_fields()}
    for key, value in fields.items():
        _refuse_entry(key, value)
    walls, offsets, films, combs = (
        {key: value for key, value in fields.items() if key.startswith(kind)}
        for kind in ("wall", "vernier", "film", "comb")
    )
    return LineReadings(
        tuple(_number(f"{LINES}.{key}", value) for key, value in walls.items()),
        tuple(None if value is None else STEP_MM * value for value in offsets.values()),
        tuple(films.values()), tuple(combs.values()),
    )  # fmt: skip


def _refuse_entry(key: str, value: Any) -> None:
    """Refuse what is no answer about a short, and no line of a vernier."""
    if key.endswith("short") and value not in (None, True, False):
        raise BadInput(f"{LINES}.{key} is {shown(value)}; expected true, false or ~")
    if key.startswith("vernier") and (isinstance(value, bool) or value not in (None, *range(-5, 6))):
        raise OutOfRange(f"{LINES}.{key} is {shown(value)}; expected a whole number from -5 to 5, or ~")
