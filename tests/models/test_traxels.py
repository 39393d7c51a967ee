"""The network of lines against solids, stacks of strips and a fine grid."""

import numpy as np
import pytest

from sensorgen.core.errors import OutOfRange
from sensorgen.models import traxels
from sensorgen.solvers import network as band
from sensorgen.solvers import network as links
from sensorgen.solvers.network import Nodes, StraightLines
from sensorgen.verification.chart.networks import plate

RHO, W, H = 0.2, 0.42e-3, 0.1e-3
ENDS = (-9e-3, 9e-3)


def strips(n, along):
    """Parallel lines that touch, along x or along y, 10 mm wide."""
    at = (np.arange(n) - (n - 1) / 2) * W
    reach = np.full(n, 5e-3)
    start, end = (np.stack([-reach, at], 1), np.stack([reach, at], 1))
    if along == "y":
        start, end = start[:, ::-1], end[:, ::-1]
    full = np.ones(n)
    return StraightLines(start, end, full * W, full * H, np.zeros(n, np.int64), np.zeros(n, bool))


def ratio(lines, contact, ends=ENDS, area=None):
    area = area or (lines.layer.max() + 1) * H * 10e-3
    return traxels.resistance(lines, RHO, contact, ends, area).ratio


@pytest.mark.parametrize(("degrees", "layers"), [(0, 1), (15, 3), (45, 1), (60, 3)])
def test_without_contact_resistance_every_direction_conducts_as_the_solid(degrees, layers):
    angles = [degrees + 90 * k for k in range(layers)]
    lines = plate(20.0, 9.24, W * 1e3, H * 1e3, angles)
    assert ratio(lines, 0.0, area=layers * H * 9.24e-3) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("contact", [0.0, 1e-6, 1e-3, np.inf])
def test_lines_along_the_current_do_not_feel_contacts(contact):
    assert ratio(strips(20, "x"), contact, (-4.5e-3, 4.5e-3), 20 * W * H) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("contact", [0.0, 1e-6, 1e-4, 1e-2])
def test_across_lines_each_contact_adds_its_own(contact):
    n = 12
    lines = strips(n, "y")
    x = lines.start_m[:, 0]
    gaps = ratio(lines, contact, (x[0], x[-1]), H * 10e-3)
    whole = (1 + (n - 1) * gaps) / n  # half a line more at each end
    assert whole == pytest.approx(1 + (n - 1) / n * contact / (RHO * W), rel=1e-9)


def test_lines_of_two_layers_that_cross():
    """One line along x over one along y: the current goes up through their common square alone."""
    lines = StraightLines(
        np.array([[-5e-3, 0.0], [0.0, -5e-3], [0.0, 3e-3]]), np.array([[0.0, 0.0], [0.0, 5e-3], [5e-3, 3e-3]]),
        np.full(3, W), np.full(3, H), np.array([0, 1, 0]), np.zeros(3, bool),
    )  # fmt: skip
    contact = 1e-6
    found = traxels.resistance(lines, RHO, contact, (-4e-3, 4e-3), H * W)
    along = RHO / (W * H)
    joint = (RHO * H + contact) / W**2
    # Held are the nodes at -5 and 5 mm: 5 mm, a joint, 3 mm along y, a joint and 5 mm, in a field of 1 V/m over 10 mm.
    expected = (13e-3 * along + 2 * joint) / (along * 10e-3)
    assert found.ratio == pytest.approx(expected, rel=1e-9)


def test_lines_that_cross_aslant_share_a_longer_place():
    """As before, the upper line at 45 degrees: each common place is a parallelogram."""
    way = 5e-3 / np.sqrt(2)
    lines = StraightLines(
        np.array([[-9e-3, 0.0], [-way, -way], [3e-3, 3e-3]]), np.array([[0.0, 0.0], [2 * way, 2 * way], [12e-3, 3e-3]]),
        np.full(3, W), np.full(3, H), np.array([0, 1, 0]), np.zeros(3, bool),
    )  # fmt: skip
    along, joint = RHO / (W * H), (RHO * H + 1e-6) * np.sin(np.pi / 4) / W**2
    path = 9e-3 + 3e-3 * np.sqrt(2) + 9e-3
    found = traxels.resistance(lines, RHO, 1e-6, (-8e-3, 8e-3), H * W)
    assert found.ratio == pytest.approx((path * along + 2 * joint) / (along * 21e-3), rel=1e-9)


