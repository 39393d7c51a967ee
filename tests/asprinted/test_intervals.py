from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sensorgen.asprinted.intervals import distances_mm, length_mm, united, within, without

whole = st.integers(0, 40)
runs = st.lists(st.tuples(whole, whole).filter(lambda r: r[0] < r[1]), max_size=8)


def cells(found):
    """The same set as a mask of unit cells: what sets of whole numbers are, counted."""
    mask = np.zeros(40, bool)
    for a, b in found:
        mask[int(a) : int(b)] = True
    return mask


@given(runs, runs)
def test_sets_of_whole_numbers_are_what_counting_cells_says(a, b):
    one, other = united(a), united(b)
    assert (cells(one) == cells(a)).all()
    assert all(p[1] < q[0] for p, q in pairwise(one))
    assert (cells(without(one, other)) == (cells(a) & ~cells(b))).all()
    assert length_mm(one) == cells(a).sum()


@given(runs, whole, whole)
def test_within_two_places(a, low, high):
    outside = np.ones(40, bool)
    outside[low:high] = False
    assert (cells(within(united(a), low, high)) == (cells(a) & ~outside)).all()


def test_runs_that_are_near_become_one():
    assert united([(0, 1), (1.09, 2)], 0.1) == ((0, 2),)
    assert united([(0, 1), (1.11, 2)], 0.1) == ((0, 1), (1.11, 2))


def test_slivers_are_dropped():
    assert without(((0, 1),), ((1e-7, 1),)) == ()
    assert within(((0, 1),), 1 - 1e-7, 2) == ()


@given(runs.filter(bool), st.lists(st.floats(-9, 49), max_size=20))
def test_distances_to_the_nearest_run(some, places):
    found = distances_mm(united(some), np.array(places))
    assert found.tolist() == [min(max(a - p, p - b, 0.0) for a, b in some) for p in places]
