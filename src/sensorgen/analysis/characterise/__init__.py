"""Coupons that can be printed, what is read on each, and the unknowns that the readings depend on.

A coupon's sizes are uncertain too: those that calipers measure by the calipers, the others by their own spread. An
error of the model, as the field at a rim, is such a size: a factor of 1 that is never measured.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import hypot, log, pi
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator, Field

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput
from sensorgen.core.records import Strict
from sensorgen.core.units import LENGTH_MM, M_PER_MM, NUMBER, Quantity
from sensorgen.design.materials import INTERFACE_GAP, Material
from sensorgen.models import coupons as closed
from sensorgen.prediction.inference import Parameter

LEVEL_SIGMA = 1.959964  # half of a 95 % interval in standard deviations
LADDER_MM = (3.0, 6.0, 12.0, 24.0)  # between neighbouring strips
STRIP_MM = 3.0  # each strip of the ladder, along the bar
PADS_MM = ((0.4, 0.4, 1.6), (0.4, 0.4, 0.4, 1.6, 1.6, 1.6), (0.4, 0.4, 0.4, 0.4, 2.4, 2.4))  # heights of pads
PAD_DIAMETER_MM, PAD_PITCH_MM, PADS_IN_ROW = 10.0, 13.0, 3
PLATE_RADIUS_MM, ELECTRODE_MM, UPPER_MM = 10.0, 0.4, 0.2  # of plates: radius, and thickness of both electrodes
PAD_MM = 8.0  # of the lower electrode, for a probe
_STRAIN = 0.04  # that the proposed load makes
_MOST_N = 100.0  # of a usual stand
_ROOM, _ROOM_OF_ONE = 1.5, 4.0  # beyond several sources' values, or a single one: sources differ up to twelvefold
_FRINGE = 0.97  # of the closed form of plates, whose film ends: 0.96 to 0.97 by finite volumes
_FILL = 0.015  # coupons of one plate differ in how well they are filled [-]
_TAPS_MM, _WIDTH_MM, _SENSOR_MM = 40.0, 6.0, 10.0  # between taps; width of ladders, and of bars, wide as sensors

Values = Mapping[str, Real]  # of unknowns in SI, or of sizes [mm]


@dataclass(frozen=True)
class CouponTarget:
    """A quantity that is wanted.

    Attributes
    ----------
    title, material, quantity : str
        For people; as a material's file has them.
    goal : float or None
        Half of the 95 % interval, relative to the value [-].
    value : callable
        From the unknowns.
    linear : bool
        It may be 0 or below.
    derived : bool
        From other targets: it does not count in the choice of coupons.
    """

    title: str
    material: str
    quantity: str
    goal: float | None
    value: Callable[[Values], Real]
    linear: bool = False
    derived: bool = False


@dataclass(frozen=True)
class CouponSize:
    """A size of a coupon [mm], or a factor of its model [-].

    Attributes
    ----------
    key : str
        As in the form, with its unit.
    drawn : float
        As drawn, or its most likely value.
    spread : float
        Standard deviation where it is not measured.
    measured : bool
        Whether calipers can measure it.
    """

    key: str
    drawn: float
    spread: float
    measured: bool = False


@dataclass(frozen=True)
class CouponReading:
    """Reading of a coupon.

    Attributes
    ----------
    key : str
        As in the form, with its unit.
    kind : str
        "resistance", "capacitance" or "stiffness".
    how : str
        Instrument and connection.
    load_n : float
        Under which compression is read; of stiffness alone [N].
    """

    key: str
    kind: str
    how: str
    load_n: float = 0.0

    @property
    def field(self) -> str:
        """Key of its number in a form: of a stiffness, the compression."""
        return f"{self.key}_mm" if self.kind == "stiffness" else self.key

    @property
    def unit(self) -> float:
        """Unit of that number over ohm or F [-]."""
        return 1e-12 if self.kind == "capacitance" else 1.0


@dataclass(frozen=True)
class Coupon:
    """A test structure.

    Attributes
    ----------
    name, kind : str
        Name on plate and form; "bar", "ladder", "plate", "disc" or "pads".
    material : str
        What it is made of; of a plate the film's.
    sizes : tuple of CouponSize
        Drawn ones, those that calipers measure first.
    readings : tuple of CouponReading
        In the order of ``expected``.
    expected : callable
        Readings from unknowns and sizes [ohm, F, N/m].
    volume_mm3, box_mm : float, (float, float)
        Printed, and the room that it takes on the plate.
    degrees : float or None
        Between its longer side and the printed lines, which run along x; None where the profile decides.
    """

    name: str
    kind: str
    material: str
    sizes: tuple[CouponSize, ...]
    readings: tuple[CouponReading, ...]
    expected: Callable[[Values, Values], tuple[Real, ...]]
    volume_mm3: float
    box_mm: tuple[float, float]
    degrees: float | None = None

    def drawn(self, key: str) -> float:
        """One of its sizes as drawn [mm]."""
        return next(size.drawn for size in self.sizes if size.key == key)


def _in(quantity: Quantity) -> BeforeValidator:
    """Validator of a number that may be typed with its unit."""

    def read(value: object) -> object:
        try:
            return quantity.read(value) if isinstance(value, str) else value
        except BadInput as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(read)


Percent = Annotated[float, _in(NUMBER), Field(ge=1e-6, le=50)]
Length = Annotated[float, _in(LENGTH_MM), Field(ge=1e-6, le=50)]


class Meters(Strict):
    """Standard deviations of the instruments: relative [%], or absolute [mm]."""

    resistance_percent: Percent = 1.0
    capacitance_percent: Percent = 1.0
    force_percent: Percent = 1.0
    calipers_mm: Length = 0.01
    compression_mm: Length = 0.002

    def noise(self, reading: CouponReading, stiffness_n_per_m: float = 0.0) -> float:
        """Standard deviation of a reading's logarithm."""
        if reading.kind != "stiffness":
            return (self.resistance_percent if reading.kind == "resistance" else self.capacitance_percent) / 100
        return hypot(self.force_percent / 100, self.compression_mm * M_PER_MM * stiffness_n_per_m / reading.load_n)


