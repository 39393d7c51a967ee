"""How tri gives way when held, touched or printed otherwise: four tables of docs/sensitivity.md, in some minutes.

Run with NGSolve installed: python bench/held.py
"""

from collections.abc import Iterator, Sequence

from sensorgen.asprinted.printed import body, gap_mm
from sensorgen.checks.estimate import RULES
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import Design, make
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions, Elastic
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import Tip
from sensorgen.prediction.sensor_model import build_sensor
from sensorgen.scene.scene import Body, Prism, Scene, rectangle

STRESS_PA = [0.0, 1e5]
RATIO = 0.4999  # of Poisson
FREE = BoundaryConditions(base="sliding", period="free")
OTHERWISE = {
    "faces that stick": BoundaryConditions(contact="stick"),
    "stiff tip": BoundaryConditions(top="rigid"),
    "base sliding": BoundaryConditions(base="sliding"),
    "base sliding, sides free": FREE,
}
EPS = {"x60": 4.68, "air": 1.00059}
LAYER_MM, PERIOD_MM = 0.1, 2.0
# Half widths of a staircase by layer, drawn 0 to 0.5 mm: as at the bottom, the middle and the top of each layer.
COGS = {
    "narrowest": (0.0, 0.1, 0.2, 0.3, 0.4),
    "middle": (0.05, 0.15, 0.25, 0.35, 0.45),
    "widest": (0.1, 0.2, 0.3, 0.4, 0.5),
}
LOWER = {"one": (0.3958,), "two": (0.375, 0.125)}  # of the film's own feet: those of 0.24 mm, or rounded to 0.2 mm


def solids(etpu_ratio: float = RATIO, x60_ratio: float = RATIO) -> dict[str, Elastic]:
    """X60 and PI-eTPU."""
    return {"x60": Elastic(6e6, x60_ratio), "etpu": Elastic(22e6, etpu_ratio)}


def tri(film_mm: float) -> Design:
    """A small tri, its materials' values as published."""
    size = {"length_mm": 12.0, "width_mm": 8.0}
    return make({"shape": "tri", "parameters": {"dielectric_mm": film_mm} | size})


def pressed_cell(
    scene: Scene, held: BoundaryConditions | None = None, etpu_ratio: float = RATIO, x60_ratio: float = RATIO
) -> press2d.Pressed:
    """A cell at up to 100 kPa."""
    return press2d.press(press2d.cell(scene, PERIOD_MM), solids(etpu_ratio, x60_ratio), STRESS_PA, EPS, held)


def answer(found: press2d.Pressed) -> tuple[float, float, float]:
    """Displacement [um], C at rest and at the last stress [pF per m and period]; none where it is not known."""
    ends = [c.middle() * PERIOD_MM * 1e9 if c else float("nan") for c in found.capacitance_f_per_m2]
    return float(found.displacement_m[-1]) * 1e6, ends[0], ends[-1]


def rise(found: press2d.Pressed) -> float:
    """Of C [-]."""
    _, before, after = answer(found)
    return after / before - 1


def print_held() -> None:
    """By how much the rise at 100 kPa differs."""
    print(row("d", *OTHERWISE, "eTPU with nu = 0.45"), row(*["---"] * (len(OTHERWISE) + 2)), sep="\n")
    for film in (0.1, 0.2):
        scene = tri(film).in_use
        plain = rise(pressed_cell(scene))
        others = [rise(pressed_cell(scene, held)) for held in OTHERWISE.values()]
        others.append(rise(pressed_cell(scene, etpu_ratio=0.45)))
        print(row(f"{film:g} mm", *(f"{100 * (other / plain - 1):+.1f} %" for other in others)), flush=True)


def print_printed() -> None:
    """What slicers should make of tri, pressed."""
    head = ("d", "walls", "gap [mm]", "fall [um]", "displacement after it [um]", "C at 0 [pF/m]", "C at 100 kPa [pF/m]")
    print(row(*head), row(*["---"] * len(head)), sep="\n")
    for film in (0.1, 0.2):
        for walls in RULES:
            design = tri(film)
            scene = body(design, walls=walls).cell.scene
            found = pressed_cell(scene)
            moved, before, after = answer(found)
            fall = found.fall_m * 1e6
            gap = gap_mm(scene)
            numbers = f"{gap:g}", f"{fall:.0f}", f"{moved - fall:.2f}", f"{before:.1f}", f"{after:.1f}"
            print(row(f"{film:g}", walls, *numbers), flush=True)


