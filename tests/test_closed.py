"""Pressures beyond those that a cell can be solved for: the closed cell as a limit, on paper."""

from dataclasses import replace

import pytest

from sensorgen.core.bounds import Interval
from sensorgen.design.design import make
from sensorgen.models import closed
from sensorgen.prediction.capacitance import Answer
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


def test_a_cell_of_which_the_solution_ends_has_an_interval(monkeypatch, tmp_path):
    """No further rise at least, the closed cell at most: on paper, the drawn cell without its air."""
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    from sensorgen.models import press2d
    from sensorgen.prediction import compression_law as celllaw

    def ends_at_10_kpa(cell, solids, stress_pa, *given, press=press2d.press, **more):
        solution = press(cell, solids, [p for p in stress_pa if p <= 1e4], *given, **more)
        return replace(solution, faults=("converged up to 10 kPa",)) if stress_pa[-1] > 1e4 else solution

    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(press2d, "press", ends_at_10_kpa)
    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 5e3, 1e4))
    cell = make({"shape": "tri", "parameters": {"period_mm": 2.5, "dielectric_mm": 0.2}})
    law = law_of(cell, Answer("columns", Interval(1e-10, 2e-10), ()), "solved", until_pa=1.1e6)
    least, most = law.others
    assert law.compression.stress_pa[-3:] == (5e3, 1e4, 1.1e6)
    assert least.ratio[-1] == least.ratio[-2] < law.compression.ratio[-2]
    assert law.compression.ratio[-2] < law.compression.ratio[-1] <= most.ratio[-1]  # its last slope reaches farther
    assert 1.5 < most.ratio[-1] < 4.5
    assert "from 10 to 1100 kPa the rise of C lies between none more" in law.doubts[-1]
    assert {top.stress_pa[-1] for top in law.tops.values()} == {1.1e6}
    answer = Answer("columns", Interval(1e-10, 2e-10), ())
    otherwise = celllaw.at_a_few_pressures(cell, drawn(cell), answer, 1.1e6)  # ways to print differ, and end as early
    assert otherwise.compression.stress_pa == (0.0, 5e3, 1e4, 1.1e6)
    usual = law_of(cell, Answer("columns", Interval(1e-10, 2e-10), ()), "solved", until_pa=1e4)
    assert (usual.of_mesh, usual.compression.stress_pa[-1]) == ((), 1e4)
