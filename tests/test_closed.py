"""Pressures beyond those that a cell can be solved for: the closed cell as a limit, on paper."""

from dataclasses import replace
from math import log

import numpy as np
import pytest

from sensorgen.analysis.plots.results import compression_figure
from sensorgen.core.bounds import Interval
from sensorgen.design.design import make
from sensorgen.models import closed
from sensorgen.prediction import bodies, compression
from sensorgen.prediction.capacitance import Answer
from sensorgen.prediction.compression import BoundaryConditions, PressQuestion
from sensorgen.prediction.compression_law import law_of
from sensorgen.prediction.mesh_ladder import drawn
from sensorgen.scene.scene import Body, Scene, box

EPS0, X60, E_PA = 8.8541878128e-12, 4.68, 6e6
# A tooth of tri 0.2 as sliced, half a period of 1 mm: widths, and distances of the electrodes there [mm]
WIDTHS, HEIGHTS = (0.17, 0.069, 0.101, 0.1, 0.56), (0.3, 0.4, 0.5, 0.6, 0.7)


def staircase(films_mm):
    """Steps of an upper electrode over as many of a film, with air between."""
    bodies, x = [Body("bottom", "etpu", (box(0, 1, 0, 1, 0, 0.3),), "bottom")], 0.0
    for width, height, film in zip(WIDTHS, HEIGHTS, films_mm, strict=True):
        ends = x, round(x + width, 6)
        bodies.append(Body("top", "etpu", (box(*ends, 0, 1, round(0.3 + height, 6), 1.3),), "top"))
        bodies.append(Body("film", "x60", (box(*ends, 0, 1, 0.3, round(0.3 + film, 6)),), ""))
        x = ends[1]
    return Scene(tuple(bodies), (1, 1, 1.3))


@pytest.mark.parametrize(
    ("films_mm", "per_mm"),
    [
        # Air 0.017 + 0.01 + 0.112 = 0.139: 0.17 / 0.161 + 0.069 / 0.261 + 0.101 / 0.361 + 0.1 / 0.461 + 0.56 / 0.561
        ((0.2, 0.4, 0.5, 0.5, 0.5), 2.815184),
        ((0.3, 0.3, 0.3, 0.3, 0.3), 1 / 0.3),  # a film of one thickness has that of a plate
    ],
)
def test_a_closed_cell_is_that_on_paper(films_mm, per_mm):
    """Without air the steps stand over the film's volume; at 0.7625 E / 3 a free column is thinned to 0.8."""
    closed_f, pressed_f = (
        closed.most_f_per_m2(staircase(films_mm), {"x60": X60, "etpu": 1}, E_PA, p) for p in (0.0, 0.7625 * E_PA / 3)
    )
    assert closed_f == pytest.approx(EPS0 * X60 * per_mm * 1e3, rel=1e-5)
    assert pressed_f / closed_f == pytest.approx(1 / 0.8**2, rel=1e-9)


@pytest.fixture
def _ends_at_10_kpa(monkeypatch, tmp_path):
    """Sections of which the solution ends there."""
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    from sensorgen.models import press2d

    def ends_at_10_kpa(cell, solids, stress_pa, *given, press=press2d.press, **more):
        solution = press(cell, solids, [p for p in stress_pa if p <= 1e4], *given, **more)
        return replace(solution, faults=("converged up to 10 kPa",)) if stress_pa[-1] > 1e4 else solution

    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(press2d, "press", ends_at_10_kpa)


@pytest.mark.usefixtures("_ends_at_10_kpa")
def test_a_cell_of_which_the_solution_ends_has_an_interval(monkeypatch):
    """No further rise at least, the closed cell at most: on paper, the drawn cell without its air."""
    from sensorgen.prediction import compression_law as celllaw

    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 5e3, 1e4))
    cell = make({"shape": "tri", "parameters": {"period_mm": 2.5, "dielectric_mm": 0.2}})
    law = law_of(cell, Answer("columns", Interval(1e-10, 2e-10), ()), "solved", until_pa=1.1e6)
    least, most = law.others
    *_, before, last, bend, end = law.compression.stress_pa
    assert (before, last, bend, end) == (5e3, 1e4, pytest.approx(1e4, rel=1e-3), 1.1e6)
    assert least.ratio[-1] == least.ratio[-2] < law.compression.ratio[-2]
    assert law.compression.ratio[-2] < law.compression.ratio[-1] <= most.ratio[-1]  # its last slope reaches farther
    assert 1.5 < most.ratio[-1] < 4.5
    thinned = 1 - most.capacitive_strain(np.array([4e5, 1.1e6]))[0]
    assert thinned[1] / thinned[0] > (0.8463 / 0.9376) ** 2 * 0.99  # closed at 400 kPa, too: free columns as below
    assert "from 10 to 1100 kPa the rise of C lies between none more" in law.doubts[-1]
    assert {top.stress_pa[-1] for top in law.tops.values()} == {1.1e6}
    answer = Answer("columns", Interval(1e-10, 2e-10), ())
    otherwise = celllaw.at_a_few_pressures(cell, drawn(cell), answer, 1.1e6)  # ways to print differ, and end as early
    assert otherwise.compression.stress_pa == (0.0, 4e3, 8e3, 1e4, pytest.approx(1e4, rel=1e-3), 1.1e6)
    usual = law_of(cell, Answer("columns", Interval(1e-10, 2e-10), ()), "solved", until_pa=1e4)
    assert (usual.of_mesh, usual.compression.stress_pa[-1]) == ((), 1e4)


@pytest.mark.usefixtures("_ends_at_10_kpa")
def test_compress_has_bounds_beyond_the_last_solved_pressure():
    """At least what was solved last; at most the closed cell, its air of 0.13 mm in the mean taken from each distance.

    Under cogs that is from 0.2 - 0.13 to 0.7 - 0.13 mm, else 0.7 - 0.13 mm; 3 p / E = 0.2 and 0.55 thin a free column
    to 0.9376 and 0.8463.
    """
    cell = make({"shape": "tri", "parameters": {"period_mm": 2.5, "dielectric_mm": 0.2}})
    question = PressQuestion((0.0, 5.0, 10.0, 400.0, 1100.0), BoundaryConditions())
    result = compression.answer(bodies.drawn(cell), question)
    closed_f = EPS0 * X60 * 1e3 * (log(0.57 / 0.07) / 0.5 + 1 / 0.57) / 2
    assert (result.converged_kpa, result.faults, result.stress_kpa) == (10.0, (), question.stress_kpa)
    assert result.displacement_um[3:] == (None, None)
    assert result.lower_f_per_m2[2] == result.lower_f_per_m2[3] == result.lower_f_per_m2[4]
    assert result.upper_f_per_m2[3:] == pytest.approx([closed_f / 0.9376**2, closed_f / 0.8463**2], rel=2e-3)
    assert result.largest_rise_error > 0.9
    rise, off = (np.array(values[3:]) for values in (result.rise_f_per_m2, result.rise_error_f_per_m2))
    assert (rise + off >= np.array(result.upper_f_per_m2[3:]) - result.upper_f_per_m2[0]).all()
    assert "from 10 to 1100 kPa the cell was not solved" in result.doubts[0]
    assert [len(panel.content[0].x) for panel in compression_figure(result).choices[""]] == [3, 5]
    assert any("converged up to 10 kPa, bounds up to 1100 kPa" in str(part) for part in result.document())
