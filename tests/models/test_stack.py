"""Stacks of tracks and films against matrix exponentials of 60 digits and more, a nodal ladder, and limits."""

from itertools import pairwise, product

import mpmath
import numpy as np
import pytest
from line_cases import cases
from resistors import ladder, potentials

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.models import line, stack
from sensorgen.models.compression import unconfined
from sensorgen.models.stack import Film, Press, Stack, Track, port
from sensorgen.solvers import multiline
from sensorgen.solvers.line.inputs import read

EXACT = 1e-11


def exponential(matrix):
    """Series of the exponential, halved and squared."""
    squarings = max(0, int(mpmath.ceil(mpmath.log(mpmath.mnorm(matrix, 1) + mpmath.mpf("1e-30"), 2)))) + 6
    found = term = mpmath.eye(matrix.rows)
    matrix, k = matrix / mpmath.mpf(2) ** squarings, 0
    while mpmath.mnorm(term, 1) > mpmath.mpf(10) ** -mpmath.mp.dps:
        k += 1
        term = term * matrix / k
        found = found + term
    for _ in range(squarings):
        found = found * found
    return found


def ladder_matrices(r, y):
    """Loop resistances and film admittances, written down loop by loop."""
    n = len(y)
    series, shunt = mpmath.zeros(n), mpmath.zeros(n)
    for k in range(n):
        series[k, k] = mpmath.mpf(r[k]) + mpmath.mpf(r[k + 1])
        shunt[k, k] = mpmath.mpmathify(y[k])
    for k in range(n - 1):
        series[k, k + 1] = series[k + 1, k] = -mpmath.mpf(r[k + 1])
    return series, shunt


def attenuation(r, y, lengths):
    """Bound of the exponents of a line: its exponentials lose twice as many digits, halved by ln 10."""
    return sum(
        sum(abs(complex(b)) * (float(p) + float(q)) for b, p, q in zip(ys, rs, rs[1:], strict=False)) ** 0.5
        * float(length)
        for rs, ys, length in zip(r, y, lengths, strict=True)
    )


def exact(r, y, lengths, digits=60):
    """Z at the contacts from transfer matrices, the far end open."""
    n = len(y[0])
    with mpmath.workdps(digits + int(2 * attenuation(r, y, lengths)) + 30):
        admittance = mpmath.zeros(n)
        for rs, ys, length in zip(reversed(r), reversed(y), reversed(lengths), strict=True):
            series, shunt = ladder_matrices(rs, ys)
            whole = mpmath.zeros(2 * n)
            whole[:n, n:], whole[n:, :n] = -series, -shunt
            e = exponential(whole * mpmath.mpf(length))
            ahead = (e[n:, n:] - admittance * e[:n, n:]) ** -1
            admittance = ahead * (admittance * e[:n, :n] - e[n:, :n])
        return admittance**-1


def assert_entries(found, expected, tolerance=EXACT):
    for i in range(expected.rows):
        for j in range(expected.cols):
            off = mpmath.mpc(complex(found[i, j])) - expected[i, j]
            if expected[i, j] == 0:
                assert off == 0
                continue
            assert abs(off) < tolerance * abs(expected[i, j]), (i, j)
            if expected[i, j].real == 0:
                assert off.real == 0
            else:
                assert abs(off.real) < tolerance * abs(expected[i, j].real), (i, j)


@pytest.mark.parametrize("which", range(0, 224, 13))
def test_one_film_is_the_line(which):
    inputs, (re, im) = cases()[which]
    sections = read(line.PressedLine(**inputs)).sections()
    r = [[0.25 * rs, 0.75 * rs] for rs in sections.r_ohm_per_m]
    z = stack.impedance(r, [[y] for y in sections.y_s_per_m], sections.length_m)
    assert z.shape == (1, 1)
    theirs = complex(line.impedance(line.PressedLine(**inputs)))
    assert abs(z[0, 0] - theirs) < 1e-12 * abs(theirs)
    assert abs(z[0, 0].real - theirs.real) < 1e-12 * theirs.real
    assert abs(z[0, 0].real - float(re)) < 1e-11 * float(re)
    assert abs(z[0, 0].imag - float(im)) < 1e-12 * abs(float(im))


