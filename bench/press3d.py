"""Boxes under pressure: meshes of rect, how it is held, feet that touch against the plane model, and pictures.

Solutions are kept in ``results/press3d.json``, by what was solved; delete it to solve all anew (half an hour). Seconds
are the processor's. Writes ``results/press3d.md`` and ``docs/pictures/press3d-*.png``.
"""

import json
import resource
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

from sensorgen.design.design import make
from sensorgen.models import press2d, press3d
from sensorgen.models.press3d import BoundaryConditions, BrickCounts, Elastic
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.contact import element

HERE = Path(__file__).parent
PICTURES = HERE.parent / "docs" / "pictures"
KEPT = HERE / "results" / "press3d.json"
EPS = {"x60": 4.68, "air": 1.00059}
SOLIDS = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
LOADS = (0.0, 5e4, 1e5)
FEET = (0.0, 1e4, 2e4, 5e4, 1e5)
NARROW = tuple(np.linspace(0.0, 3e5, 7).tolist())
RECT_M2 = 4e-6  # of a whole cell of rect
BOUNDS = ("lower_f_per_m2", "upper_f_per_m2")
HELD = {  # base, period, top
    "bonded": ("bonded", "fixed", "even"),
    "bonded, stiff top": ("bonded", "fixed", "rigid"),
    "base sliding": ("sliding", "fixed", "even"),
    "base sliding, sides free": ("sliding", "free", "even"),
}
COLOURS = {"x60": "#0072b2", "etpu": "0.45"}


def rect(film_mm=0.1):
    return press3d.cell(make({"shape": "rect", "parameters": {"dielectric_mm": film_mm}}).in_use)


