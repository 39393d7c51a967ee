"""Spread of a load by the cover against finite elements in plane strain, plates, and its undoing in maps."""

import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, sym_grad, trace
from skfem.models.elasticity import lame_parameters

from sensorgen.core.errors import BadInput
from sensorgen.measure.virtual.array import nodal, printed
from sensorgen.prediction.array.frames import PressureMaps, inverted
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.study import study
from sensorgen.solvers.cover import ElasticLayer, kernel, transfer

from .conftest import array_of

PITCH_M = 5e-3


def by_elements(layer, spring, squares=9, fine=12, thick=6):
    """Mean pressures on springs under each pitch, for 1 Pa on the middle one."""
    half = squares * PITCH_M / 2
    mesh = skfem.MeshQuad.init_tensor(
        np.linspace(-half, half, squares * fine + 1), np.linspace(0, layer.thickness_m, thick + 1)
    )
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()))
    lam, mu = lame_parameters(layer.youngs_modulus_pa, layer.poisson_ratio)

    @skfem.BilinearForm
    def stress(u, v, w):
        return 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * trace(sym_grad(u)) * trace(sym_grad(v))

    @skfem.BilinearForm
    def springs(u, v, w):
        return spring * u[1] * v[1]

    @skfem.LinearForm
    def load(v, w):
        return -1.0 * (np.abs(w.x[0]) < PITCH_M / 2) * v[1]

    low, high = (skfem.FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda x, z=z: np.isclose(x[1], z)))
                 for z in (0.0, layer.thickness_m))  # fmt: skip
    fixed = basis.get_dofs(lambda x: np.isclose(x[0], 0) & np.isclose(x[1], 0)).all("u^1")
    u = skfem.solve(*skfem.condense(skfem.asm(stress, basis) + skfem.asm(springs, low), skfem.asm(load, high), D=fixed))

    def mean(k):
        left = -half + k * PITCH_M

        @skfem.LinearForm
        def over(v, w):
            return -spring * v[1] * ((w.x[0] > left) & (w.x[0] < left + PITCH_M)) / PITCH_M

        return float(skfem.asm(over, low) @ u)

    return np.array([mean(k) for k in range(squares)])


@pytest.mark.parametrize(
    ("layer", "spring"),
    [
        (ElasticLayer(0.7e-3, 12e6, 0.48), 2e9),
        (ElasticLayer(1e-3, 1e9, 0.4), 1e9),
    ],
    ids=["print", "sheet"],
)
def test_the_spread_is_that_of_finite_elements(layer, spring):
    """A strip as wide as a pitch: the kernel summed along the other axis. No square of it loses or gains force."""
    of = kernel([layer], spring, (PITCH_M, PITCH_M))
    assert of.sum() == pytest.approx(1.0)
    rows = of.sum(1)
    true = by_elements(layer, spring)
    assert [rows[k] for k in (-2, -1, 0, 1, 2)] == pytest.approx(true[2:7], abs=1e-3)
    assert 1 - true[4] > 0.01


def test_two_loose_plates_bend_as_the_sum_of_both():
    k, springs = np.array([50.0, 200.0, 800.0]), 1e9
    plates = [ElasticLayer(1e-4, 1e9, 0.3), ElasticLayer(2e-4, 2e9, 0.3)]
    bending = sum(of.youngs_modulus_pa / (1 - 0.09) * of.thickness_m**3 / 12 for of in plates)
    assert transfer(k, plates, springs) == pytest.approx(1 / (1 + bending * k**4 / springs), abs=2e-3)
    assert transfer(np.array([0.0]), plates, springs) == pytest.approx(1)


@pytest.fixture(scope="module")
def model():
    return array_of({"length_mm": 60, "width_mm": 50, "cover_mm": 1.0, "cover_mpa": 300.0})


def test_a_press_under_a_sheet_comes_back(model):
    """One square pressed: its cell feels half, its neighbours some; maps on the surface have it back, others do not."""
    readout, draw = ArrayReadout(noise=1e-4), np.random.default_rng(1)
    load = np.zeros((3, 5, 6))
    load[2, 2, 3] = 40.0
    siemens = printed(model, 1, 0.0).frames(load, np.arange(3.0), readout, draw)
    under = inverted(model, readout, siemens, np.arange(3) < 2, np.arange(3.0), 0.0, surface=False)
    felt, found = under.pressure_kpa[0], under.on_surface().pressure_kpa[0]
    assert felt[2, 3] < 36
    assert felt[2, 2] > 0.5
    assert found == pytest.approx(load[2], abs=0.8)
    assert under.force_n[0][0] == pytest.approx(under.on_surface().force_n[0][0], rel=0.05)
    assert (under.on_surface().sigma_kpa >= under.sigma_kpa).all()


def test_a_sheet_that_spreads_beyond_the_array_is_named():
    plate = array_of({"length_mm": 60, "width_mm": 50, "cover_mm": 30, "cover_mpa": 1e5})
    with pytest.raises(BadInput, match="cover_mm 30 of cover_mpa 100000: it spreads a press over more than 16 cross"):
        study(plate, ArrayReadout())


def test_resolution_on_the_surface_is_worse(model):
    bare = array_of({"length_mm": 60, "width_mm": 50, "cover_mm": 0.0})
    sheet, none = (study(of, ArrayReadout()) for of in (model, bare))
    assert np.median(sheet.sigma_kpa) > 1.1 * np.median(none.sigma_kpa)
    text = "\n".join(str(part) for _, part in sheet._facts())
    assert "1 mm of 300 MPa" in text


def test_a_dead_crossing_under_a_sheet_stays_unknown(model):
    readout = ArrayReadout(noise=1e-4)
    load = np.full((1, 5, 6), 50.0)
    carried = model.carried(load)
    siemens = np.stack([nodal(model.tracks(), model.capacitances(model.under(p * 1e3)[0]), readout)
                        for p in (0 * load[0], carried[0])])  # fmt: skip
    siemens[:, 2, 2] = np.nan
    found = inverted(model, readout, siemens, np.array([True, False]), np.arange(2.0), 0.0).pressure_kpa[0]
    assert np.isnan(found[2, 2])
    assert np.nan_to_num(found, nan=50.0) == pytest.approx(load[0], rel=0.01)


def test_errors_of_many_crossings_grow_as_without_ends(model, monkeypatch):
    nothing = PressureMaps(model, "", np.zeros(1), np.zeros((1, 5, 6)), np.ones((1, 5, 6)))
    few = nothing.on_surface().sigma_kpa[0]
    monkeypatch.setattr("sensorgen.prediction.array.frames.MOST_DENSE", 29)
    assert nothing.on_surface().sigma_kpa[0, 2, 2] == pytest.approx(few[2, 2], rel=0.02)
