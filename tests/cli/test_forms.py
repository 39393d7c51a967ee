"""One renderer: each prediction as text, JSON, CSV and Markdown, on the terminal or in a file, of the same result."""

import csv
import io

import pytest

pytestmark = pytest.mark.usefixtures("shared_cache")
COMMANDS = {
    "cell": ("cell", "reference"),
    "cells": ("cell", "reference", "--sweep", "eps_x60=2,4", "--jobs", "1"),
    "compress": ("compress", "reference", "--model", "springs", "--stress", "10,20"),
    "predict": ("predict", "reference", "--force", "0:6:3", "--position", "50"),
    "sheet": ("sheet", "reference", "--size", "60x60", "--contacts", "one-edge", "--frequencies", "100kHz"),
    "stack": ("stack", "double", "--frequencies", "100kHz"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_all_forms(run, tmp_path, name):
    words = COMMANDS[name]
    text, markdown = run(*words), run(*words, "--markdown")
    assert (text.code, markdown.code) == (0, 0)
    assert max(map(len, text.out.splitlines())) <= 80
    assert "\n|" in markdown.out or "\n- " in markdown.out
    assert run(*words, "--json").json
    head, *rows = csv.reader(io.StringIO(run(*words, "--csv").out))
    assert rows
    assert {len(row) for row in rows} == {len(head)}
    assert all(head)
    if name in ("cells", "predict"):  # the others go the same way
        said = run(*words, "--csv", "-o", "table.csv")
        assert (said.code, said.out) == (0, "table.csv\n")
        assert next(csv.reader(io.StringIO((tmp_path / "table.csv").read_text()))) == head


def test_one_form_at_a_time(run):
    said = run(*COMMANDS["cell"], "--json", "--markdown")
    assert (said.code, said.out) == (2, "")
    assert "--json and --markdown at once; expected one of them" in said.line


@pytest.mark.parametrize(
    "words", ["build tri", "slice tri", "batch plan.yaml", "optimise tri", "import a.step", "demo lab"]
)
def test_o_of_a_command_that_writes_a_folder_is_that_folder(run, tmp_path, words):
    assert "--out: 'd.gcode' is the name of a file; expected a folder" in run(*words.split(), "-o", "d.gcode").refusal
    assert not (tmp_path / "d.gcode").exists()
