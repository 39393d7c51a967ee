"""What the planner expects of dear models: measured anew, and held against other scenes than those it was measured on.

Writes ``src/sensorgen/models/expected.yaml`` and ``results/expected.md``. ``--check`` leaves the first as it is. With
names of models only these are measured, and the others stay as they are.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import Design, make
from sensorgen.models import compression, press2d, press_round
from sensorgen.prediction import capacitance as expectations
from sensorgen.prediction import compression_law as celllaw
from sensorgen.prediction import mesh_ladder as pressing
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.verification.chart import scenes as standard

Real = NDArray[np.float64]
HERE = Path(__file__).parent
FILE = HERE.parent / "src" / "sensorgen" / "models" / expectations.FILE
EPS = {"x60": 4.68, "air": 1.00059}
PRESSED = {  # the first is timed
    "press2d": [("tri", 0.1), ("tri", 0.2)],
    "press3d": [("rect", 0.1)],
    "press_round": [("bump", 0.2), ("cone", 0.2), ("pyramid", 0.2)],
}
STRESS_PA = [1e4 * k for k in range(11)]
FINEST = 0.35  # size of triangles over the usual one, whose own error is a tenth of a per cent
BUDGET_S = 60.0  # a model is not asked for more where that would take longer


def shape(name: str, **parameters: float) -> Scene:
    return make({"shape": name, "parameters": parameters}).in_use


def stairs(steps: int) -> Scene:
    """A cog printed in layers, over a film."""
    width, rise = 0.5 / steps, 0.4 / steps
    cog = tuple(box(0, width * (k + 1), 0, 1, 0.5 + rise * k, 0.5 + rise * (k + 1)) for k in range(steps))
    bodies = (
        Body("low", "etpu", (box(0, 2, 0, 1, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(0, 2, 0, 1, 0.3, 0.4),)),
        Body("top", "etpu", (*cog, box(0, 2, 0, 1, 0.9, 1.2)), "top"),
    )
    return Scene(bodies, (2.0, 1.0, 1.2))


OTHERS = {
    "fem2d": {
        "tri, film 0.2 mm": shape("tri", dielectric_mm=0.2),
        "tri, film 1 um": shape("tri", dielectric_mm=0.001),
        "tri, film 1 nm": shape("tri", dielectric_mm=1e-6),
        "tri, steep": shape("tri", hang_height_mm=2.0, lower_height_mm=0.5),
        "tri, cut at 7.3 mm": shape("tri", length_mm=7.3),
        "stairs of 3": stairs(3),
        "stairs of 12": stairs(12),
        "stairs of 30": stairs(30),
    },
    "fem3d": {
        "rect, film 0.2 mm": shape("rect", dielectric_mm=0.2),
        "rect, film 0.01 mm": shape("rect", dielectric_mm=0.01),
        "rect, cut at 7 x 5 mm": shape("rect", length_mm=7.0, width_mm=5.0),
    },
}
OTHERS["prisms"] = OTHERS["fem3d"]
ACCURACIES = {"fem2d": (1e-3, 1e-6), "fem3d": (1e-2, 2e-3), "prisms": (1e-2, 3e-3)}
NAMED = [word for word in sys.argv[1:] if not word.startswith("--")]


def anew() -> Iterator[str]:
    """The file with points and parts as measured now, its comment and its choices as they are."""
    yield from (line for line in FILE.read_text("utf-8").splitlines() if line.startswith("#"))
    for model, entry in expectations.measured().items():
        name, film = entry.scene.removesuffix(" mm").split(", ")
        scene = shape(name, dielectric_mm=float(film))
        yield f"{model}:\n  scene: {entry.scene}\n  counted: {entry.counted}"
        yield f"  parts: {expectations.COUNTED[entry.counted](scene).parts}\n  power: {entry.power}"
        yield from (f"  loading: {entry.loading}",) if entry.loading else ()
        yield "  points:"
        if NAMED and model not in NAMED:
            found = iter(entry.points)
        else:
            found = pressed(model) if model in pressing.MODELS else bounded(model, entry.scene)
        yield from (f"    - [{width:.2g}, {float(f'{seconds:.2g}')}]" for width, seconds in found)


def bounded(model: str, scene: str) -> Iterator[tuple[float, float]]:
    """Widths of a model's bounds, each with its time."""
    standard.chart([scene], 0.0)  # what is done once, as imports
    for point in standard.chart([scene], BUDGET_S).points:
        if point.model == model:
            yield 2 * point.stated, point.warm_cpu_s


