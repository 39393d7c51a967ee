"""The list of what is numbered in the thesis is whole, and all that is computed is used."""

import inspect
import re

import pytest

from sensorgen.core import lazy as registry
from sensorgen.core.errors import BadInput
from sensorgen.verification.thesis import checks
from sensorgen.verification.thesis.items import CHAPTERS, ThesisItem, chapter

# Counted in the thesis, chapter by chapter: the last number of each kind. 2.7, 3.6 and 6.24 are counted though the
# copy at hand lacks their captions or numbers, and 3.55 though nothing stands beside it.
LAST = {
    "equation": {"2": 25, "3": 55, "4": 1, "5": 1, "6": 3, "B": 54, "C": 5},
    "figure": {"1": 5, "2": 16, "3": 11, "4": 4, "5": 11, "6": 33, "7": 3, "B": 6},
    "table": {"1": 1, "3": 3, "4": 2, "5": 1, "C": 1, "D": 1},
}
ITEMS = [(name, kind, item) for name in CHAPTERS for kind, item in chapter(name).items()]


def test_every_number_is_there_once():
    expected = [
        (kind, f"{name}.{k}")
        for name in CHAPTERS for kind, last in LAST.items() for k in range(1, last.get(name, 0) + 1)
    ]  # fmt: skip
    assert [(kind, item.number) for _, kind, item in ITEMS if kind in LAST] == expected


def test_each_says_what_it_is_and_why_it_is_not_judged():
    for _, _, item in ITEMS:
        assert item.says.endswith("."), item
        assert len(item.says.split()) < 30, item
        assert not (item.lost and item.uncovered), item
        assert item.check or item.lost or item.uncovered, item
        assert bool(item.off) == bool(item.because) == bool(item.within), item
        assert (item.tolerance > 1e-6) == bool(item.why_tolerance), item
        assert not item.given or item.check, item


def test_claims_are_numbered_by_their_section():
    claims = [(name, item.number) for name, kind, item in ITEMS if kind == "claim"]
    assert len(set(claims)) == len(claims) == 23
    assert all(re.fullmatch(rf"{name}(\.\d+)*[a-z]", number) for name, number in claims)


def test_every_check_exists_and_every_function_is_a_check():
    used = {item.check for _, _, item in ITEMS} - {""}
    there = {
        f"{name}.{function}"
        for name in registry.names(checks)
        for function, value in inspect.getmembers(registry.load(checks, name), inspect.isfunction)
        if value.__module__ == f"sensorgen.verification.thesis.checks.{name}" and not function.startswith("_")
    }
    assert used == there


@pytest.mark.parametrize("check", ["line", "line.Current", "os.path.join", "__import__.x"])
def test_a_check_is_a_module_and_a_function(check):
    from sensorgen.core.records import checked

    with pytest.raises(BadInput, match="check"):
        checked(ThesisItem, {"number": "1.1", "says": "x", "check": check})