FREQUENCIES = [1e-9, 1.1e3, 99.7e3, 1e9]
STACKS = {
    "equal": ([45e3, 45e3, 45e3], [7e-10, 7e-10]),
    "thesis": ([23e3, 67e3, 23e3], [7e-10, 3.5e-10]),
    "three films": ([23e3, 67e3, 1e3, 45e3], [7e-10, 3.5e-10, 5e-9]),
    "tracks 1e6 apart": ([45.0, 45e6, 45e3], [7e-10, 7e-10]),
    "films 1e6 apart": ([45e3, 20e3, 30e3], [7e-13, 7e-7]),
    "both, and crossed": ([45e6, 45.0, 45e3], [7e-7, 7e-13]),
    "ideal bottom": ([0.0, 67e3, 23e3], [7e-10, 3.5e-10]),
    "ideal middle": ([23e3, 0.0, 67e3], [7e-10, 3.5e-10]),
    "ideal top": ([23e3, 67e3, 0.0], [7e-10, 3.5e-10]),
    "ideal": ([0.0, 0.0, 0.0], [7e-10, 3.5e-10]),
}


LOSSES = {"lossless": (0.0, 0.0), "loss": (0.02, 0.0), "leak": (0.01, 1e-9)}
EVERY = list(product(STACKS, FREQUENCIES, LOSSES))


@pytest.mark.parametrize(("name", "f", "loss"), EVERY[::5])
def test_entries_are_exact(name, f, loss):
    tracks, films = STACKS[name]
    tan, leak = LOSSES[loss]
    y = [leak + (tan + 1j) * 2 * np.pi * f * c for c in films]
    pressed = [1.3 * v for v in y[:1]] + [1.1 * v for v in y[1:]]
    r = [tracks, [1.2 * v for v in tracks], tracks]
    lengths = np.array([0.03, 0.01, 0.06])
    lengths *= min(1.0, 30.0 / max(attenuation(r, [y, pressed, y], lengths), 1e-9))  # 60 nepers at 1 GHz are plenty
    found = stack.impedance(r, [y, pressed, y], lengths)
    assert_entries(found, exact(r, [y, pressed, y], lengths))


@pytest.mark.parametrize(("length", "f"), [(1e-9, 1e-9), (1e-3, 1.1e3), (30.0, 1.1e3)])
def test_any_length_is_exact(length, f):
    tracks, films = STACKS["thesis"]
    y = [2j * np.pi * f * c for c in films]
    assert_entries(stack.impedance([tracks], [y], [length]), exact([tracks], [y], [length]))


@pytest.mark.parametrize(("name", "f"), [("thesis", 1.0), ("three films", 1e9), ("films 1e6 apart", 1e9)])
def test_a_kilometre_solves_the_equation_of_the_endless_line(name, f):
    """W R W = Y, and Re W is positive definite."""
    tracks, films = STACKS[name]
    y = [2j * np.pi * f * c for c in films]
    w = stack.admittance([tracks], [y], [1e3 if f > 1 else 1e6])
    series, _ = ladder_matrices(tracks, y)
    residual = w @ np.array(series.tolist(), float) @ w - np.diag(y)
    scale = np.sqrt(np.abs(np.outer(y, y)))
    assert (np.abs(residual) / scale).max() < 1e-12
    assert np.linalg.eigvalsh(w.real / np.sqrt(scale)).min() > 0