def staircase(cog: Sequence[float], lower: Sequence[float]) -> Scene:
    """A period of tri with a film of 0.1 mm in layers: half widths of the cog, and of the feet on the film."""

    def body(name: str, material: str, terminal: str, *boxes: tuple[float, float, float, float]) -> Body:
        return Body(name, material, tuple(Prism("y", rectangle(*box), 0.0, 10.0) for box in boxes), terminal)

    def bars(widths: Sequence[float], *places: float) -> list[tuple[float, float, float, float]]:
        spans = [(k, max(x - w, 0.0), min(x + w, PERIOD_MM)) for x in places for k, w in enumerate(widths) if w]
        return [(a, b, 0.4 + LAYER_MM * k, 0.4 + LAYER_MM * (k + 1)) for k, a, b in spans]

    bodies = (
        body("bottom_electrode", "etpu", "bottom", (0, PERIOD_MM, 0, 0.3)),
        body("film", "x60", "", (0, PERIOD_MM, 0.3, 0.4), *bars(lower, 0.5, 1.5)),
        body("hanging", "x60", "", *bars(COGS["middle"], 0.0, PERIOD_MM)),
        body("top_electrode", "etpu", "top", (0, PERIOD_MM, 0.9, 1.2), *bars(cog, 1.0)),
    )
    return Scene(bodies, (PERIOD_MM, 10.0, 1.2))


def print_staircases() -> None:
    """Readings of a staircase whose X60 feet all touch, the cog's with them or 0.2 mm short of the film."""
    head = ("cog", "half widths", "feet on the film", "held", "nu", "displacement [um]", "C at 0 [pF/m]",
            "C at 100 kPa [pF/m]", "rise")  # fmt: skip
    print(row(*head), row(*["---"] * len(head)), sep="\n")
    for touch, name, low, held, ratio in readings():
        cog = COGS[name] if touch == "touches" else (0.0, 0.0, *COGS[name][2:])
        choice = FREE if held == "free" else BoundaryConditions()
        moved, before, after = answer(pressed_cell(staircase(cog, LOWER[low]), choice, ratio, ratio))
        numbers = f"{moved:.1f}", f"{before:.1f}", f"{after:.1f}", f"{100 * (after / before - 1):.1f} %"
        print(row(touch, name, low, held, f"{ratio:g}", *numbers), flush=True)


def readings() -> Iterator[tuple[str, str, str, str, float]]:
    """Whether the cog touches, its widths, the film's feet, how the cell is held, and Poisson's ratio."""
    every = [("0.2 mm short", name, low) for name in COGS for low in LOWER]
    every += [("touches", name, low) for name in ("middle", "widest") for low in LOWER]
    nearest = [("0.2 mm short", "narrowest", "one"), ("touches", "widest", "one"), ("touches", "widest", "two")]
    yield from ((*reading, held, RATIO) for reading in every for held in ("bonded", "free"))
    yield from ((*reading, "bonded", ratio) for ratio in (0.49, 0.47, 0.45) for reading in nearest)


def print_tips() -> None:
    """How long round tips touch, the highest pressure under them, and what they change of X beside a flat one."""
    head = (
        "sensor",
        "profile",
        "radius [mm]",
        "contact at 1 N [mm]",
        "at 6 N [mm]",
        "highest at 6 N [kPa]",
        "change of X over a flat tip's",
    )
    print(row(*head), row(*["---"] * len(head)), sep="\n")
    for name, profile in (("reference", "hertz"), ("reference", "parabola"), ("tri", "parabola")):
        design = make({"shape": name, "parameters": {} if name == "reference" else {"dielectric_mm": 0.1}})
        for radius_mm in (5.0, 20.0, 100.0, 500.0):
            round_tip = build_sensor(drawn(design), tip=Tip(profile=profile, radius_m=radius_mm * 1e-3)).sensor
            flat = build_sensor(drawn(design)).sensor
            lengths = [f"{float(round_tip.contact_m(force)[0]) * 1e3:.2f}" for force in (1.0, 6.0)]
            highest = float(round_tip.stress_pa(6.0, 0.05))
            try:
                moved = [
                    s.impedance(1.1e3, 6.0, 0.05).imag / s.impedance(1.1e3, 0.0, 0.05).imag - 1
                    for s in (round_tip, flat)
                ]
                share = f"{moved[0] / moved[1]:.3f}"
            except OutOfRange:
                share = "beyond the law"
            print(row(name, profile, f"{radius_mm:g}", *lengths, f"{highest / 1e3:.0f}", share))


def row(*cells: str) -> str:
    """A row of a table."""
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    for table in (print_tips, print_held, print_printed, print_staircases):
        table()
        print()
