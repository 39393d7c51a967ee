"""Right words: every option reaches the design, and every command says what it found."""

import json
import re
from pathlib import Path

import pytest

from sensorgen.cli import printing
from sensorgen.cli.commands import KINDS
from sensorgen.core.errors import BadInput
from sensorgen.design.design import Design, name_of

DESIGNS = Path(__file__).parents[2] / "designs"
TRI = {
    "--dielectric 0.2mm": {"dielectric_mm": 0.2},
    "--dielectric 200um": {"dielectric_mm": 0.2},
    "--dielectric 200µm": {"dielectric_mm": 0.2},
    "--dielectric .02cm": {"dielectric_mm": 0.2},
    "--along y": {"along": "y"},
    "--size 50x20": {"length_mm": 50.0, "width_mm": 20.0},
    "--size 5cmX20": {"length_mm": 50.0, "width_mm": 20.0},
    "--size 50×20mm": {"length_mm": 50.0, "width_mm": 20.0},
    "--length 50 --width 20": {"length_mm": 50.0, "width_mm": 20.0},
    "--period 2.5": {"period_mm": 2.5},
    "--hang-height 0.6 --lower-height 0.3": {"hang_height_mm": 0.6, "lower_height_mm": 0.3},
    "--electrode 0.4 --isolation 0.2": {"electrode_mm": 0.4, "isolation_mm": 0.2},
    "--set period_mm=2.5mm": {"period_mm": 2.5},
    "--set parameters.period_mm=2500um": {"period_mm": 2.5},
    "--set along=y": {"along": "y"},
    "--period 3 --set period_mm=2.5": {"period_mm": 2.5},
}
OTHER = {
    "--orientation upside-down": {"orientation": "upside-down"},
    "--support bvoh": {"materials.support": "bvoh"},
    "--support none": {"materials.support": None},
    "--material dielectric=x60@thesis-4.1": {"materials.dielectric": "x60@thesis-4.1", "materials.film": "x60"},
    "--material electrode=etpu@thesis-3.2": dict.fromkeys(
        ("materials.top_electrode", "materials.bottom_electrode"), "etpu@thesis-3.2"
    ),
    "--material film=x60 --material isolation=x60": {"materials.film": "x60"},
    "--quality extrafine": {"quality": "extrafine"},
    "--printer prusa-xl5": {"printer": "prusa-xl5"},
    "--nozzle 0.25": {"nozzle_mm": 0.25},
    "--nozzle 250um": {"nozzle_mm": 0.25},
    "--set nozzle_mm=0.25": {"nozzle_mm": 0.25},
    "--infill 80": {"infill.x60.percent": 80.0, "infill.x60.pattern": None},
    "--infill 80% --infill-pattern grid": {"infill.x60.percent": 80.0, "infill.x60.pattern": "grid"},
    "--infill etpu=90": {"infill.etpu.percent": 90.0},
    "--set infill.x60.percent=80": {"infill.x60.percent": 80.0},
    "--tool x60=2 --tool etpu=1": {"tools.x60": 2, "tools.etpu": 1},
    "--set tools.x60=2": {"tools.x60": 2},
    "--shrinkage 0.2": {"shrinkage": 0.2},
    "--name my-sensor_1.0": {"name": "my-sensor_1.0"},
    "--set name=mine": {"name": "mine"},
}


@pytest.fixture
def taken(monkeypatch, run):
    """The design that a command line stands for."""

    def design(*words):
        got = []
        monkeypatch.setattr(printing.check_command, "work", lambda design, **_: got.append(design) or 0)
        assert run("check", *words).clean
        return got[0]

    return design


@pytest.mark.parametrize(("words", "expected"), TRI.items(), ids=TRI)
def test_option_of_the_shape(taken, words, expected):
    params = taken("tri", *words.split()).params
    assert {key: getattr(params, key) for key in expected} == expected


@pytest.mark.parametrize(("words", "expected"), OTHER.items(), ids=OTHER)
def test_option_of_every_design(taken, words, expected):
    data = taken("tri", *words.split()).model_dump()
    for path, value in expected.items():
        found = data
        for part in path.split("."):
            found = found[part]
        assert found == value


WHOLE = """
name: whole
shape: tri
parameters: {period_mm: 2.5, along: y, dielectric_mm: 1e-1}
material_values: {x60: {relative_permittivity: 3.0}}
materials: {film: x60@thesis-4.1, support: bvoh}
printer: prusa-xl5
quality: extrafine
nozzle_mm: 0.25
tools: {x60: 3}
infill: {x60: {percent: 80, pattern: grid}}
profile: {walls: classic}
own: {}
orientation: upside-down
shrinkage: 0.02
tip: {shape: hertz, width_mm: 5, block: stiff}
effects: {temperature_k: 3}
leads: {capacitance_pf: 2.5, guard: driven}
waivers:
  - {rule: 5-width, body: film, reason: seen on the bench}
  - {rule: "9", reason: seen on the bench}
"""