@pytest.mark.parametrize("turn", [1j, 1.0, 1.0 + 1j], ids=["capacitors", "leaks", "both"])
def test_a_slow_film_beside_a_fast_one_keeps_its_digits(turn):
    """With a perfect track between them each film is a line of its own, here one 1e12 times slower than the other."""
    tracks, films = [45e6, 0.0, 45.0], [7e-7, 7e-13]
    y = [turn * 1e4 * c for c in films]
    length = 0.1 / abs(tracks[2] * y[1]) ** 0.5  # a tenth of a neper for the slow one, 1e5 for the fast one
    z = stack.impedance([tracks], [y], [length])
    for k, r in enumerate((tracks[0], tracks[2])):
        alone = complex(line.cascade([r], [y[k]], [length]))
        assert abs(z[k, k] - alone) < 1e-13 * abs(alone)
        assert abs(z[k, k].real - alone.real) < 1e-12 * alone.real
    assert (z[0, 1], z[1, 0]) == (0, 0)


def test_sections_of_no_length_and_cuts_change_nothing():
    tracks, films = STACKS["thesis"]
    y = [2j * np.pi * 1e4 * c for c in films]
    whole = stack.impedance([tracks], [y], [0.1])
    other = [1e9, 1.0, 5.0]
    cut = stack.impedance([other, tracks, other, tracks, other], [y] * 5, [0.0, 0.07, 0.0, 0.03, 0.0])
    assert cut == pytest.approx(whole, rel=1e-14, abs=0)
    assert cut.real == pytest.approx(whole.real, rel=1e-13, abs=0)


def nodal(r, y, length, cells, ends):
    """Impedance of a ladder of resistors and capacitors, by Kirchhoff's law at each node."""
    held = np.full(len(r) * (cells + 1), np.nan)
    held[list(ends)] = 1.0, 0.0
    _, current = potentials(*map(np.array, zip(*ladder(r, y, length, cells), strict=True)), held)
    return 1 / current[ends[0]]


@pytest.mark.parametrize("ends", [(1, 0), (2, 1), (2, 0)])
def test_a_ladder_of_tracks_tends_to_it_at_second_order(ends):
    """Nodes and Kirchhoff's law know nothing of loops: signs and ports are right."""
    tracks, films = STACKS["thesis"]
    y = [2j * np.pi * 1e6 * c for c in films]
    p = port(*ends, 2)
    z = complex(stack.impedance([tracks], [y], [0.1]) @ p @ p)
    errors = [nodal(tracks, y, 0.1, cells, ends) - z for cells in (20, 40, 80)]
    for part in (abs, lambda e: abs(e.real)):
        ratios = [part(a) / part(b) for a, b in pairwise(errors)]
        assert ratios == pytest.approx([4, 4], rel=0.05)
    assert abs(errors[-1]) < 1e-3 * abs(z)


def test_where_nothing_flows_the_impedance_is_infinite():
    for y, length in ([0j, 1e-9j], 0.1), ([1e-9j, 1e-9j], 0.0):
        z = stack.impedance([[1e4, 2e4, 3e4]], [y], [length])
        assert (z == complex(np.inf, 0.0)).all()


def test_direct_current_through_leaks():
    z = stack.impedance([[1e4, 2e4, 3e4]], [[1e-6, 2e-6]], [0.1])
    assert (z.imag == 0).all()
    assert_entries(z, exact([[1e4, 2e4, 3e4]], [[1e-6, 2e-6]], [0.1]))


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        (([[1e4, -1.0]], [[1j]], [0.1]), OutOfRange, "resistance"),
        (([[1e4, 1e4]], [[-1j]], [0.1]), OutOfRange, "admittance"),
        (([[1e4, 1e4]], [[1j]], [-0.1]), OutOfRange, "length"),
        (([[1e4, 1e4]], [[1j, 1j]], [0.1]), BadInput, "n \\+ 1 tracks"),
        (([[1e4, 1e4]], [[1j]], [0.1, 0.2]), BadInput, "2 lengths"),
        (([[[1e4, 2e4], 1e4]], [[1j]], [[0.1, 0.1, 0.1]]), BadInput, "do not broadcast"),
        (([[[1e4, 2e4], [1e4] * 3]], [[1j]], [0.1]), BadInput, "resistance in a section do not broadcast"),
        (([[1e200, 1e200]], [[1e200j]], [1e200]), OutOfRange, "extreme"),
    ],
)
def test_it_refuses_what_means_nothing(given, error, words):
    with pytest.raises(error, match=words):
        stack.impedance(*given)


