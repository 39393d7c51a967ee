"""Ranges of predicted quantities."""

from itertools import product

import pytest

from sensorgen.core.bounds import Bounds, Interval


def test_the_range_has_every_error_at_its_worst():
    """Among all products of relative ends, one of each error; an interval beside the value counts as reaching it."""
    parts = {"model": Interval(90.0, 110.0), "print": Interval(70.0, 105.0), "material": Interval(120.0, 150.0)}
    found = Bounds.of(100.0, "F", **parts)
    ends = [100.0 * a * b * c for a, b, c in product((0.9, 1.0, 1.1), (0.7, 1.0, 1.05), (1.0, 1.2, 1.5))]
    assert (found.lower, found.upper) == pytest.approx((min(ends), max(ends)))