def pressed(model: str) -> Iterator[tuple[float, float]]:
    """How far the rise of C is off at most, mesh by mesh from the coarsest on, with the time of the first cell."""
    cases = [case(make({"shape": name, "parameters": {"dielectric_mm": film}})) for name, film in PRESSED[model]]
    truths = [truth(model, *pair) for pair in zip(cases, PRESSED[model], strict=True)]
    for level in range(pressing.COARSEST, pressing.COARSEST + len(expectations.measured()[model].points)):
        times, off = [], []
        for one, exact in zip(cases, truths, strict=True):
            start = time.process_time()
            found = pressing.pressed(one, STRESS_PA, level, keep=False)
            times.append(time.process_time() - start)
            off.append(np.abs(rises(found) / exact - 1).max())
        yield max(off), times[0]


def case(design: Design) -> pressing.Case:
    piece = pressing.drawn(design)
    return pressing.Case(
        piece, pressing.model_of(piece), celllaw.elastic(design, piece.scene), EPS, press2d.BoundaryConditions()
    )


def truth(model: str, one: pressing.Case, of: tuple[str, float]) -> Real:
    """The rise on the finest mesh that is affordable in the plane; of boxes, where their meshes lead."""
    if model == "press2d":
        cell = press2d.cell(one.piece.scene, one.piece.period_mm)
        return rises(press2d.press(cell, one.solids, STRESS_PA, EPS, one.boundary, press2d.Fineness().scaled(FINEST)))
    if model == "press_round":
        sizes = press_round.USUAL.scaled(FINEST)
        return rises(press_round.press(one.piece.scene, one.solids, STRESS_PA, EPS, one.boundary, sizes))
    shape, film = of
    parameters = vars(make({"shape": shape, "parameters": {"dielectric_mm": film}}).params)
    moduli = {name: solid.youngs_modulus_pa for name, solid in one.solids.items()}
    return np.asarray(compression.solved(shape, parameters, moduli).ratio[1:]) - 1


def rises(found: press2d.Pressed) -> Real:
    known = np.array([c.middle() for c in found.capacitance_f_per_m2])
    return known[1:] / known[0] - 1


def held_against_others() -> Iterator[str]:
    yield "| model | scene | asked | expected | reached | seconds expected | seconds | ratio |"
    yield "|---|---|---|---|---|---|---|---|"
    for model, scenes in OTHERS.items():
        if NAMED and model not in NAMED:
            continue
        module = import_module(f"sensorgen.models.{model}")
        for name, scene in scenes.items():
            for wanted in ACCURACIES[model]:
                width, seconds = expectations.expected(model, scene, wanted)
                start = time.process_time()
                try:
                    reached = f"{module.capacitance(scene, EPS, wanted).width():.2g}"
                except SensorgenError as error:
                    reached = type(error).__name__
                taken = time.process_time() - start
                within = f"within {wanted:g}" if width <= wanted else f"{width:.2g}"
                yield (
                    f"| {model} | {name} | {wanted:g} | {within} | {reached} | {seconds:.2g} | {taken:.2g} "
                    f"| {taken / seconds:.2g} |"
                )


def main() -> None:
    if "--check" not in sys.argv:
        FILE.write_text("\n".join(anew()) + "\n", "utf-8")
        expectations.measured.cache_clear()
    path = HERE / "results" / "expected.md"
    kept = path.read_text("utf-8").splitlines()[2:] if NAMED else []
    kept = [row for row in kept if row.split(" | ")[0].removeprefix("| ") not in NAMED]
    head, line, *rows = held_against_others()
    path.write_text("\n".join([head, line, *kept, *rows]) + "\n", "utf-8")


if __name__ == "__main__":
    main()
