"""What bounds in three dimensions cost: processor time and memory over unknowns, rect with a film of 0.1 mm.

Also of sensors that end within a cell. Each mesh is solved in a process of its own, so that its peak of memory is its
own. Writes ``results/fem3d.md`` and ``docs/pictures/cells-cost.png``. Takes five minutes.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sensorgen.scene.scene import Scene

HERE = Path(__file__).parent
MESHES = ((1, 2), (1, 3), (1, 4), (1, 5), (1, 6), (1, 7), (2, 5), (2, 6), (3, 5), (3, 6))  # layers, order
ENDS = ((99.0, 1e-2), (100.0, 1e-2), (99.0, 1e-3), (100.0, 1e-3), (99.0, 3e-4), (100.0, 3e-4))  # length [mm], accuracy
FEET = (  # x, y, length and width [mm]
    (3.9, 2.3, 0.71, 0.57), (0.45, 1.2, 0.65, 0.43), (0.42, 2.8, 0.79, 0.54), (2.2, 2.73, 0.94, 0.91),
    (2.01, 1.48, 0.81, 0.44), (2.76, 0.91, 0.93, 0.44), (4.21, 0.25, 0.82, 0.4), (3.91, 1.02, 0.49, 0.82),
    (0.69, 2.0, 0.78, 0.63), (4.76, 2.08, 0.89, 0.49), (3.41, 0.21, 0.42, 0.49), (1.18, 0.73, 0.43, 0.53),
    (0.2, 0.36, 0.53, 0.65), (4.8, 2.68, 0.81, 0.52),
)  # fmt: skip
ORDERS = {5: ":", 6: "--"}  # on three meshes each
MEGABYTE = 1024  # in kilobytes, as the system counts them


def solved(layers: float, order: float) -> dict[str, float]:
    """One mesh, and what it took."""
    from sensorgen.models import fem3d

    layers, order = int(layers), int(order)
    fem3d.MESHES = (fem3d.BoxMeshLevel(layers, order, order - 1, 0.0),)
    return asked(2.0, 2.0, 1e-9) | {"layers": layers, "order": order}


def cut(length_mm: float, accuracy: float, largest: float) -> dict[str, float]:
    """A sensor of period 2.2 mm, its cell at most so many times the smallest one."""
    from sensorgen.scene import repetition as raster

    raster.LARGER = largest
    return asked(length_mm, 10.0, accuracy, x60_width_mm=0.9)


def feet(many: float) -> dict[str, float]:
    """14 feet of an electrode over a film, nowhere symmetric, to 3e-3; from ``many`` bricks on without layers."""
    from sensorgen.models import fem3d
    from sensorgen.scene.scene import Body, Scene, box

    fem3d._MANY_BRICKS = many
    boxes = tuple(box(x, x + a, y, y + b, 0.7, 0.9) for x, y, a, b in FEET)
    bodies = (
        Body("low", "etpu", (box(0, 6, 0, 4, 0, 0.3),), "bottom"), Body("film", "x60", (box(0, 6, 0, 4, 0.3, 0.5),)),
        Body("feet", "etpu", boxes, "top"), Body("high", "etpu", (box(0, 6, 0, 4, 0.9, 1.2),), "top"),
    )  # fmt: skip
    return of_scene(Scene(bodies, (6.0, 4.0, 1.2)), 3e-3)


def asked(length_mm: float, width_mm: float, accuracy: float, **sizes: float) -> dict[str, float]:
    """A sensor, and what its capacitance took."""
    from sensorgen.design.shapes import rect
    from sensorgen.scene.scene import Fill

    sizes = {"length_mm": length_mm, "width_mm": width_mm, "dielectric_mm": 0.1, **sizes}
    return of_scene(rect.scene(rect.Params(**sizes), Fill()), accuracy)


def of_scene(scene: "Scene", accuracy: float) -> dict[str, float]:
    """A scene, and what its capacitance took."""
    from sensorgen.models import fem3d

    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    *_, step = fem3d.steps(scene, {"x60": 4.68, "air": 1.00059}, accuracy)
    seconds, after = time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "elements": step.elements,
        "unknowns": step.unknowns,
        "seconds": seconds,
        "megabytes": (after - before) / MEGABYTE,
        "width": step.interval.width(),
    }


def apart(*arguments: float) -> dict[str, float]:
    """The same in a process of its own."""
    command = [sys.executable, __file__, *map(str, arguments)]
    said = subprocess.run(
        command, check=True, capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    )
    found: dict[str, float] = json.loads(said.stdout)
    return found


def exponent(found: list[dict[str, float]], key: str, order: int) -> float:
    """With which power of the unknowns a cost grows on meshes of one order."""
    import numpy as np

    here = [f for f in found if f["order"] == order]
    return float(np.polyfit(np.log([f["unknowns"] for f in here]), np.log([f[key] for f in here]), 1)[0])


def picture(found: list[dict[str, float]]) -> None:
    """Draw both costs and the width over the unknowns."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    labels = {"seconds": "processor time [s]", "megabytes": "memory [MB]", "width": "width of the interval [-]"}
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    for axis, (key, label) in zip(axes, labels.items(), strict=True):
        for layers, colour in ((1, "#d55e00"), (2, "#009e73"), (3, "#0072b2")):
            here = [f for f in found if f["layers"] == layers]
            orders = f"order {here[0]['order']} to {here[-1]['order']}"
            said = f"{layers} layer{'s' * (layers > 1)} at edges, {orders}"
            axis.loglog([f["unknowns"] for f in here], [f[key] for f in here], "o-", ms=4, color=colour, label=said)
        axis.set(xlabel="unknowns N that boxes share [-]", ylabel=label)
        axis.grid(alpha=0.3)
    for axis, key in zip(axes, ("seconds", "megabytes"), strict=False):
        for order, style in ORDERS.items():
            here = [f for f in found if f["order"] == order]
            power = exponent(found, key, order)
            start = here[0]
            line = [start[key] * (f["unknowns"] / start["unknowns"]) ** power for f in here]
            axis.loglog([f["unknowns"] for f in here], line, style, color="k", label=f"order {order}: N^{power:.2f}")
    axes[0].legend(frameon=False, fontsize=8)
    axes[1].legend(frameon=False, fontsize=8)
    figure.savefig(HERE.parent / "docs" / "pictures" / "cells-cost.png", dpi=130)