@pytest.mark.parametrize(("upper", "lower"), [(0, 0), (3, 0), (1, -1)])
def test_it_refuses_ports_that_are_none(upper, lower):
    with pytest.raises(OutOfRange, match="no port"):
        port(upper, lower, 2)


FIRM, SOFT = unconfined(6e6), unconfined(1e6)
DOUBLE = Stack(
    0.1, 0.01, (Track(45e3, 1e-7), Track(20e3), Track(30e3, 2e-7)),
    (Film(6.9e-10, FIRM.capacitive_strain), Film(8e-10, SOFT.capacitive_strain, 0.01, 1e-9)),
)  # fmt: skip


def pressed(f, force, left, tip=0.01, grown=(0, 0)):
    """Z of DOUBLE in mpmath, and of DOUBLE with its capacitances times exp(grown)."""
    f, force, left, tip = (mpmath.mpf(v) for v in (f, force, left, tip))
    omega, width, length = 2 * mpmath.pi * f, mpmath.mpf(DOUBLE.width_m), mpmath.mpf(DOUBLE.length_m)
    away, under, loose, tight = [], [], [], []
    for track in DOUBLE.tracks:
        away.append(mpmath.mpf(track.r_ohm_per_m))
        under.append(away[-1] * (1 + mpmath.mpf(track.piezoresistance_per_pa) * force / (width * tip)))
    for film, modulus, by in zip(DOUBLE.films, (6e6, 1e6), grown, strict=True):
        turned = mpmath.mpc(film.tan_delta, 1) * omega * mpmath.mpf(film.capacitance_f_per_m) * mpmath.exp(by)
        loose.append(film.leak_s_per_m + turned)
        tight.append(film.leak_s_per_m + turned / (1 - force / (width * tip * modulus)))
    return exact([away, under, away], [loose, tight, loose], [left, tip, length - left - tip])


def slope(function, at):
    with mpmath.workdps(90):
        step = mpmath.mpf(10) ** -20
        return (function(at + step) - function(at - step)) / (2 * step)


@pytest.mark.parametrize(
    ("f", "force", "left"), [(1e-3, 6.0, 0.03), (99.7e3, 1e-6, 0.0), (99.7e3, 30.0, 0.09), (1e9, -3.0, 0.05)]
)
def test_derivatives_are_exact(f, force, left):
    """By force and, amid the stack, by position; by drift as far as the film's own entry: others hardly move."""
    found = DOUBLE.response(f, Press(force, left, 0.01))
    assert_entries(found.impedance_ohm, pressed(f, force, left))
    assert found.impedance_ohm == pytest.approx(DOUBLE.impedance(f, Press(force, left, 0.01)), rel=1e-14)
    assert_entries(found.by_force_ohm_per_n, slope(lambda v: pressed(f, v, left), mpmath.mpf(force)))
    if 0 < left < 0.09:
        assert_entries(found.by_position_ohm_per_m, slope(lambda v: pressed(f, force, v), mpmath.mpf(left)))
    for which, drift in enumerate(found.by_film_ohm):
        grown = slope(lambda v, k=which: pressed(f, force, left, grown=(v * (k == 0), v * (k == 1))), mpmath.mpf(0))
        off = [abs(complex(drift[i, j]) - grown[i, j]) for i, j in np.ndindex(2, 2)]
        assert max(off) < 1e-12 * abs(grown[which, which])