def test_a_piece_counts_the_same_wherever_it_stands_in_the_file():
    """After very many others that touch nothing: what is left of a number's digits still tells its nodes apart."""
    plated, n = plate(20.0, 5.0, W * 1e3, H * 1e3, [0, 90]), 100_000
    aside = np.stack([np.zeros(n), 1.0 + 1e-3 * np.arange(n)], axis=1)
    both = StraightLines(
        np.concatenate([aside, plated.start_m]), np.concatenate([aside + np.array([1e-3, 0.0]), plated.end_m]),
        np.append(np.full(n, W), plated.width_m), np.append(np.full(n, H), plated.height_m),
        np.append(np.zeros(n, np.int64), plated.layer), np.append(np.zeros(n, bool), plated.joined),
    )  # fmt: skip
    assert ratio(both, 1e-5, area=1e-6) == pytest.approx(ratio(plated, 1e-5, area=1e-6), rel=1e-8)


@pytest.mark.parametrize("degrees", [0, 30, 90])
def test_contacts_join_places_near_their_own_nodes(degrees):
    """A turn of the infill beside a long wall touches it along a few widths, not along half of the wall."""
    lines = plate(200.0, 5.0, W * 1e3, H * 1e3, [degrees, degrees + 90])
    pairs = links.near(lines)
    crossed = links.crossings(lines, pairs)
    nodes = Nodes.of(lines, crossed.places())
    found = links.gathered(lines, nodes, pairs, crossed)
    for side, sign in ((slice(0, 2), 1), (slice(2, 4), -1)):
        ends = nodes.place_m[found.node[:, side]]
        beyond = -(sign * found.weight[:, side]).min(axis=1) * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        assert beyond[found.contacts > 0].max() < 4 * W


@pytest.mark.parametrize(
    ("rho", "contact", "ends", "area", "word"),
    [
        (0.0, 0.0, ENDS, 1e-6, "resistivity of 0"),
        (np.inf, 0.0, ENDS, 1e-6, "resistivity of inf"),
        (RHO, -1e-9, ENDS, 1e-6, "contact resistivity"),
        (RHO, np.nan, ENDS, 1e-6, "contact resistivity"),
        (RHO, 0.0, (1e-3, 1e-3), 1e-6, "expected a length"),
        (RHO, 0.0, ENDS, 0.0, "area"),
        (RHO, 0.0, (-1.0, 1.0), 1e-6, "within the electrode"),
    ],
)
def test_nonsense_is_refused(rho, contact, ends, area, word):
    with pytest.raises(OutOfRange, match=word):
        traxels.resistance(plate(20.0, 5.0, 0.42, 0.1, [0]), rho, contact, ends, area)


def test_lines_that_do_not_meet_conduct_nothing():
    with pytest.raises(OutOfRange, match="no line conducts"):
        ratio(strips(12, "y"), np.inf, (-2e-3, 2e-3))


@pytest.mark.parametrize("contact", [0.0, 1e-3])
def test_multigrid_finds_the_resistance_of_elimination(contact, monkeypatch):
    """Wide crossed layers, of some 10 000 unknowns."""
    lines = plate(30.0, 20.0, W * 1e3, H * 1e3, [0, 90, 45])
    direct = ratio(lines, contact, (-14e-3, 14e-3), 3 * H * 20e-3)
    monkeypatch.setattr(band, "_MOST", 0)
    assert ratio(lines, contact, (-14e-3, 14e-3), 3 * H * 20e-3) == pytest.approx(direct, rel=1e-8)