def ends() -> Iterator[tuple[float, float, str, dict[str, float]]]:
    """What sensors that end within a cell take."""
    yield 100.0, 1e-2, "half the sensor", apart(100.0, 1e-2, 1e9)
    for length_mm, accuracy in ENDS:
        yield length_mm, accuracy, "half a period", apart(length_mm, accuracy, 2)


def main() -> None:
    found = sorted((apart(*mesh) for mesh in MESHES), key=lambda f: f["unknowns"])
    picture(found)
    powers = [(exponent(found, "seconds", k), exponent(found, "megabytes", k), k) for k in ORDERS]
    lines = [
        "# What bounds in three dimensions cost",
        "",
        "Made by `bench/fem3d.py`: rect, d = 0.1 mm, one thread.",
        "",
        "| layers | order | unknowns | processor time [s] | memory [MB] | width |",
        "|---|---|---|---|---|---|",
        *(
            f"| {f['layers']} | {f['order']} | {f['unknowns']} | {f['seconds']:.3g} | {f['megabytes']:.0f} "
            f"| {f['width']:.1e} |"
            for f in found
        ),
        "",
        *(
            f"Order {k}: time grows as N to the {seconds:.2f}, memory as N to the {size:.2f}."
            for seconds, size, k in powers
        ),
        "",
        "## Sensors that end within a cell",
        "",
        "rect of period 2.2 mm, d = 0.1 mm, 10 mm wide: the width ends within a cell, and so do 100 mm. With half the",
        "sensor as cell, which fits 100 mm a whole number of times, 1e-3 was not reached in 225 s and 7.7 GB.",
        "",
        "| length [mm] | accuracy | cell | boxes | processor time [s] | memory [MB] | width |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {length:g} | {accuracy:g} | {cell} | {f['elements']} | {f['seconds']:.3g} | {f['megabytes']:.0f} "
            f"| {f['width']:.1e} |"
            for length, accuracy, cell, f in ends()
        ),
        "",
        "## Boxes that are not symmetric",
        "",
        "14 feet of an electrode of made-up sizes and places, 6 x 4 mm over a film of 0.2 mm, to 3e-3.",
        "",
        "| meshes | unknowns | processor time [s] | memory [MB] | width |",
        "|---|---|---|---|---|",
        *(
            f"| {words} | {f['unknowns']} | {f['seconds']:.3g} | {f['megabytes']:.0f} | {f['width']:.1e} |"
            for words, f in (("from one layer on", apart(1e9)), ("without layers first", apart(80)))
        ),
    ]
    (HERE / "results" / "fem3d.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        numbers = [float(word) for word in sys.argv[1:]]
        print(json.dumps({1: feet, 2: solved, 3: cut}[len(numbers)](*numbers)))
    else:
        main()
