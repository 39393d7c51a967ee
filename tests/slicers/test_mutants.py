"""Mutants of a good file: read or refused in one sentence; bench/gcode_fuzz.py has more of them."""

import pytest
from mutants import base, mutant, outcome


@pytest.mark.parametrize("numbers", [range(50), pytest.param(range(50, 300), marks=pytest.mark.nightly)], ids=len)
def test_mutants_are_read_or_refused_in_a_sentence(numbers, tmp_path):
    text, path = base(), tmp_path / "mutant.gcode"
    assert outcome(text, path) == "passed"
    found = [outcome(mutant(text, number), path) for number in numbers]
    assert found.count("refused") > len(numbers) / 3
    assert {"passed", "refused", "unreadable"} == set(found)