def test_without_a_change_of_characteristic_impedance_there_is_no_trace_of_position():
    """Strain 1/2 and tracks of twice the resistance: R and Y both double, R / Y stays."""
    films = tuple(Film(c, FIRM.capacitive_strain) for c in (6.9e-10, 3e-10))
    twin = Stack(0.1, 0.01, tuple(Track(r, 1 / 3e6) for r in (4e4, 2e4, 3e4)), films)
    found = twin.response(1e6, Press(300.0, 0.03, 0.01))
    assert (found.by_position_ohm_per_m == 0).all()
    assert (found.by_force_ohm_per_n != 0).all()


def test_responses_broadcast_over_frequency_force_and_position():
    f, force, left = (
        np.array([1.1e3, 99.7e3])[:, None, None],
        np.array([1.0, 6.0, 20.0])[:, None],
        np.linspace(0, 0.09, 4),
    )
    found = DOUBLE.response(f, Press(force, left, 0.01))
    assert found.by_position_ohm_per_m.shape == (2, 3, 4, 2, 2)
    one = DOUBLE.response(99.7e3, Press(6.0, float(left[2]), 0.01))
    for name in ("impedance_ohm", "by_force_ohm_per_n", "by_position_ohm_per_m"):
        assert getattr(found, name)[1, 1, 2] == pytest.approx(getattr(one, name), rel=1e-12)
        assert getattr(found, name)[1, 1, 2].real == pytest.approx(getattr(one, name).real, rel=1e-11)
    assert found.by_film_ohm[1][1, 1, 2] == pytest.approx(one.by_film_ohm[1], rel=1e-11)


@pytest.mark.parametrize(
    ("press", "error", "words"),
    [
        (Press(1.0, 0.095, 0.01), OutOfRange, "within the stack"),
        (Press(1.0, 0.03, 0.0), OutOfRange, "within the stack"),
        (Press(float("nan"), 0.03, 0.01), OutOfRange, "force is not finite"),
        (Press(200.0, 0.03, 0.01), OutOfRange, "touch"),
        (Press([1.0, 2.0], [0.0, 0.01, 0.02], 0.01), BadInput, r"frequency and press do not broadcast together: \(2,"),
    ],
)
def test_it_refuses_presses_that_cannot_be(press, error, words):
    with pytest.raises(error, match=words):
        DOUBLE.response(1e3, press)


def test_it_refuses_a_derivative_at_frequency_0_and_stacks_that_are_none():
    plain = Stack(0.1, 0.01, (Track(1e4), Track(1e4)), (Film(7e-10, FIRM.capacitive_strain),))
    assert plain.impedance(0.0) == np.inf
    with pytest.raises(OutOfRange, match="above 0"):
        plain.response(0.0, Press(1.0, 0.0, 0.01))
    with pytest.raises(OutOfRange, match="frequency"):
        plain.impedance(-1.0)
    with pytest.raises(OutOfRange, match="one track more"):
        Stack(0.1, 0.01, (Track(1e4),), (Film(7e-10, FIRM.capacitive_strain),))


def test_standard_errors_are_those_of_the_fisher_matrix():
    rng = np.random.default_rng(3)
    slopes, noise = rng.normal(size=(3, 7)) + 1j * rng.normal(size=(3, 7)), rng.uniform(0.5, 2.0, 7)
    fisher = (slopes.conj() / noise**2 @ slopes.T).real
    expected = np.sqrt(np.diag(np.linalg.inv(fisher)))
    assert multiline.standard_errors(slopes, noise) == pytest.approx(expected, rel=1e-12)
    scale = np.array([1e9, 1.0, 1e-9])
    assert multiline.standard_errors(slopes * scale[:, None], noise) == pytest.approx(expected / scale, rel=1e-12)


def test_what_readings_do_not_tell_apart_has_no_bound():
    slopes = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) + 0j
    errors = multiline.standard_errors(slopes, np.ones(3))
    assert np.isinf(errors).tolist() == [True, True, False, True]
    few = multiline.standard_errors(np.array([[1.0 + 0j], [1.0j], [2.0 + 0j]]), np.ones(1))
    assert np.isinf(few[[0, 2]]).all()
