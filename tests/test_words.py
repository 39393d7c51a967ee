"""Messages, docstrings, help texts and docs use the words of the field; docs/words.yaml lists the retired ones."""

import ast
import runpy
from collections import Counter
from pathlib import Path

import pytest

words = runpy.run_path(str(Path(__file__).parents[1] / "scripts" / "words.py"))
RETIRED = words["words"]()


def test_no_file_has_more_retired_words_than_it_had_and_the_list_of_those_shrinks():
    found, allowed = words["survey"](), words["allowed"]()
    counts = Counter(place.file for place in found)
    grown = [str(place) for place in found if counts[place.file] > allowed.get(place.file, 0)]
    assert not grown, "\n".join(grown)
    stale = {file: f"{counts[file]}, not {most}" for file, most in allowed.items() if counts[file] < most}
    assert not stale, f"run `python scripts/words.py --update`: {stale}"


@pytest.mark.parametrize(
    "text",
    [
        "How far a top comes down, by laws that solve no field",
        "apart by 7.1e-07 of their middle, 1e-05 wanted",
        "of the presses from 1 N on 90 % are known to 0.6 N",
        "The way\nback: force and position from impedance",
    ],
)
def test_a_sentence_of_the_old_kind_is_found(text):
    assert list(words["places"](text, "x.md", 1, RETIRED))


def test_a_place_has_its_line_and_the_better_word():
    (found,) = words["places"]("One.\nThe film gives\nway.", "docs/x.md", 10, RETIRED)
    assert str(found) == "docs/x.md:11: 'gives way'; write: deforms; is compressed"


def test_messages_are_literals_of_more_than_one_word():
    tree = ast.parse('def f():\n    """A docstring."""\n    return {"card": f"the film gives way at {1} N"}\n')
    assert [node.value for node in words["messages"](tree)] == ["A docstring.", "the film gives way at "]


def test_commands_in_a_page_are_not_read():
    page = "```sh\nsensorgen gives way\n```\nand `a house` but ```text\nhouse\n```"
    assert [one.found for one in words["places"](words["CODE"].sub("", page), "x.md", 1, RETIRED)] == ["house"]


def test_the_allow_list_does_not_grow(tmp_path, monkeypatch):
    update = words["update"]
    monkeypatch.setitem(update.__globals__, "ALLOWED", tmp_path / "allowed.yaml")
    assert update(Counter({"src/sensorgen/core/a.py": 2, "README.md": 1})) is None
    assert "src: 3, 2 before" in update(Counter({"src/sensorgen/core/b.py": 3}))
    assert update(Counter({"src/sensorgen/core/b.py": 1})) is None
    assert words["allowed"]() == {"src/sensorgen/core/b.py": 1}
