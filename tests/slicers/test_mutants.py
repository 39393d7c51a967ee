"""Mutants of a good file: read or refused in one sentence; bench/gcode_fuzz.py has more of them."""

from mutants import base, mutant, outcome


def test_mutants_are_read_or_refused_in_a_sentence(tmp_path):
    text, path = base(), tmp_path / "mutant.gcode"
    assert outcome(text, path) == "passed"
    found = [outcome(mutant(text, number), path) for number in range(300)]
    assert found.count("refused") > 100
    assert {"passed", "refused", "unreadable"} == set(found)
