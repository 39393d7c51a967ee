"""The winner of bench/best-tri.yaml, sliced for real: what was searched by the estimate is what is printed."""

from pathlib import Path

import pytest

from sensorgen.asprinted import printed
from sensorgen.checks.review import review
from sensorgen.design.design import load
from sensorgen.export.slicing import alone, sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.rest_state import rest_state

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
    first = [rest_state(each).capacitance.value for each in (body, bodies.estimated(design, "arachne"))]
    assert first[0] == pytest.approx(first[1], rel=0.05)
