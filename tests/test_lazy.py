"""Lazy sequences are what lists of the same members are."""

from hypothesis import given
from hypothesis import strategies as st

from sensorgen.core.lazy import Lazy


@given(st.lists(st.integers(0, 99), max_size=12), st.data())
def test_a_choice_of_a_choice_is_that_of_a_list(places, data):
    members = [k * k for k in places]
    lazy = Lazy(lambda k: k * k, places)
    odd = [each for each in members if each % 2]
    assert list(lazy.where(lambda each: each % 2)) == odd
    which = data.draw(st.lists(st.sampled_from(range(len(odd))), max_size=5)) if odd else []
    assert list(lazy.where(lambda each: each % 2).at(which)) == [odd[k] for k in which]
    assert list(lazy[1:].map(str)) == [str(each) for each in members[1:]]