def _range(material: Material, quantity: str, low: float, high: float) -> tuple[float, float]:
    """Mean and standard deviation of ln: all plausible sources within one, or a usual range where there is none."""
    values = [v for v in material.properties.get(quantity, []) if not v.implausible]
    given = [number for v in values for number in (v.value, v.low, v.high) if number is not None and number > 0]
    if given:
        room = _ROOM if max(given) > min(given) else _ROOM_OF_ONE
        low, high = min(given) / room, max(given) * room
    return (log(low) + log(high)) / 2, (log(high) - log(low)) / 2


def unknowns(conductor: Material, dielectric: Material, line_mm: float) -> tuple[Parameter, ...]:
    """All unknowns of a pair of materials, with what their sources say.

    Parameters
    ----------
    conductor, dielectric : Material
        As printed by the two tools.
    line_mm : float
        Distance of neighbouring lines [mm].
    """
    along = _range(conductor, "resistivity_ohm_m", 1e-3, 10.0)
    return (
        Parameter("along_ohm_m", *along),
        Parameter("line_contact_ohm_m2", along[0] + log(line_mm * M_PER_MM), 2.0),
        Parameter("crossed", 0.4, 0.3, linear=True),  # share of the way from along to across of a print's own lines
        Parameter("through_ohm_m", along[0] + log(2.0), 1.0),
        Parameter("terminal_ohm_m2", log(1e-4), 2.0),
        Parameter("permittivity", *_range(dielectric, "relative_permittivity", 2.0, 12.0)),
        Parameter("gap_m", 0.0, 3e-5, linear=True),
        Parameter("conductor_pa", *_range(conductor, "youngs_modulus_pa", 1e6, 1e8)),
        Parameter("dielectric_pa", *_range(dielectric, "youngs_modulus_pa", 5e5, 5e7)),
        Parameter("conductor_1_2nu", log(0.01), 1.5),
        Parameter("dielectric_1_2nu", log(0.01), 1.5),
        Parameter("friction", 0.05, 0.04, linear=True),  # coefficient of lubricated plates
    )


def across_ohm_m(values: Values, line_m: float) -> Real:
    """Resistivity across the lines: along them, and a contact at every line [ohm m]."""
    return values["along_ohm_m"] + values["line_contact_ohm_m2"] / line_m


def _crossed_ohm_m(values: Values, line_m: float) -> Real:
    along = values["along_ohm_m"]
    return along + values["crossed"] * (across_ohm_m(values, line_m) - along)


