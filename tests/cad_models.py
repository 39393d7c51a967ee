"""Sensors that tests import, drawn with build123d and written as STEP; run as a program, with a folder.

The kernel is loaded by the program alone: it may never meet NGSolve in one process.
"""

import math
import sys

BUMP_MM, RISE_MM = 3.0, 0.6  # radius and height of the bump
BALL_MM = (BUMP_MM**2 + RISE_MM**2) / (2 * RISE_MM)  # radius of the ball whose cap it is


def plate(x, y, z, dx, dy, dz):
    return cad.Pos(x, y, z) * cad.Box(dx, dy, dz, align=(cad.Align.MIN,) * 3)


def write(folder, name, parts, unit="mm"):
    for label, (part, colour) in parts.items():
        part.label, part.color = label, cad.Color(colour)
    whole = cad.Compound(label=name, children=[part for part, _ in parts.values()])
    cad.export_step(whole, f"{folder}/{name}.step", unit=cad.Unit.IN if unit == "inch" else cad.Unit.MM)


def dome():
    """A cap of a ball under a plate, away from the origin."""
    middle = BUMP_MM / 2
    arc = cad.Edge.make_three_point_arc(
        (BUMP_MM, 0, 0), (middle, 0, RISE_MM - BALL_MM + math.sqrt(BALL_MM**2 - middle**2)), (0, 0, RISE_MM)
    )
    base, axis = cad.Edge.make_line((0, 0, 0), (BUMP_MM, 0, 0)), cad.Edge.make_line((0, 0, RISE_MM), (0, 0, 0))
    profile = cad.Wire([base, arc, axis])
    bump = cad.Pos(15, 15, 0.6) * cad.Solid.revolve(cad.Face(profile), 360, cad.Axis.Z)
    return {
        "base electrode": (plate(5, 5, 0, 20, 20, 0.4), "#303436"),
        "film": (plate(5, 5, 0.4, 20, 20, 0.2), "#f2c14e"),
        "bump": (bump, "#f2c14e"),
        "top_electrode": (plate(5, 5, 1.2, 20, 20, 0.4), "#303436"),
    }


def filleted():
    """A plate with rounded edges between two electrodes."""
    pad = plate(0, 0, 0.4, 30, 10, 0.8)
    pad = cad.fillet(pad.edges().filter_by(cad.Axis.X).group_by(cad.Axis.Z)[-1], 0.3)
    return {
        "low": (plate(0, 0, 0, 30, 10, 0.4), "#303436"),
        "pad": (pad, "#f2c14e"),
        "up": (plate(0, 0.3, 1.2, 30, 9.4, 0.4), "#303436"),
    }


def rounded():
    """Three plates whose corners in plan are rounded, as drawn by hand."""

    def layer(z, high):
        part = plate(0, 0, z, 30, 10, high)
        return cad.fillet(part.edges().filter_by(cad.Axis.Z), 1.0)

    return {"low": (layer(0, 0.4), "#303436"), "pad": (layer(0.4, 0.6), "#f2c14e"), "up": (layer(1.0, 0.4), "#303436")}


def serpentine(z):
    turns = [plate(3, 1 + k * 2.4, z, 24, 1.2, 0.4) for k in range(5)]
    ends = [plate(25.8 if k % 2 == 0 else 3, 1 + k * 2.4, z, 1.2, 3.6, 0.4) for k in range(4)]
    return sum([*turns[1:], *ends], turns[0])


def crossed():
    """Two serpentine electrodes with a film between them."""
    return {
        "carrier": (plate(0, 0, 0, 30, 12, 0.4), "#f2c14e"),
        "lower": (serpentine(0.4), "#303436"),
        "film": (plate(0, 0, 0.8, 30, 12, 0.2), "#f2c14e"),
        "upper": (serpentine(1.0), "#303436"),
    }


def colliding():
    """The upper plate reaches 0.1 mm into the film; its name is nothing for a file."""
    return {
        "low": (plate(0, 0, 0, 20, 10, 0.4), "#303436"),
        "film": (plate(0, 0, 0.4, 20, 10, 0.3), "#f2c14e"),
        "up / Größe 1": (plate(5, 2, 0.6, 10, 5, 0.4), "#303436"),
    }


if __name__ == "__main__":
    import build123d as cad

    out = sys.argv[1]
    write(out, "dome", dome())
    write(out, "filleted", filleted())
    write(out, "crossed", crossed())
    write(out, "rounded", rounded())
    write(out, "colliding", colliding())