def test_a_file_with_every_key(taken, tmp_path):
    (tmp_path / "any.yaml").write_text(WHOLE)
    design = taken("any.yaml")
    others = {"bodies", "border", "cell", "geometry", "regions"}  # of imports and arrays: their own tests
    assert set(Design.model_fields) - others == set(re.findall(r"(?m)^(\w+):", WHOLE))
    assert (design.name, design.params.dielectric_mm, design.tools) == ("whole", 0.1, {"x60": 3})
    assert design.material("x60").value("relative_permittivity", "thesis-4.1").value == 3.0
    assert [w.rule for w in design.waivers] == ["5-width", "9"]
    assert (design.tip.width_mm, design.tip.block, design.effects.temperature_k) == (5.0, "stiff", 3.0)
    assert (design.leads.capacitance_pf, design.leads.guard) == (2.5, "driven")


def test_a_file_is_named_by_itself_until_an_option_changes_it(taken, tmp_path):
    (tmp_path / "mine.yaml").write_text("shape: tri\nparameters: {period_mm: 2.5}\nmaterials: {support: bvoh}\n")
    assert taken("mine.yaml").name == "mine"
    assert taken("mine.yaml", "--period", "2.5").name == "mine"  # nothing new
    changed = taken("mine.yaml", "--dielectric", "0.1", "--infill", "80")
    assert changed.name.startswith("trix-d0.1-period2.5-")
    assert changed.params.period_mm == 2.5
    assert changed.materials.support == "bvoh"
    assert taken("mine.yaml", "--dielectric", "0.1", "--name", "other").name == "other"
    assert taken("mine.yaml", "--support", "none").materials.support is None


@pytest.mark.parametrize("path", sorted(DESIGNS.rglob("*.yaml")), ids=lambda p: p.stem)
def test_the_designs_of_the_thesis_are_named_as_their_files(taken, path):
    design = taken(path)
    assert design.name == path.stem
    assert path.stem == name_of(design) or path.stem == "reference"


def test_json_of_check_holds_the_findings(run):
    said = run("check", "tri", "--json")
    data = json.loads(said.out)
    assert data["counts"]["warning"] == sum(f["severity"] == "warning" for f in data["findings"]) > 0
    of = {"rule", "severity", "body", "message", "advice", "value_mm", "limit_mm", "margin_mm"}
    assert of <= set(data["findings"][0])
    assert said.err == ""


def test_json_of_build(run, tmp_path):
    data = run("build", "tri", "--no-cad", "--json").json
    folder = tmp_path / data["folder"]
    assert sorted(data["files"]) == sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    assert data["findings"] == json.loads((folder / "check.json").read_text())["findings"]
    assert data["prediction"]["capacitance"]["lower"] > 0


def test_json_of_a_refused_build(run):
    said = run("build", "tri", "--dielectric", "0", "--no-cad", "--json")
    data = json.loads(said.out)
    assert (said.code, data["folder"], data["findings"][0]["rule"]) == (1, None, "1-short")
    assert "nothing was written" in said.line


def test_predict_without_an_answer_says_why(run):
    said = run("predict", "tri", "--dielectric", "0", "--drawn")
    assert said.code == 1
    assert said.out.startswith("trix-d0: ")
    for words in (said.out, said.err):
        assert "the electrodes touch: the capacitance grows without bound" in " ".join(words.split())


def test_draw(run, tmp_path):
    assert run("draw", "tri").out == "trix-d0.2.svg\n"
    drawn = (tmp_path / "trix-d0.2.svg").read_text("utf-8")
    assert run("draw", "tri", "-o", "-").out == drawn
    assert run("draw", "tri", "--output", "some/where.svg").code == 0
    assert (tmp_path / "some/where.svg").read_text("utf-8") == drawn
    assert drawn.startswith("<svg")
    refused = run("draw", "tri", "-o", "x.png")
    assert (refused.code, refused.line) == (
        2, "sensorgen: --output x.png: the drawing is SVG, or a page of layers; expected a name in .svg or .html, or - "
        "to print the SVG",
    )  # fmt: skip


@pytest.mark.usefixtures("unpredicted")
def test_waived_findings_do_not_stop_a_build(run, tmp_path):
    (tmp_path / "short.yaml").write_text(
        "shape: tri\nparameters: {dielectric_mm: 0}\nwaivers: [{rule: 1-short, reason: a short on purpose}, "
        "{rule: 7-printed, reason: the gap is known}]\n"
    )
    said = run("build", "short.yaml", "--no-cad", "--details").clean
    assert "accepted: a short on purpose" in " ".join(said.out.split())


def test_a_share_may_be_given_in_percent():
    share = KINDS["share"]
    assert share.convert("20%", None, None) == share.convert("0.2", None, None) == 0.2
    with pytest.raises(BadInput, match=r"expected 0\.2 or 20%"):
        share.convert("much", None, None)
