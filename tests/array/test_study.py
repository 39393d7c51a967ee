"""Resolution of arrays: closed forms, another formulation of the network, faults, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from array_network import by_currents

from sensorgen.analysis.plots import array as plots
from sensorgen.analysis.plots import static
from sensorgen.core import document
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import make
from sensorgen.prediction.array.model import array_model
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.study import study

from .conftest import array_of


def model_of(border=None, **parameters):
    size = {} if border else {"length_mm": 40, "width_mm": 30}
    return array_of(size | parameters, **({"border": border} if border else {}))


@pytest.fixture(scope="module")
def model():
    return model_of()


def test_law_and_load_of_the_cell(model):
    """triX as printed rises by 7.1 % at 100 kPa on the cell; with air between, 64 of 100 mm2 carry the load.

    Of the whole capacitance 0.946 of it, as the fringe at the edges of the tracks rises less.
    """
    assert model.load_factor == pytest.approx(100 / 64)
    ratio, slope = model.under(np.array([64e3, 64.1e3, 1e6, 1.1e6]))
    assert ratio[0] - 1 == pytest.approx(0.946 * 0.0714, rel=1e-2)
    assert (ratio[1] - ratio[0]) / 100 == pytest.approx(slope[0], rel=1e-2)
    assert ratio[3] - ratio[2] == pytest.approx(1e5 * slope[2])
    pressure = np.array([-1e4, 0.0, 1e3, 5e4, 4e5])
    found, per = model.pressures(model.under(pressure)[0])
    assert found == pytest.approx(pressure, abs=1e-3)
    assert per == pytest.approx(1 / model.under(pressure)[1])


def test_stiffer_cells_bear_the_shared_factor_more(model):
    """The true pressure is the factor times the stated one: at the same strain, a cell of that modulus."""
    law, cell_pa = model.crossing.law.compression, np.array([20e3, 60e3])
    for factor in model.shared_factor:
        strain, _ = law.scaled_modulus(factor).capacitive_strain(cell_pa * factor)
        assert strain == pytest.approx(law.capacitive_strain(cell_pa)[0], rel=1e-6)
    assert "press with a known weight" in next(model.shared())


def test_solid_between_the_tracks_carries_most_of_the_load():
    """Springs side by side: walls of X60, 36 % of the area, beside softer cells."""
    soft = model_of(between="dielectric")
    p, cell = soft.layout.params, soft.crossing.body.cells.first()
    height = (cell.size_mm[2] - 2 * p.electrode_mm) * 1e-3
    wall = soft.design.material("x60").value("youngs_modulus_pa").value / height
    own = soft.crossing.law.compression.foundation_stiffness_pa_per_m(height)
    assert soft.load_factor == pytest.approx(own / (0.64 * own + 0.36 * wall))
    assert soft.load_factor < 1
    plate = make({"shape": "array", "cell": {"parameters": {"dielectric_mm": 0.4}}})
    assert array_model(plate).load_factor == 1


def test_guarded_at_a_low_frequency_each_reading_is_its_crossing(model):
    """I = j w C: noise of 0.1 % of the imaginary part is 0.1 % of C; undoing the cover's spread makes it more."""
    ratio, slope = model.under(np.array(50e3))
    found = study(model, ArrayReadout(frequency_hz=(100.0,)), 50.0)
    undone = np.sqrt((np.linalg.inv(model.spread.toarray()) ** 2).sum(1)).reshape(3, 4)
    assert 1.03 < undone.min() < undone.max() < 1.15
    assert found.sigma_kpa == pytest.approx(undone * float(1e-3 * ratio / slope / 1e3), rel=1e-3)
    assert found.sigma_n == pytest.approx(found.sigma_kpa * 0.1)  # 100 mm2
    assert found.crosstalk.max() < 1e-3
    four = study(model, ArrayReadout(frequency_hz=(100.0, 101.0, 102.0, 103.0)), 50.0)
    assert four.sigma_kpa == pytest.approx(found.sigma_kpa / 2, rel=1e-3)