def cog(*half_widths_mm, lift_mm=0.02):
    """Bars of printed layers along y, on a top that hangs over a film."""
    floor, deep, high = 0.4, 8.0, 0.1
    layers = [(k, c, w) for k, w in enumerate(half_widths_mm) for c in (0.5, 2.5)]
    low = floor + lift_mm
    bars = [box(c - w, c + w, 0, deep, low + high * k, low + high * (k + 1)) for k, c, w in layers]
    roof = low + high * len(half_widths_mm)
    bodies = (
        Body("bottom_electrode", "etpu", (box(0, 4, 0, deep, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(0, 4, 0, deep, 0.3, floor),)),
        Body("feet", "x60", tuple(bars)),
        Body("top_electrode", "etpu", (box(0, 4, 0, deep, roof, roof + 0.3),), "top"),
    )
    return Scene(bodies, (4.0, deep, roof + 0.3))


SCENES = {"cog": cog(0.2, 0.3), "block": cog(0.3)}


def kept(solve):
    """Solutions by their arguments, from the file of earlier runs where they are in it."""

    def found(*args):
        known = json.loads(KEPT.read_text()) if KEPT.exists() else {}
        key = " ".join([solve.__name__, *map(str, args)])
        if key not in known:
            start = resource.getrusage(resource.RUSAGE_SELF).ru_utime
            pressed = solve(*args)
            known[key] = as_data(pressed, resource.getrusage(resource.RUSAGE_SELF).ru_utime - start)
            KEPT.write_text(json.dumps(known, indent=1) + "\n")
        return known[key]

    return found


def as_data(found, seconds):
    bounds = [[getattr(c, side) if c else None for c in found.capacitance_f_per_m2] for side in ("lower", "upper")]
    return {
        "displacement_um": (found.displacement_m * 1e6).tolist(),
        "lower_f_per_m2": bounds[0],
        "upper_f_per_m2": bounds[1],
        "faults": list(found.faults),
        "seconds": round(seconds, 1),
    }


@kept
def strips(film_mm, pieces, loads, base="bonded", period="fixed", top="even"):
    """The cell of rect at even steps up to 100 kPa."""
    stresses = np.linspace(0, 1e5, loads).tolist()
    return press3d.press(
        rect(film_mm), SOLIDS, stresses, EPS, BoundaryConditions(base, period, top), BrickCounts(pieces)
    )


@kept
def feet(name, contact, pieces):
    """A cog pressed by bricks, or by the plane model on a fine mesh for no pieces."""
    held = BoundaryConditions(contact=contact)
    if not pieces:
        finest = press2d.Fineness().finer().finer()
        return press2d.press(press2d.cell(SCENES[name], 2.0), SOLIDS, FEET, EPS, held, finest)
    return press3d.press(press3d.cell(SCENES[name]), SOLIDS, FEET, EPS, held, BrickCounts(pieces))


@kept
def narrow(pieces):
    """Rect with gaps of 0.02 mm, its strips 0.98 mm wide, X60 of 1 MPa: its gaps close."""
    widths = {"air_width_mm": 0.02, "etpu_width_mm": 0.98, "x60_width_mm": 0.98}
    cell = press3d.cell(make({"shape": "rect", "parameters": {"dielectric_mm": 0.1} | widths}).in_use)
    soft = SOLIDS | {"x60": Elastic(1e6, 0.4999)}
    return press3d.press(cell, soft, list(NARROW), EPS, BoundaryConditions(), BrickCounts(pieces))


def rises(data, side):
    c = np.array(data[side])
    return c[1:] / c[0] - 1


def limit(middle, fine):
    """Where 2 and 3 pieces lead if their error falls with the square of the pieces."""
    return fine + (fine - middle) * 4 / 5


def mesh_table():
    yield "## Rect: every box cut into n pieces along each axis (100 kPa, base bonded, sides fixed, even pressure)\n"
    yield "| film [mm] | n | bricks | displacement [um] | rise of lower, upper bound | C(0) [pF per cell] | s |"
    yield "|---|---|---|---|---|---|---|"
    for film in (0.1, 0.2):
        solid = int((rect(film).fill > 0).sum())
        found = {n: strips(film, n, len(LOADS)) for n in (2, 3, 4)}
        for n, data in found.items():
            rise = [f"{rises(data, side)[-1]:.3%}" for side in BOUNDS]
            bounds = [f"{data[side][0] * RECT_M2 * 1e12:.4f}" for side in BOUNDS]
            yield (
                f"| {film} | {n} | {solid * n**3} | {data['displacement_um'][-1]:.3f} | {', '.join(rise)} "
                f"| {' to '.join(bounds)} | {data['seconds']:.0f} |"
            )
        two, three = found[2], found[3]
        moved = limit(*(d["displacement_um"][-1] for d in (two, three)))
        ends = [limit(*(rises(d, side)[-1] for d in (two, three))) for side in BOUNDS]
        yield f"| {film} | limit of 2, 3 | | {moved:.3f} | {ends[0]:.3%}, {ends[1]:.3%} | | |"


def held_table():
    yield "\n## Rect, 100 kPa: how it is held\n"
    yield "| film [mm] | held | pieces | displacement [um] | rise of C | over bonded |"
    yield "|---|---|---|---|---|---|"
    for film, pieces in ((0.1, 2), (0.1, 3), (0.2, 2)):
        bonded = None
        for name, held in HELD.items():
            data = strips(film, pieces, len(LOADS), *held)
            rise = np.mean([rises(data, side)[-1] for side in BOUNDS])
            bonded = bonded or rise
            moved = f"{data['displacement_um'][-1]:.2f}"
            yield f"| {film} | {name} | {pieces} | {moved} | {rise:.3%} | {rise / bonded - 1:+.1%} |"


def narrow_table():
    yield "\n## Rect with gaps of 0.02 mm, X60 of 1 MPa, 2 pieces\n"
    yield "| stress [kPa] | displacement [um] | rise of C |"
    yield "|---|---|---|"
    data = narrow(2)
    grown = middles(data) / middles(data)[0] - 1
    for stress, moved, rise in list(zip(NARROW, data["displacement_um"], grown, strict=True))[1:]:
        yield f"| {stress / 1e3:g} | {moved:.2f} | {said(rise, '.2%')} |"


def middles(data):
    pairs = zip(data["lower_f_per_m2"], data["upper_f_per_m2"], strict=True)
    return np.array([(a + b) / 2 if a else np.nan for a, b in pairs])


def feet_table():
    yield "\n## Feet that come down on the film: bricks over the plane model\n"
    yield "| scene | contact | n | stress [kPa] | displacement [um] | over press2d | C [nF/m2] | over press2d |"
    yield "|---|---|---|---|---|---|---|---|"
    solved = (
        ("cog", "frictionless", 2),
        ("cog", "frictionless", 3),
        ("block", "frictionless", 3),
        ("block", "stick", 3),
    )
    for name, contact, pieces in solved:
        plane, data = feet(name, contact, 0), feet(name, contact, pieces)
        for k, stress in list(enumerate(FEET))[1:]:
            moved, c = data["displacement_um"][k], middles(data)[k]
            u, flat = plane["displacement_um"][k], middles(plane)[k]
            yield (
                f"| {name} | {contact} | {pieces} | {stress / 1e3:g} | {moved:.3f} | {moved / u - 1:+.2%} "
                f"| {said(c * 1e9, '.3f')} | {said(c / flat - 1, '+.2%')} |"
            )
    yield "\nSticking lowers the block by, at each stress (bricks, plane model):\n"
    for pieces in (3, 0):
        slips, sticks = (
            np.array(feet("block", how, pieces)["displacement_um"][1:]) for how in ("frictionless", "stick")
        )
        yield f"- {'bricks' if pieces else 'press2d'}: " + ", ".join(f"{x:+.3%}" for x in sticks / slips - 1)


def said(value, how):
    return format(value, how) if np.isfinite(value) else "none"


def section(ax, run, state, enlarged):
    """Edges of bricks in the plane y = 0, moved."""
    elements = run.problem.elements
    mesh, moved = elements.mesh, elements.mesh.all_nodes(state.u_m, state.inner.bubble)
    places = (mesh.points_m + enlarged * moved) * 1e3
    s = np.linspace(-1, 1, 9)
    shape = element.line_values(s)
    here = mesh.nodes[mesh.boxes[:, 1] == 0].reshape(-1, 3, 3, 3)[:, :, 0, :]
    region = mesh.region[mesh.boxes[:, 1] == 0]
    for k, known in enumerate(mesh.bricks.regions):
        quads = here[region == k]
        lines = [shape @ places[side][:, [0, 2]] for q in quads for side in (q[0], q[2], q[:, 0], q[:, 2])]
        if lines:
            colour = COLOURS[known.material]
            ax.add_collection(LineCollection(lines, colors=colour, linewidths=0.6, label=known.material))
    ax.set(aspect="equal", xlabel="x [mm]")
    ax.autoscale()


def picture(name, cell, stress, pieces, enlarged):
    """Unloaded and pressed, side by side."""
    _, run = press3d._solved(
        cell.cut(pieces.pieces, pieces.shrink), SOLIDS, stress, BoundaryConditions(), lambda _: None
    )
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained", sharey=True)
    for ax, state in zip(axes, (run.states[0], run.states[-1]), strict=True):
        section(ax, run, state, enlarged)
        how = f", displacement {enlarged} times" if enlarged > 1 and state.pressure_pa else ""
        ax.set_title(f"{state.pressure_pa / 1e3:g} kPa{how}", fontsize=10)
    axes[0].set(ylabel="height [mm]")
    handles = dict(zip(*axes[0].get_legend_handles_labels()[::-1], strict=True))
    figure.legend(handles.values(), handles.keys(), frameon=False, fontsize=8, loc="outside upper right", ncols=2)
    figure.savefig(PICTURES / f"press3d-{name}.png", dpi=130)


def main():
    lines = ["# Boxes under pressure", "", "Made by `bench/press3d.py`.", ""]
    picture("feet", press3d.cell(SCENES["cog"]), FEET, BrickCounts(2), 1)
    picture("rect", rect(), (0.0, 1e5), BrickCounts(2), 10)
    for table in (mesh_table, feet_table, held_table, narrow_table):
        lines += table()
    (HERE / "results" / "press3d.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
