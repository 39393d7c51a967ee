"""Fringe of crossing tracks against finite volumes in three dimensions, that share no code with the cross-sections."""

from itertools import pairwise

import numpy as np
import pytest
from resistors import potentials, sides

from sensorgen.prediction.array.model import CrossingSection, fringe

EPS = {"film": 4.7, "cell": 5.0, "beside": 4.7, "solid": 4.7, "cover": 4.7, "air": 1.0}
AIR = EPS | {"beside": 1.0}


def crossing(track=8.0, space=2.0, eps=EPS):
    return CrossingSection((track, space), (track, space), 0.2, 0.5, 0.3, 0.4, 0.4, eps)


def graded(*ends, least=0.05, most=0.6):
    """Faces of cells that grow away from every end."""
    faces = [ends[0]]
    for a, b in pairwise(ends):
        steps, left = [], b - a
        n = 1
        while 2 * least * (1.4**n - 1) / 0.4 < left and least * 1.4 ** (n - 1) < most:
            n += 1
        half = np.minimum(least * 1.4 ** np.arange(n), most)
        flat = max(0, int((left - 2 * half.sum()) / most))
        steps = np.concatenate([half, np.full(flat, most), half[::-1]])
        faces += (a + np.cumsum(steps * left / steps.sum())).tolist()
    return np.array(faces)


def charges(faces, eps, held):
    """Charge of each conductor, by cells' permittivities and conductors' potentials (nan: none); walls without flux."""
    wide, edges = np.meshgrid(*map(np.diff, faces), indexing="ij"), []
    volume = np.prod(wide, axis=0)
    number = np.arange(eps.size).reshape(eps.shape)
    for axis in range(3):
        half = np.where(np.isfinite(held), 0.0, wide[axis] / 2 / eps)
        ohm, (area, _) = sum(sides(half, axis)), sides(volume / wide[axis], axis)
        edges.append([of[ohm > 0] for of in (*sides(number, axis), area / np.where(ohm > 0, ohm, 1.0))])
    return potentials(*map(np.concatenate, zip(*edges, strict=True)), held.ravel())[1].reshape(eps.shape)


def solved(of, steps=0.05):
    """Capacitance of a crossing over that of its own area, of a quarter of it."""
    (wx, sx), (wy, sy) = of.column, of.row
    x, y = graded(0, wx / 2, (wx + sx) / 2, least=steps), graded(0, wy / 2, (wy + sy) / 2, least=steps)
    film, cell, e, cover, base = of.film, of.cell, of.electrode, of.cover, of.base
    ends = np.cumsum([0, 2, base, e, film, cell, e, cover, 2.0])
    z = graded(*ends, least=steps)
    mx, my, mz = ((f[1:] + f[:-1]) / 2 for f in (x, y, z))
    eps = np.ones((len(mx), len(my), len(mz)))
    over, under = (mx < wx / 2)[:, None, None], (my < wy / 2)[None, :, None]
    layer = np.searchsorted(ends, mz) - 1
    values = [1.0, of.eps["cover"], of.eps["solid"], of.eps["film"], 0.0, of.eps["solid"], of.eps["cover"], 1.0]
    eps = eps * np.array(values)[layer]
    eps = np.where((layer == 4) & over, of.eps["cell"], np.where((layer == 4) & ~over, of.eps["beside"], eps))
    held = np.where((layer == 2) & under, 0.0, np.where((layer == 5) & over, 1.0, np.nan) + 0 * eps)
    q = charges((x, y, z), eps, held)
    return float(q[held == 1].sum()) / (wx * wy / 4 / (film / of.eps["film"] + cell / of.eps["cell"]))


@pytest.mark.parametrize("of", [crossing(eps=AIR), crossing(4.0, 1.0)], ids=["air", "5 mm"])
def test_the_fringe_is_that_of_three_dimensions(of):
    """Both ways multiply: corners are worth 0.3 % of the capacitance. Finite volumes of two steps."""
    coarse, fine = solved(of, 0.1), solved(of, 0.05)
    true = fine + (fine - coarse) / 2
    assert 1 + fringe(of).share == pytest.approx(true, rel=0.005)


def test_the_rise_is_diluted_as_in_three_dimensions():
    of = crossing()
    pressed = of.at(1.05)
    film, cell = of.film / 4.7, of.cell / 5.0
    assert (film + cell) / (pressed.film / 4.7 + pressed.cell / 5.0) == pytest.approx(1.05)
    gain = (1.05 * solved(pressed, 0.1) / solved(of, 0.1) - 1) / 0.05
    assert fringe(of).gain == pytest.approx(gain, abs=0.03)