@pytest.mark.parametrize("kind", ["guarded", "two-terminal"])
def test_another_network_has_the_same_information_and_crosstalk(model, kind):
    readout, kpa = ArrayReadout(kind, 200.0, (80e3,), 2e-3, 1e-10), 80.0
    found = study(model, readout, kpa)
    ratio, slope = model.under(np.array(kpa * 1e3))
    tracks = model.tracks(model.capacitances(float(ratio)))

    def read(c):
        return by_currents(replace(tracks, capacitance_f=c), 80e3, 200.0, kind == "two-terminal")

    at, step = tracks.capacitance_f, 1e-16
    slopes = np.empty((12, 12), complex)
    for k in range(12):
        change = np.zeros(12)
        change[k] = step
        change = change.reshape(3, 4)
        slopes[:, k] = ((read(at + change) - read(at - change)) / (2 * step)).ravel()
    sigma = np.hypot(2e-3 * np.abs(read(at)), 1e-10).reshape(-1, 1)
    rows = np.vstack([(slopes / sigma).real, (slopes / sigma).imag])
    rows = rows @ model.spread.toarray()
    farad = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    expected = farad / (model.capacitance.value * float(slope)) / 1e3
    assert found.sigma_kpa.ravel() == pytest.approx(expected, rel=1e-2)
    others = np.abs(slopes) / np.abs(np.diag(slopes))[:, None]
    np.fill_diagonal(others, 0)
    assert found.crosstalk.ravel() == pytest.approx(others.max(1), rel=1e-3)


def test_what_a_fault_hides_is_not_determined(model):
    found = study(model, ArrayReadout(), 100.0, ["r2:2", "r1c1"])
    dark = [(0, 0), (1, 2), (1, 3)]
    assert [tuple(k) for k in np.argwhere(~found.determined).tolist()] == dark
    text = "\n".join(document.text(found.document()))
    assert "3 of 12 crossings are not determined" in text
    record = found.record()
    assert [record["sigma_kpa"][i][j] for i, j in dark] == [None] * 3
    lead = study(model, ArrayReadout(), 100.0, ["c3:0"])
    assert not lead.determined[:, 2].any()
    assert lead.determined[:, [0, 1, 3]].all()


def test_crossings_outside_the_outline_tell_nothing():
    """Their readings are leads' alone: noise relative to them would let a broken row's be known by them."""
    corner = model_of("POLYGON ((0 0, 60 0, 60 20, 30 20, 30 40, 0 40, 0 0))")
    assert not corner.here.all()
    dark = study(corner, ArrayReadout(), 100.0, ["r1:3"]).determined
    assert dark[0].tolist() == [True] * 3 + [False] * 3
    assert dark[1:][corner.here[1:]].all()


def test_an_outline_leaves_its_corner_out():
    corner = model_of("POLYGON ((0 0, 40 0, 40 20, 30 20, 30 30, 0 30, 0 0))")
    found = study(corner, ArrayReadout())
    assert np.isnan(found.sigma_kpa).tolist() == [[False] * 4, [False] * 4, [False] * 3 + [True]]
    assert static.png(plots.resolution(found))[:4] == b"\x89PNG"
    for fault in ("r3c4", "r3:3", "c4:2"):
        with pytest.raises(BadInput, match=f"fault {fault}: the outline leaves this place out"):
            study(corner, ArrayReadout(), faults=[fault])
    assert study(corner, ArrayReadout(), faults=["r3:2", "c4:1", "r3:2"]).determined.sum() == 12 - 1 - 2


@pytest.mark.parametrize(
    ("make_it", "error", "words"),
    [
        (lambda m: study(m, ArrayReadout(), -1.0), OutOfRange, "pressure of -1 kPa"),
        (lambda m: study(m, ArrayReadout(noise=0.0)), OutOfRange, "noise 0 and 0 S"),
        (lambda m: study(m, ArrayReadout(), faults=["r9c1"]), BadInput, "3 rows and 4 columns"),
        (lambda m: study(m, ArrayReadout(), faults=["r1:9"]), BadInput, "expected r3:5"),
        (lambda m: study(m, ArrayReadout(), faults=["dead"]), BadInput, "fault 'dead'"),
        (lambda m: study(m, ArrayReadout(input_ohm=0.0)), OutOfRange, "input resistance"),
    ],
)
def test_no_study_is_an_error(model, make_it, error, words):
    with pytest.raises(error, match=words):
        make_it(model)
