"""Write the pictures of shapes, predictions, resolution, sheets and double layers in the docs; run by `make docs`."""

import tempfile
from pathlib import Path

import numpy as np
from generate import DOCS, sensorgen
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sensorgen.analysis.plots import results, static
from sensorgen.analysis.plots.results import identifiability_figure
from sensorgen.asprinted import printed as prints
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.design import make
from sensorgen.export import slicing
from sensorgen.export.layered import closed
from sensorgen.models.sheet import localise
from sensorgen.models.stack import GroundTie
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.double_layer import WIRINGS, Touching, press_at, stacked
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.sensor_model import build_sensor
from sensorgen.scene.geometry.meshes import mesh
from sensorgen.solvers.sheet.parts import Sheet, SheetPatch
from sensorgen.solvers.sheet.solve import contact_sets

PICTURES = DOCS / "pictures"
SENSORS = {
    "plate": ("solid plate, 0.6 mm, free sides", {"shape": "reference"}, "unconfined"),
    "tri": ("triangles over 0.1 mm", {"shape": "tri", "parameters": {"dielectric_mm": 0.1}}, ""),
}
PREDICTED = ("inverse-position",)


def identifiability(name: str) -> None:
    """Resolution of force and position of one sensor."""
    title, data, law = SENSORS[name]
    shown = identifiability_figure(build_sensor(drawn(make(data)), law).sensor, TONES_HZ, title=title)
    (PICTURES / f"identifiability-{name}.png").write_bytes(static.png(shown))


def predictions() -> None:
    """R and X of the triangular sensor over force, position and frequency."""
    with tempfile.TemporaryDirectory() as folder:
        sensorgen("predict", "tri", "--dielectric", "0.1", "--force", "0:6:0.1", "--drawn", "--plot", folder)
        for name in PREDICTED:
            (PICTURES / f"predict-{name}.png").write_bytes((Path(folder) / f"{name}.png").read_bytes())


def bounds_on_a_sheet() -> None:
    """Resolution of position on a sheet of 100 x 100 mm and 5 ohm m under 6 N, by contacts."""
    film = Sheet(0.1, 0.1, (5.0 / 3e-4,) * 2, EPS0_F_PER_M * 4.68 / 6e-4)
    factor = 1 / (1 - 0.05)
    press, per_newton = SheetPatch(0.0, 0.0, 0.02, 0.02, factor), {"capacitance_factor": factor**2 * 0.05 / 6}
    ports = contact_sets(film)
    tones = np.array(TONES_HZ)
    bounds = {name: localise(film, pairs, tones, press, per_newton, places=7) for name, pairs in ports.items()}
    (PICTURES / "sheet-bounds.png").write_bytes(static.png(results.sheet(film, bounds, ports)))


def touch() -> None:
    """Apparent force of a touch through an isolation layer of X60, by wiring."""
    drawn = Figure(figsize=(9, 3.6), layout="constrained")
    thickness_mm = np.geomspace(0.02, 10, 40)
    for axes, (title, data, law) in zip(drawn.subplots(1, 2, sharey=True), SENSORS.values(), strict=True):
        found = stacked(make(data), law)
        press = press_at(found, 6.0, 0.045)
        touching = Touching(found.own, found.isolation_eps_r, np.array(TONES_HZ), press, 1e-3, GroundTie())
        for wiring in WIRINGS:
            axes.loglog(thickness_mm, [abs(touching.force_n(mm, wiring)) for mm in thickness_mm], label=wiring.words)
        axes.axhline(0.1, color="0.5", lw=0.8, ls="--")
        axes.axvline(0.1, color="0.5", lw=0.8, ls=":")
        axes.set(title=title, xlabel="isolation (X60) [mm]", ylim=(3e-4, 1e4))
        axes.grid(alpha=0.3)
    first, second = drawn.axes
    first.set_ylabel("apparent force of a touch [N]")
    first.legend(fontsize=8)
    second.text(10, 0.11, "0.1 N", ha="right", fontsize=8, color="0.4")
    second.text(0.105, 3e3, "thesis: 0.1 mm", fontsize=8, color="0.4")
    drawn.savefig(PICTURES / "stack-touch.png", dpi=110)


def shapes() -> None:
    """Sections of the shapes through the middle of a cell, over two periods, and one plan."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    colours = {"etpu": "#303436", "x60": "#f2c14e"}
    shown = [("bump", {}), ("cone", {}), ("pyramid", {"cog": "dielectric"}), ("pillar", {}), ("gaps", {}), ("cog", {}),
             ("porous", {}), ("tri", {"tip_mm": 0.44}), ("double_tri", {}), ("rect", {"angle_deg": 45.0})]  # fmt: skip
    for axes, (name, parameters) in zip(figure.subplots(2, 5).flat, shown, strict=True):
        design = make({"shape": name, "parameters": parameters | {"length_mm": 20.0, "width_mm": 20.0}})
        period = getattr(design.params, "period_mm", 2.0)
        seen, at = ("z", 0.95) if name == "rect" else ("y", period / 2)
        for body in design.in_use.bodies:
            for outline in (o for piece in body.pieces for o in piece.cut(seen, at)):
                axes.fill(*zip(*outline, strict=True), color=colours[body.material], lw=0)
        axes.set(title=name, xlim=(0, 2 * period if seen == "y" else 8.0), ylim=(0, 8.0) if seen == "z" else None)
        axes.tick_params(labelsize=6)
    figure.supxlabel("mm; rect in plan, the others in section, heights enlarged", fontsize=8)
    figure.savefig(PICTURES / "shapes.png", dpi=110)


def printed_body() -> None:
    """Cones of the top electrode, seen from the film: as drawn, and as PrusaSlicer's G-code prints them."""
    design = make({"shape": "cone", "parameters": {"length_mm": 2.5, "width_mm": 2.5}})
    with tempfile.TemporaryDirectory() as folder:
        made = slicing.sliced([slicing.alone(design)], "prusa", Path(folder))
        printed = prints.body(design, made.lines, slicer=f"PrusaSlicer {made.version}")
    top = next(each for each in design.printed.bodies if each.terminal == "top")
    shown = {"drawn": mesh(top), printed.provenance: closed(printed.first, [top.name])}
    drawing = Figure(figsize=(9, 3.6), layout="constrained")
    axes = drawing.subplots(1, 2, subplot_kw={"projection": "3d", "proj_type": "ortho"})
    for each, (title, surface) in zip(axes, shown.items(), strict=True):
        corners = (surface.vertices_mm * [1, -1, -1])[surface.triangles]  # turned over
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        plate = corners[..., 2].max(1) < corners[..., 2].min() + 0.31  # whose large triangles go behind
        for rows, layer in ((plate, 1), (~plate, 2)):
            seen = corners[rows & (normal @ (0.42, -0.73, 0.53) > 0)]
            each.add_collection3d(
                Poly3DCollection(seen, facecolors="#8a9bb0", shade=True, zorder=layer, antialiased=False)
            )
        each.computed_zorder = False
        low, high = corners.min((0, 1)), corners.max((0, 1))
        each.set(title=title, xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        each.set_box_aspect((2.5, 2.5, 1.05), zoom=1.1)
        each.view_init(32, -60)
        each.set_axis_off()
    drawing.savefig(PICTURES / "printed-body.png", dpi=110)


if __name__ == "__main__":
    shapes()
    for each in SENSORS:
        identifiability(each)
    predictions()
    bounds_on_a_sheet()
    touch()
    printed_body()
