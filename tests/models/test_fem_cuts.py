"""Cuts of the stream function that run along cones: scenes that have them, beside NGSolve, which knows no cuts."""

import pytest
from cell_scenes import EPS, bars, few_rings, plates, slab

from sensorgen.models import fem2d
from sensorgen.scene.scene import Body, box
from sensorgen.solvers.electrostatics import bounds

ALONG_CONES = {
    # ends a spoke before, and lifts two of them
    "last sector": plates(
        slab(),
        bars("tooth", "top", (0.2, 0.6, 1.0, 1.2)),
        bars("i", "bottom", (0.2, 0.55, 0.5, 0.8), (0.6, 1.2, 0.5, 0.8)),
    ),
    # ends beside a corner of the tooth, whose last spoke is where it ends
    "last spoke": plates(
        slab(), bars("tooth", "top", (0.82, 1.27, 1.06, 1.2)), bars("i", "bottom", (0.26, 1.45, 0.51, 0.69))
    ),
    # passes a corner within the dielectric on both sides of its first spoke
    "all around": plates(
        bars("i", "top", (0.67, 0.98, 0.59, 0.74)),
        Body(
            "solid",
            "x60",
            (box(0.34, 0.62, 0, 1, 0.3, 0.49), box(0.76, 1.09, 0, 1, 0.34, 0.49), box(1.29, 1.43, 0, 1, 0.84, 1.07)),
        ),
    ),
}
LIFTED = {  # in the last sector: whether the cone goes all around, and which of its spokes from the end
    "last spoke": {(False, 0)},
    "last sector": {(False, 0), (False, 1)},
    "all around": {(True, 0)},
}


def lifted(mesh) -> set[tuple[bool, int]]:
    """Spokes that a cut lifts in the last sectors of cones; the first spoke of a closed one comes after its last."""
    return {
        (fan.closed, (len(fan.members) - fan.spokes.index(point)) % len(fan.members))
        for fan in mesh.fans.values()
        for point, _ in mesh.flow.lifts.get(fan.members[-1], ())
    }


@pytest.mark.parametrize("name", ALONG_CONES)
def test_ngsolve_has_the_same_flux_where_a_cut_runs_along_a_cone(name):
    pytest.importorskip("ngsolve", reason="the independent program: pip install 'sensorgen[fem]'")
    import ngsolve_cells

    mesh = few_rings(ALONG_CONES[name])
    assert lifted(mesh) == LIFTED[name]
    for order in (2, 3):
        ours = bounds.whole(fem2d._solved(mesh, EPS, order), [1.0])
        assert (ours.lower, ours.upper) == pytest.approx(ngsolve_cells.bounds(mesh, EPS, order), rel=3e-9, abs=0)


@pytest.mark.parametrize("name", ALONG_CONES)
def test_the_bounds_meet_along_cones(name):
    """A lift left out, or one too many, is a source of flux: Thomson's bound then stays away or crosses."""
    assert fem2d.capacitance(ALONG_CONES[name], EPS, 1e-6).width() <= 1e-6
