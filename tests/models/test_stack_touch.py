"""A body that touches a stack: lumped networks where the line is short, Kirchhoff's law where it is not."""

import numpy as np
import pytest
from resistors import ladder, potentials

from sensorgen.core.errors import OutOfRange
from sensorgen.models.compression import unconfined
from sensorgen.models.stack import Film, GroundTie, Stack, Touch, Track

FIRM = unconfined(6e6).capacitive_strain
SINGLE = Stack(0.1, 0.01, (Track(67e3), Track(23e3)), (Film(7e-10, FIRM),))
IDEAL = Stack(0.1, 0.01, (Track(0.0), Track(0.0)), (Film(7e-10, FIRM),))
DOUBLE = Stack(0.1, 0.01, (Track(67e3), Track(23e3), Track(23e3)), (Film(7e-10, FIRM), Film(5e-10, FIRM)))
TONES = np.array([1.1e3, 99.7e3, 5e6])
TOUCH = Touch(0.03, 0.01, 4.1e-9)


def parallel(*parts):
    return 1 / sum(1 / p for p in parts)


@pytest.mark.parametrize("isolation", [4.1e-9, np.inf])
def test_on_perfect_electrodes_it_is_a_few_capacitors(isolation):
    """Film, isolation and body in a row: at the driven top in parallel to the film, at ground without effect."""
    omega, body = 2 * np.pi * TONES, GroundTie(1500.0, 100e-12)
    film = 1 / (1j * omega * 7e-11)
    contact = 0.0 if np.isinf(isolation) else 1 / (1j * omega * isolation * 0.01)
    aside = contact + 1500.0 + 1 / (1j * omega * 100e-12)
    touch = Touch(0.03, 0.01, isolation)
    at_top = IDEAL.touched(TONES, touch, body, driven=1, low=0, bridge=False)
    assert at_top == pytest.approx(parallel(film, aside), rel=1e-12)
    for driven, low, bridge in ((0, 1, False), (0, 1, True), (1, 0, True)):
        assert IDEAL.touched(TONES, touch, body, driven, low, bridge) == pytest.approx(film, rel=1e-12)


@pytest.mark.parametrize(
    ("f", "touch", "body"),
    [(0.0, TOUCH, GroundTie()), (1e3, TOUCH._replace(isolation_f_per_m=0.0), GroundTie()), (1e3, TOUCH, GroundTie(0.0)),
     (1e3, TOUCH, GroundTie(1.0, 0.0)), (float("nan"), TOUCH, GroundTie())],
)  # fmt: skip
def test_it_refuses_what_does_not_touch(f, touch, body):
    with pytest.raises(OutOfRange, match="a touch needs"):
        SINGLE.touched(f, touch, body, 1, 0)


def kirchhoff(*network):
    """The ladder's limit, extrapolated from two of them: its error is of second order."""
    return (4 * nodal(*network, cells=200) - nodal(*network, cells=100)) / 3


def nodal(f, stack, touch, body, driven, low, bridge, cells):
    """Nodes of the whole network, body and ground included: what the instrument drives and reads."""
    omega, n, step = 2 * np.pi * f, len(stack.tracks), stack.length_m / cells
    body_node, ground = n * (cells + 1), n * (cells + 1) + 1
    films = [1j * omega * film.capacitance_f_per_m for film in stack.films]
    links = list(ladder([track.r_ohm_per_m for track in stack.tracks], films, stack.length_m, cells))
    between = body.resistance_ohm * touch.length_m + 1 / (1j * omega * touch.isolation_f_per_m)
    for cell in range(cells + 1):
        edges = np.clip((cell + np.array([-0.5, 0.5])) * step, touch.left_m, touch.left_m + touch.length_m)
        links.append((n * cell + n - 1, body_node, np.ptp(edges) / between))
    links.append((body_node, ground, 1j * omega * body.capacitance_f))
    held = np.full(ground + 1, np.nan)
    held[[driven, low, ground]] = 1.0, 0.0, 0.0  # low is a virtual ground
    _, current = potentials(*map(np.array, zip(*links, strict=True)), held)
    return 1 / (-current[low] if bridge else current[driven])


@pytest.mark.parametrize("stack", [SINGLE, DOUBLE], ids=["single", "double"])
@pytest.mark.parametrize("bridge", [False, True])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("f", [1.1e3, 1e6])
def test_it_is_what_kirchhoff_says(stack, bridge, turned, f):
    n = len(stack.films)
    ends = (n - 1, n) if turned else (n, n - 1)
    found = complex(stack.touched(f, TOUCH, GroundTie(), *ends, bridge))
    expected = kirchhoff(f, stack, TOUCH, GroundTie(), *ends, bridge)
    assert abs(found - expected) < 2e-5 * abs(expected)
    assert abs(found.real - expected.real) < 2e-4 * abs(expected.real)


def test_an_outer_pair_is_read_over_the_middle():
    found = complex(DOUBLE.touched(1e5, TOUCH, GroundTie(), 2, 0, bridge=False))
    assert found == pytest.approx(kirchhoff(1e5, DOUBLE, TOUCH, GroundTie(), 2, 0, False), rel=2e-5)


def test_a_press_under_the_touch_counts():
    found = IDEAL.touched(TONES, Touch(0.03, 0.01, 1e-30, 6.0), GroundTie(), 1, 0)
    assert found == pytest.approx(1 / (2j * np.pi * TONES * (7e-11 * 0.9 + 7e-12 / 0.99)), rel=1e-12)