def targets(conductor: str, dielectric: str, line_mm: float) -> tuple[CouponTarget, ...]:
    """Quantities wanted of a pair of materials, by their names."""
    line_m = line_mm * M_PER_MM

    def of(key: str) -> Callable[[Values], Real]:
        return lambda values: values[key]

    return (
        CouponTarget("resistivity, lines as the profile lays them", conductor, "resistivity_ohm_m", 0.05,
                     lambda values: _crossed_ohm_m(values, line_m)),
        CouponTarget("resistivity along the lines", conductor, "resistivity_along_ohm_m", 0.05, of("along_ohm_m")),
        CouponTarget("resistivity across the lines", conductor, "resistivity_across_ohm_m", 0.05,
                     lambda values: across_ohm_m(values, line_m), derived=True),
        CouponTarget("contact between lines", conductor, "line_contact_ohm_m2", 0.1, of("line_contact_ohm_m2")),
        CouponTarget("resistivity through the layers", conductor, "resistivity_through_ohm_m", 0.05,
                     of("through_ohm_m")),
        CouponTarget("contact to terminals", conductor, "terminal_contact_ohm_m2", 0.1, of("terminal_ohm_m2")),
        CouponTarget("permittivity", dielectric, "relative_permittivity", 0.03, of("permittivity")),
        CouponTarget("interface gap", dielectric, INTERFACE_GAP, None, of("gap_m"), linear=True),
        CouponTarget("Young's modulus", conductor, "youngs_modulus_pa", 0.1, of("conductor_pa")),
        CouponTarget("Young's modulus", dielectric, "youngs_modulus_pa", 0.1, of("dielectric_pa")),
    )  # fmt: skip


def catalogue(conductor: Material, dielectric: Material, line_mm: float) -> tuple[Coupon, ...]:
    """All coupons that a plate may have.

    Parameters
    ----------
    conductor, dielectric : Material
        What the two tools print.
    line_mm : float
        Distance of neighbouring lines [mm].
    """
    line_m = line_mm * M_PER_MM
    bars = [
        _bar(conductor.name, degrees, height, line_m)
        for degrees, heights in ((0.0, (0.8, 1.6)), (45.0, (0.8, 1.6)), (90.0, (0.8, 1.6)), (None, (0.4, 0.8, 1.2)))
        for height in heights
    ]
    ladders = [_ladder(conductor.name, degrees, height, line_m) for degrees in (0.0, None) for height in (0.4, 0.8)]
    steps = ((0.4,), (2.8,), (0.4, 1.2), (0.4, 2.0), (0.4, 2.8), (0.8, 2.8), (1.2, 2.8))
    plates = [_plate(dielectric.name, heights) for heights in steps]
    shapes = ((8.0, 6.0), (8.0, 4.0), (10.0, 5.0), (10.0, 3.0), (12.0, 2.0))
    discs = [_disc(dielectric, "dielectric", *shape) for shape in shapes]
    discs += [_disc(conductor, "conductor", *shape) for shape in shapes]
    pads = [_pads(conductor.name, *heights) for heights in PADS_MM]
    return (*bars, *ladders, *plates, *discs, *pads)


def _millimetres(key: str, drawn: float) -> CouponSize:
    """A size that calipers measure; else it is known as well as prints are."""
    return CouponSize(key, drawn, hypot(0.05, 0.03 * drawn), measured=True)


def _bar(material: str, degrees: float | None, height: float, line_m: float) -> Coupon:
    length, width = _TAPS_MM, _SENSOR_MM

    def expected(values: Values, sizes: Values) -> tuple[Real, ...]:
        along = values["along_ohm_m"] if degrees is not None else _crossed_ohm_m(values, line_m)
        across = across_ohm_m(values, line_m) if degrees is not None else along
        of = [sizes[key] * M_PER_MM for key in ("taps_mm", "width_mm", "height_mm")]
        if degrees == 90:
            across = closed.to_and_fro_resistivity(along, across, line_m, of[1])
        return (
            closed.bar_resistance(along, across, degrees or 0.0, of[0], of[1], of[2]) * sizes["fill"] * sizes["edge"],
        )

    name = f"bar-{'print' if degrees is None else f'{degrees:g}'}-{height:g}"
    turned = {45.0: (54.0, 54.0), 90.0: (width + 4.0, 60.0)}.get(degrees or 0.0, (60.0, width + 4.0))
    return Coupon(
        name, "bar", material,
        (_millimetres("width_mm", width), _millimetres("height_mm", height), CouponSize("taps_mm", length, 0.2),
         CouponSize("edge", 1.0, 0.012 if degrees else 0.005),
         CouponSize("fill", 1.0, _FILL)),
        (CouponReading("resistance_ohm", "resistance", f"four-wire, between the side taps {length:g} mm apart, DC"),),
        expected, 60 * width * height + 16 * height, turned, degrees,
    )  # fmt: skip


