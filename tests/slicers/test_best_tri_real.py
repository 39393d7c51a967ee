"""The winner of bench/best-tri.yaml, sliced for real: what was searched by the estimate is what is printed."""

from pathlib import Path

import pytest

from sensorgen.asprinted import printed
from sensorgen.checks.review import review
from sensorgen.design.design import load
from sensorgen.export.gcode.check import check
from sensorgen.export.slicing import alone, sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.slices import reviewed

BEST = Path(__file__).parents[2] / "docs" / "best-tri.yaml"


def test_the_best_tri_prints_as_estimated(tmp_path, program):
    """Two film layers between the electrodes, no error, and the capacitance of the estimate within 5 %."""
    program("prusa-slicer", "prusa-slicer")
    design = load(BEST)
    assert not [f for f in review(design).findings if f.severity == "error"]
    assert design.params.dielectric_mm == pytest.approx(2 * design.layers.layer_mm)
    made = sliced([alone(design)], "prusa", tmp_path)
    source = f"PrusaSlicer {made.version}"
    real = printed.nominal(design, made.lines, source)
    assert not [f for f in real.findings() if f.severity == "error"]
    assert printed.gap_mm(real.cell.scene) >= 2 * design.layers.layer_mm - 1e-6
    body = bodies.sliced(design, lambda: real, source, made.ready.read_bytes())
    first = [rest_state(each, ranges=False).capacitance.value for each in (body, bodies.estimated(design, "arachne"))]
    assert first[0] == pytest.approx(first[1], rel=0.05)


@pytest.mark.parametrize(
    ("name", "tools", "lines"),
    [
        ("locates-tri.yaml", {3, 4}, ["G28", "G32"]),
        # As PrusaSlicer's bundle for the XL: model, homing, and a mesh of the bed before anything is printed.
        pytest.param(
            "buyable-tri.yaml", {0, 1}, ["M190 S45", 'M862.3 P "XL"', "G28", "G29 P1", "G29 A", "M109 S225 T0"],
            marks=pytest.mark.nightly,
        ),
    ],
)  # fmt: skip
def test_what_the_pages_print_has_no_warning(name, tools, lines, tmp_path, program, monkeypatch):
    """Verdict PRINT on a real slice, and a file that the printer's check accepts, homed and heated in this order."""
    program("prusa-slicer", "prusa-slicer")
    monkeypatch.setenv("SENSORGEN_SLICER", "prusa")
    monkeypatch.chdir(tmp_path)
    design = load(BEST.with_name(name))
    assert reviewed(design).verdict == "PRINT"
    made = sliced([alone(design)], "prusa", tmp_path)
    found = check(made.ready, design.machine)
    assert found.errors(strict=True) == []
    assert {tool.tool for tool in found.tools} == tools
    written = [line.partition(";")[0].strip() for line in made.ready.read_text("utf-8").splitlines()]
    places = [written.index(line) for line in lines]
    assert places == sorted(places)
