"""A virtual array and the chain of its calibration: network by nodal analysis, loads, and maps beside the truth."""

import numpy as np
import pytest

from sensorgen.analysis.plots import array as plots
from sensorgen.core.errors import BadInput
from sensorgen.measure.array_frames import of_frames, read
from sensorgen.measure.virtual.array import nodal, printed, walked
from sensorgen.prediction.array.frames import at_rest, inverted
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.sessions import calibrated
from sensorgen.solvers.tracks import Tracks, readings
from sensorgen.workflows import insole


@pytest.mark.parametrize(("kind", "digits"), [("guarded", 1e-10), ("two-terminal", 1e-5)])
def test_two_formulations_of_the_network_agree(kind, digits):
    draw = np.random.default_rng(0)
    tracks = Tracks.uniform(
        draw.uniform(1, 2, (4, 5)) * 1e-11, row_ohm=140.0, column_ohm=90.0, lead_ohm=300.0, tan_delta=0.02
    ).broken("row", 2, 2).shorted(1, 1, 1e3)  # fmt: skip
    own, by_nodes = readings(tracks, 1e4, readout=kind).siemens, nodal(tracks, tracks.capacitance_f, ArrayReadout(kind))
    assert np.abs(own - by_nodes).max() < digits * np.abs(own).max()


def test_a_step_has_the_force_and_centre_of_its_points(model):
    """Means over squares keep the force; the centre of the squares differs from that of the points by a share of 10."""
    coarse, fine = walked(model.layout), walked(model.layout, 5)
    assert fine.pressure_kpa[30].sum() == pytest.approx(coarse.pressure_kpa[30].sum(), rel=0.1)
    newtons = fine.pressure_kpa[30]
    x = (newtons.sum(0) @ model.layout.x_mm) / newtons.sum()
    assert fine.centre_mm[30, 0] == pytest.approx(x, abs=1.0)
    assert fine.centre_mm[55, 0] > fine.centre_mm[5, 0] + 10


def recorded(model, folder, faults=("r2:5", "r4c2"), swap=False):
    readout, draw = ArrayReadout(), np.random.default_rng(3)
    print_ = printed(model, 3, 0.05, faults, stiffness=1.3, own_law=True, play=0.02, creep=0.02, drift=-0.002)
    paths = [folder / f"{day}.npz" for day in range(3)]
    for day, path in enumerate(paths):
        path.write_bytes(insole._recorded(print_, model, readout, draw, day))
    if swap:
        data = dict(np.load(paths[1]))
        np.savez(paths[1], **data | {"siemens": data["siemens"][:, :, [0, 1, 4, 3, 2, 5]]})
    (folder / "step.npz").write_bytes(insole._stepped(print_, walked(model.layout, 5), readout, draw))
    return paths


def test_the_chain_recovers_a_step(model, tmp_path):
    """Another law, network, hysteresis, creep and drift than the inversion has; a broken row and a short."""
    known = calibrated(of_frames(recorded(model, tmp_path), model))
    frames, true = read(tmp_path / "step.npz", (5, 6), None), walked(model.layout, 5)
    by_design, found = (
        inverted(model, ArrayReadout(), frames.siemens, frames.rest, frames.time_s, calibration=calibration, day=4.0)
        for calibration in (None, known)
    )
    run = insole._compared("a", "", by_design, found, true)
    assert run.dead == 2
    assert np.isnan(found.pressure_kpa[:, 1, 5]).all()
    assert np.isnan(found.pressure_kpa[:, 3, 1]).all()
    assert run.error_kpa < 7 < run.before_kpa
    assert 0.8 <= run.coverage <= 0.99
    assert run.force < 3
    assert run.lost > 1
    assert len(plots.course(found, true.pressure_kpa, "c", "").choices[""]) == 2


def test_a_short_is_in_the_network_that_inverts(model, tmp_path):
    recorded(model, tmp_path)
    frames = read(tmp_path / "step.npz", (5, 6), None)
    leaks = at_rest(model, ArrayReadout(), frames.siemens[frames.rest]).leaks_s
    assert 1 / leaks[3, 1] == pytest.approx(1e3, rel=0.05)  # as planted, the tracks apart
    assert (leaks > 0).sum() == 1


def test_wires_swapped_between_days_are_named(model, tmp_path):
    with pytest.raises(BadInput, match="presses on c3 are read at c5: wires swapped"):
        of_frames(recorded(model, tmp_path, (), swap=True), model)


@pytest.mark.nightly
def test_the_whole_demonstration(tmp_path):
    found = insole.demo(tmp_path / "demo")
    for run in found.runs:
        assert run.error_kpa < 5
        assert 0.85 <= run.coverage <= 0.97
        assert run.force < 2
        assert run.verdict == "PRINT"
    assert found.runs[1].error_kpa < found.runs[0].error_kpa
    assert found.runs[1].centre_mm < 1