def _ladder(material: str, degrees: float | None, height: float, line_m: float) -> Coupon:
    width = _SENSOR_MM if degrees is None else _WIDTH_MM
    length = sum(LADDER_MM) + STRIP_MM * (len(LADDER_MM) + 1)

    def expected(values: Values, sizes: Values) -> tuple[Real, ...]:
        w, h = sizes["width_mm"] * M_PER_MM, sizes["height_mm"] * M_PER_MM
        along = values["along_ohm_m"] if degrees is not None else _crossed_ohm_m(values, line_m)
        strip, spreading = STRIP_MM * M_PER_MM, sizes["spreading"]
        through, terminal_ohm_m2 = values["through_ohm_m"], values["terminal_ohm_m2"]
        ends = [
            closed.ladder_contact(along, through, terminal_ohm_m2 * sizes[f"strip_{k + 1}"], strip, w, h, spreading)
            for k in range(len(LADDER_MM) + 1)
        ]
        return tuple(
            closed.bar_resistance(along, along, 0.0, sizes[f"between_{k + 1}_mm"] * M_PER_MM, w, h) * sizes["fill"]
            + ends[k] + ends[k + 1]
            for k in range(len(LADDER_MM))
        )  # fmt: skip

    strips = tuple(CouponSize(f"strip_{k + 1}", 1.0, 0.05) for k in range(len(LADDER_MM) + 1))
    between = tuple(CouponSize(f"between_{k + 1}_mm", gap, 0.1) for k, gap in enumerate(LADDER_MM))
    return Coupon(
        f"ladder-{'print' if degrees is None else '0'}-{height:g}", "ladder", material,
        (_millimetres("width_mm", width), _millimetres("height_mm", height), CouponSize("fill", 1.0, _FILL),
         CouponSize("spreading", 0.8, 0.1), *between, *strips),
        tuple(
            CouponReading(f"strips_{k + 1}_{k + 2}_ohm", "resistance",
                          f"two-wire, strips {k + 1} and {k + 2}, {gap:g} mm of bar between them, DC")
            for k, gap in enumerate(LADDER_MM)
        ),
        expected, length * width * height, (length, width), degrees,
    )  # fmt: skip


def film_radius_mm(thickness_mm: float) -> float:
    """Radius of a plate's film, which reaches beyond the upper electrode as far as the field [mm]."""
    return PLATE_RADIUS_MM + 3.0 + max(0.0, thickness_mm - 0.8)


def _plate(material: str, thicknesses_mm: tuple[float, ...]) -> Coupon:
    """Round plates side by side on one lower electrode, each on a film of its own."""

    def expected(values: Values, sizes: Values) -> tuple[Real, ...]:
        return tuple(
            closed.plate_capacitance(
                values["permittivity"], values["gap_m"],
                (sizes[f"film_{k}_on_electrode_mm"] - sizes["electrode_mm"]) * M_PER_MM,
                sizes[f"top_{k}_diameter_mm"] * M_PER_MM / 2, UPPER_MM * M_PER_MM, sizes["fringe"],
            ) / sizes["fill"] + sizes["stray_pf"] * 1e-12
            for k, _ in enumerate(thicknesses_mm, 1)
        )  # fmt: skip

    rims = [film_radius_mm(thickness) for thickness in thicknesses_mm]
    measured = [
        size for k, thickness in enumerate(thicknesses_mm, 1) for size in (
            _millimetres(f"top_{k}_diameter_mm", 2 * PLATE_RADIUS_MM),
            _millimetres(f"film_{k}_on_electrode_mm", ELECTRODE_MM + thickness),
        )
    ]  # fmt: skip
    volumes = [
        pi * rim**2 * (ELECTRODE_MM + thickness) + pi * PLATE_RADIUS_MM**2 * UPPER_MM
        for rim, thickness in zip(rims, thicknesses_mm, strict=True)
    ]
    return Coupon(
        "plate-" + "-".join(f"{thickness:g}" for thickness in thicknesses_mm), "plate", material,
        (*measured, _millimetres("electrode_mm", ELECTRODE_MM), CouponSize("fringe", _FRINGE, 0.03),
         CouponSize("fill", 1.0, 0.005), CouponSize("stray_pf", 0.0, 0.02)),
        tuple(
            CouponReading(f"capacitance_{k}_pf", "capacitance", "LCR meter, 1 kHz, open circuit subtracted; probes on "
                          f"the pad and on the upper disc of the film of {thickness:g} mm")
            for k, thickness in enumerate(thicknesses_mm, 1)
        ),
        expected, sum(volumes) + PAD_MM**2 * ELECTRODE_MM, (2 * sum(rims) + PAD_MM, 2 * max(rims)),
    )  # fmt: skip


