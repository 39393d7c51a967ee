"""First screens: 30 lines of 80 columns, verdict and numbers before the files, and what a sweep says of its sources."""

import json
import re
from dataclasses import replace
from pathlib import Path

import click

from sensorgen.core.bounds import Bounds
from sensorgen.core.document import text
from sensorgen.design.design import make
from sensorgen.prediction.loaded import PredictedPoint
from sensorgen.prediction.results import SCHEMA, Prediction
from sensorgen.prediction.sweep import Sweep
from sensorgen.workflows.build import build


def fits(out):
    lines = out.splitlines()
    return len(lines) <= 30 and max(map(len, lines)) <= 80


def test_first_screens_fit_a_terminal(run):
    said = run("build", "tri", "--dielectric", "0.2", "--no-cad")
    assert (said.code, fits(said.out)) == (1, True)
    assert said.out.splitlines()[-1].startswith("out/trix-d0.2: ")
    assert fits(run("predict", "tri", "--dielectric", "0.2").out)
    presses = ("predict", "tri", "--dielectric", "0.2", "--force", "0:6:1", "--position", "0:100:10")
    loaded = run(*presses).out
    assert fits(loaded)
    assert "this design" in loaded
    assert len(run(*presses, "--details").out.splitlines()) > 60
    assert len(run("predict", "tri", "--dielectric", "0.2", "--details").out.splitlines()) > 60


def test_verdict_and_numbers_come_before_any_file(tmp_path):
    screens = []

    def decided(built):
        screens.append((list(text(built.document())), [p for p in tmp_path.rglob("*") if p.is_file()]))

    made = build(make({"shape": "reference"}), tmp_path, cad=False, decided=decided)
    ((lines, files),) = screens
    assert files == []
    assert "files; " not in "".join(lines)
    assert list(text(made.document()))[: len(lines)] == lines


def test_no_change_is_tried_unless_that_is_asked_for(run, monkeypatch):
    tried = []
    monkeypatch.setattr("sensorgen.workflows.advice.advised", lambda *_: tried.append("changes"))
    words = ("build", "reference", "--dielectric", "0.1", "--budget", "9", "--length", "10", "--no-cad", "-o", "made")
    assert (run(*words).code, tried) == (0, [])
    assert len(list(Path("made").glob("*/check.json"))) == 1
    assert (run(*words, "--advise").code, tried) == (0, ["changes"])


def test_a_sweep_names_the_source_of_each_row_and_what_cannot_be_located():
    force, far = Bounds.of(0.5, "N"), Bounds.of(0.188, "m")
    head = (SCHEMA, "a", "0", "printed, estimated (PrusaSlicer, Arachne walls)", "predicted", 6.0, 0.05)
    known = Prediction(*head, capacitance=Bounds.of(1e-12, "F"), force_resolution=force, position_resolution=far)
    known = replace(known, identifiability=_of_100_mm())
    sliced = replace(known, body="printed, prusa 2.5.0, a.prusa.gcode")
    lines = list(text(Sweep("film", (0.1, 0.2), tuple(PredictedPoint("a", "", p) for p in (known, sliced))).document()))
    assert [line.split()[-1] for line in lines[1:3]] == ["estimated", "2.5.0"]
    assert all("cannot locate" in line and "188" not in line for line in lines[1:3])
    assert {"source: estimated (film 0.1)", "source: prusa 2.5.0 (film 0.2)"} <= set(lines)


def _of_100_mm():
    class Map:
        position_m = (0.0, 0.1)

        @staticmethod
        def typical():
            return None

    class Known:
        map, calibrated = Map, None

    return Known


def test_check_shows_its_verdict_before_changes_are_tried(run, monkeypatch):
    """Also where they are never tried to the end; JSON is one document all the same."""

    def asked(*_):
        click.echo("changes are tried now")

    monkeypatch.setattr("sensorgen.workflows.advice.advised", asked)
    said = run("check", "reference", "--dielectric", "0.1", "--budget", "9")
    assert re.search(r"^[A-Z ]+  reference.*^capacitance .*changes are tried now", said.out, re.DOTALL | re.MULTILINE)
    assert said.out.count("capacitance ") == 1
    assert json.loads(
        run("check", "reference", "--dielectric", "0.1", "--budget", "9", "--json").out.partition("now\n")[2]
    )["verdict"]
