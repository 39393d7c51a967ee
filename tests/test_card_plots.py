"""The picture of the card: its panels, its scales, and that it draws what the card says."""

import numpy as np
import pytest

from card_sensors import CAPACITOR, PLATE, setup
from sensorgen.analysis.plots import results as plots
from sensorgen.analysis.plots.static import drawn as drawn_by
from sensorgen.prediction.query import TONES_HZ


def drawn_of(*given, **how):
    """The card as matplotlib has it."""
    figure = plots.identifiability_figure(*given, **how)
    return drawn_by(figure, figure.choices[""], figure.title)


def test_it_has_maps_of_both_errors_and_single_tones():
    drawn = drawn_of(PLATE, TONES_HZ, title="plate")
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in drawn.axes]
    assert [x for x, _ in labels].count("position, centre of the tip [mm]") == 2
    assert labels[0][1] == "force [N]"
    assert ("frequency [kHz]", "standard error of force [N]") in labels
    assert drawn.get_suptitle().endswith("plate, 7 frequencies, noise 0.1 %")


def test_the_maps_are_in_newtons_and_millimetres():
    meshes = [axes.collections[0].get_array() for axes in drawn_of(PLATE, TONES_HZ).axes[:2]]
    here = setup().bounds()
    for mesh, expected in zip(meshes, (float(here.force_n), 1e3 * float(here.position_m)), strict=True):
        middle = np.asarray(mesh).reshape(plots.FORCES, plots.POSITIONS)[-1, plots.POSITIONS // 2]
        assert middle == pytest.approx(expected, rel=1e-9)


def test_marks_of_the_tones_are_what_each_tells_alone():
    force, position = (axes for axes in drawn_of(PLATE, TONES_HZ).axes if axes.get_xscale() == "log")
    for axes, pick, scale in ((force, "force_n", 1.0), (position, "position_m", 1e3)):
        marks = next(line for line in axes.lines if line.get_marker() == "o")
        assert np.asarray(marks.get_xdata()) == pytest.approx(np.array(TONES_HZ) / 1e3)
        last = getattr(setup(tones=TONES_HZ[-1:]).bounds(), pick)
        assert marks.get_ydata()[-1] == pytest.approx(scale * float(last))


def test_a_sensor_without_a_position_is_drawn_all_the_same(tmp_path):
    drawn_of(CAPACITOR, TONES_HZ).savefig(tmp_path / "card.png")