def _disc(material: Material, role: str, diameter: float, height: float) -> Coupon:
    conducts = role == "conductor"

    def expected(values: Values, sizes: Values) -> tuple[Real, ...]:
        a, h = sizes["diameter_mm"] * M_PER_MM / 2, sizes["height_mm"] * M_PER_MM
        e, area = values[f"{role}_pa"], pi * a**2 / h * sizes["fill"]
        pressed = (
            closed.sliding_modulus(e, values["friction"], 2 * a, h) * area,
            closed.bonded_modulus(e, values[f"{role}_1_2nu"], a, h) * area * sizes["bonded"],
        )
        if not conducts:
            return pressed
        ends = values["terminal_ohm_m2"] * (sizes["lower_face"] + sizes["upper_face"])
        through = (values["through_ohm_m"] * h + ends) / (pi * a**2 * sizes["fill"])
        return through, *pressed

    centre, _ = _range(material, "youngs_modulus_pa", 1e6, 1e8)
    a, h = diameter / 2 * M_PER_MM, height * M_PER_MM
    usual = (np.exp(centre), float(closed.bonded_modulus(np.exp(centre), 0.01, a, h)))
    loads = [min(_MOST_N, float(f"{_STRAIN * pi * a**2 * modulus:.2g}")) for modulus in usual]
    presses = (
        CouponReading("sliding", "stiffness", "compression between lubricated plates", loads[0]),
        CouponReading("bonded", "stiffness", "compression between plates that it is glued to", loads[1]),
    )
    through = CouponReading("through_ohm", "resistance", "two-wire, terminals over both faces, DC")
    return Coupon(
        f"disc-{material.name}-{diameter:g}x{height:g}", "disc", material.name,
        (_millimetres("diameter_mm", diameter), _millimetres("height_mm", height), CouponSize("fill", 1.0, _FILL),
         CouponSize("bonded", 1.0, 0.05), CouponSize("lower_face", 1.0, 0.05), CouponSize("upper_face", 1.0, 0.05)),
        (*([through] if conducts else []), *presses),
        expected, pi * diameter**2 / 4 * height, (diameter, diameter),
    )  # fmt: skip


def _pads(material: str, *heights: float) -> Coupon:
    """Round pads of several heights between terminals over both faces: a ladder through the layers."""
    count = len(heights)

    def expected(values: Values, sizes: Values) -> tuple[Real, ...]:
        return tuple(
            (values["through_ohm_m"] * sizes[f"height_{k}_mm"] * M_PER_MM + values["terminal_ohm_m2"] * (
                sizes[f"lower_face_{k}"] + sizes[f"upper_face_{k}"]))
            / (pi * (sizes[f"diameter_{k}_mm"] * M_PER_MM / 2) ** 2 * sizes["fill"])
            for k in range(1, count + 1)
        )  # fmt: skip

    measured = [
        size for k, height in enumerate(heights, 1) for size in (
            _millimetres(f"diameter_{k}_mm", PAD_DIAMETER_MM), _millimetres(f"height_{k}_mm", height),
        )
    ]  # fmt: skip
    faces = [CouponSize(f"{face}_face_{k}", 1.0, 0.05) for k in range(1, count + 1) for face in ("lower", "upper")]
    columns, rows = min(count, PADS_IN_ROW), -(-count // PADS_IN_ROW)
    return Coupon(
        "pads-" + "-".join(f"{count}x{height:g}" for height, count in Counter(heights).items()), "pads", material,
        (*measured, CouponSize("fill", 1.0, _FILL), *faces),
        tuple(
            CouponReading(f"through_{k}_ohm", "resistance", f"pad of {height:g} mm between terminals over both faces, "
                          "two leads to each, DC")
            for k, height in enumerate(heights, 1)
        ),
        expected, sum(pi * PAD_DIAMETER_MM**2 / 4 * height for height in heights),
        (PAD_PITCH_MM * (columns - 1) + PAD_DIAMETER_MM, PAD_PITCH_MM * (rows - 1) + PAD_DIAMETER_MM),
    )  # fmt: skip


def nominal(coupon: Coupon, meters: Meters) -> tuple[CouponSize, ...]:
    """Sizes as drawn, with the spread that calipers leave."""
    return tuple(replace(size, spread=meters.calipers_mm) if size.measured else size for size in coupon.sizes)
