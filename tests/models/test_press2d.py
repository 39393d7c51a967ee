"""Cells under pressure against curves that others solved, and their symmetries and balances."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import make

pytest.importorskip("netgen")
from sensorgen.models import press2d
from sensorgen.models.compression import curve_of
from sensorgen.models.press2d import BoundaryConditions, Fineness
from sensorgen.solvers.contact import closing, load, pressed

REFERENCE = json.loads((Path(__file__).parents[1] / "reference" / "contact.json").read_text())
VARIANTS = REFERENCE["variants_L1_k60_error_about_1pc"]
STRESSES = np.linspace(0, 1e5, 11)
EPS = {"x60": 4.68, "air": 1.00059}
PER_M = 2e-3 * 1e12  # from F/m2 to pF per metre of depth and period of 2 mm


def solids(nu=0.4999, x60=6e6, etpu=22e6):
    return {"x60": press2d.Elastic(x60, nu), "etpu": press2d.Elastic(etpu, nu)}


def tri(film=0.1, **more):
    drawn = make({"shape": "tri", "parameters": {"dielectric_mm": film, **more}})
    return press2d.cell(drawn.in_use, drawn.params.period_mm)


@pytest.mark.parametrize("film", [0.1, pytest.param(0.2, marks=pytest.mark.nightly)])
def test_the_reference_curve_at_every_load(film):
    known = REFERENCE[f"tri_d{film}"]
    found = press2d.press(tri(film), solids(), STRESSES, EPS)
    assert found.faults == ()
    assert found.displacement_m[1:] * 1e6 == pytest.approx(known["uy_um"][1:], rel=0.01)
    middle = np.array([c.middle() for c in found.capacitance_f_per_m2]) * PER_M
    assert (middle - middle[0])[1:] == pytest.approx(known["dC_pF_per_m"][1:], rel=0.015)
    unloaded = found.capacitance_f_per_m2[0].times(PER_M)
    assert unloaded.lower < known["C0_exact_pF_per_m"] < unloaded.upper
    assert max(c.width() for c in found.capacitance_f_per_m2) < 1.5e-3
    assert found.imbalance == pytest.approx(0 * STRESSES, abs=0.002)  # dE = F du along the whole curve
    assert abs(found.imbalance[-1]) < 0.001


@pytest.mark.parametrize(
    ("name", "held", "nu"),
    [
        ("stick", BoundaryConditions(contact="stick"), 0.4999),
        ("free", BoundaryConditions(base="sliding", period="free"), 0.4999),
        pytest.param("roller", BoundaryConditions(base="sliding"), 0.4999, marks=pytest.mark.nightly),
        ("rigid", BoundaryConditions(top="rigid"), 0.4999),
        pytest.param("nu45", BoundaryConditions(), 0.45, marks=pytest.mark.nightly),
        pytest.param("nu499", BoundaryConditions(), 0.499, marks=pytest.mark.nightly),
    ],
)
def test_choices_of_the_boundary(name, held, nu):
    """Up to 30 kPa; the reference curve goes to 100 kPa."""
    found = press2d.press(tri(), solids(nu), STRESSES[:4], boundary=held)
    assert found.faults == ()
    early = 1 if name == "stick" else 0  # there the file is above what gives way without friction, which cannot be
    known = VARIANTS[f"{name}_d0.1"]["uy_um"][:4]
    assert found.displacement_m[1 + early :] * 1e6 == pytest.approx(known[1 + early :], rel=0.015)
    assert found.displacement_m[1:] * 1e6 == pytest.approx(known[1:], rel=0.02)


def test_a_plate_that_widens_gains_area():
    """Free layers keep their volume: strain p (1 - nu^2) / E thins the film and widens it, and C rises by both."""
    plate = make({"shape": "reference"}).in_use
    loads, top = [0.0, 1e4], BoundaryConditions("sliding", "free", "rigid")
    alike = dict.fromkeys(("x60", "etpu"), press2d.Elastic(6e6, 0.5))
    rest, risen = (
        c.middle() for c in press2d.press(press2d.cell(plate, None), alike, loads, EPS, top).capacitance_f_per_m2
    )
    assert risen / rest - 1 == pytest.approx(2 * 1e4 * 0.75 / 6e6, rel=0.01)


def test_exactly_incompressible_is_the_limit():
    softer, limit = (press2d.press(tri(), solids(nu), STRESSES[:2]).displacement_m[-1] for nu in (0.49999, 0.5))
    assert limit < softer < limit * (1 + 1e-3)


def test_levels_that_differ_are_told():
    found = replace(faulty(1.0, 2.0), displacement_m=np.array([0.0, 1.02e-6]))
    other = replace(found, displacement_m=np.array([0.0, 1e-6]))
    assert press2d.compared(found, other).faults[-1] == "two meshes differ by 2.00% in displacement"
    assert press2d.compared(found, found).doubts[-1] == "two meshes differ by 0.00% in displacement"


def test_a_plate_between_fixed_sides_is_confined():
    drawn = make({"shape": "reference"})
    found = press2d.press(press2d.cell(drawn.in_use, None), solids(), [0.0, 1e5], EPS)
    confined = {k: s.youngs_modulus_pa * (1 - 0.4999) / (1.4999 * 2e-4) for k, s in solids().items()}
    assert found.displacement_m[-1] == pytest.approx(1e5 * 0.6e-3 * sum(1 / m for m in confined.values()), rel=1e-4)
    assert found.capacitance_f_per_m2[0].middle() == pytest.approx(0.27625066e-12 / 4e-6, rel=1e-7)


def test_too_much_is_told_with_the_last_load(monkeypatch):
    """Nothing above 15 kPa is allowed to converge: what was reached is told, and nothing is made up beyond it."""
    stepped = load.Problem.stepped
    monkeypatch.setattr(
        load.Problem, "stepped", lambda self, s, p, before, **_: stepped(self, s, p, before) if p < 1.5e4 else None
    )
    found = press2d.press(tri(), solids(), [0.0, 1e4, 2e4], fineness=Fineness(0.005, 0.2, 0.3))
    assert found.converged_pa == 1e4
    assert found.faults == ("converged up to 10 of 20 kPa",)
    assert len(found.stress_pa) == len(found.displacement_m) == 2
    with pytest.raises(OutOfRange, match="not to be trusted"):
        curve_of(found)


def test_partners_stay_where_new_ones_have_no_equilibrium(monkeypatch):
    """Made to find none above 15 kPa: the curve goes on, as without that fault."""
    newton, sizes = load.Problem.newton, Fineness(0.005, 0.2, 0.3)
    known = press2d.press(tri(), solids(), [0.0, 1e4, 2e4], fineness=sizes)

    def none_of_new(self, state, pressure_pa, pairs, enough):
        return (
            None
            if pressure_pa > 1.5e4 and pairs is not state.pairs
            else newton(self, state, pressure_pa, pairs, enough)
        )

    monkeypatch.setattr(load.Problem, "newton", none_of_new)
    found = press2d.press(tri(), solids(), [0.0, 1e4, 2e4], fineness=sizes)
    assert found.faults == ()
    assert found.displacement_m == pytest.approx(known.displacement_m, rel=0.01)


def test_coarser_triangles_take_over_where_finer_ones_fail(monkeypatch):
    """Made to fail at first: the answer is that of coarser triangles from there on, and says so."""
    stepped = load.Problem.stepped

    def fine_fail(self, state, pressure, before, **_):
        fine = self.elements.mesh.lengths_m().min() < 2e-6
        return None if fine and pressure > 1.5e4 else stepped(self, state, pressure, before)

    monkeypatch.setattr(load.Problem, "stepped", fine_fail)
    found = press2d.press(tri(), solids(), [0.0, 1e4, 2e4], EPS)
    assert (found.converged_pa, found.faults) == (2e4, ())
    assert found.doubts == ("triangles of 3 um at the apex from 20 kPa on, because finer ones do not converge",)
    assert found.apex_m == pytest.approx((1e-6, 1e-6, 3e-6))
    known = REFERENCE["tri_d0.1"]
    assert found.displacement_m[1:] * 1e6 == pytest.approx(known["uy_um"][1:3], rel=0.01)
    rise = (found.capacitance_f_per_m2[2].middle() - found.capacitance_f_per_m2[0].middle()) * PER_M
    assert rise == pytest.approx(known["dC_pF_per_m"][2], rel=0.015)


def faulty(*capacitance, **checks):
    """A curve with a fault: its capacitances as given, and what is not sound by default."""
    n = len(capacitance)
    sound = {"volume_ratio": np.ones(n), "penetration": np.zeros(n), "imbalance": np.zeros(n)}
    known = tuple(c and Interval(c, c) for c in capacitance)
    load = STRESSES[:n]
    return pressed.Pressed(load, load, known, (True,) * n, fall_m=0.0, faults=("bad",), **sound | checks)


@pytest.mark.parametrize(("check", "bad"), [("volume_ratio", 0.1), ("penetration", 0.5), ("imbalance", -0.02)])
def test_the_sound_part_ends_before_the_first_failed_check(check, bad):
    good = 1.0 if check == "volume_ratio" else 0.0
    given = faulty(1.0, 2.0, 3.0, 4.0, **{check: np.array([good, good, bad, good])})
    found = given.sound()
    assert (found.converged_pa, found.faults) == (STRESSES[1], ())
    assert found.capacitance_f_per_m2 == given.capacitance_f_per_m2[:2]


def test_a_pressure_whose_outlines_were_not_meshed_is_left_out_where_a_later_one_is_known():
    given = faulty(1.0, None, 3.0, 4.0)
    found, c = given.sound(), given.capacitance_f_per_m2
    assert (found.capacitance_f_per_m2, found.faults, found.carried) == ((c[0], c[2], c[3]), (), (True,) * 3)
    assert found.stress_pa.tolist() == [STRESSES[k] for k in (0, 2, 3)]
    squeezed = replace(given, volume_ratio=np.array([1.0, 0.1, 1.0, 1.0]))
    assert squeezed.sound() == squeezed  # no two before it


@pytest.mark.parametrize("last", [None, 1.0])
def test_the_sound_part_ends_where_the_capacitance_is_unknown_or_falls(last):
    found = faulty(2.0, 2.0, last).sound()
    assert found.converged_pa == STRESSES[1]
    assert found.sound().faults == ()


def test_outlines_that_are_closed_in_the_wrong_place_do_not_pass(monkeypatch):
    """Gaps up to a third of a side taken for shut: solids gain area, and the answer has no capacitance and a fault."""
    monkeypatch.setattr(closing, "_CLOSED", 1.5)
    monkeypatch.setattr(closing, "_BETWEEN", 1.5)
    found = press2d.press(tri(), solids(), [0.0, 1e4], EPS, fineness=Fineness(1.4e-3, 0.1, 0.2))
    assert found.capacitance_f_per_m2[1] is None
    assert "could not be meshed" in found.faults[-1]


def test_a_thin_film_of_another_period_is_pressed_at_once():
    found = press2d.press(tri(0.02, period_mm=1.0), solids(), [0.0, 1e4, 2e4], EPS, fineness=Fineness(7e-4, 0.1, 0.2))
    assert (found.faults, found.doubts) == ((), ())
    assert (np.diff(found.displacement_m) > 0).all()
    assert max(c.width() for c in found.capacitance_f_per_m2) < 3e-3


def test_what_is_no_prism_or_no_solid_is_refused():
    with pytest.raises(BadInput, match="solved in 3D"):
        press2d.cell(make({"shape": "rect"}).in_use, 2.0)
    with pytest.raises(OutOfRange, match=r"up to 0\.5"):
        press2d.Elastic(6e6, 0.51)
    with pytest.raises(BadInput, match="bonded or sliding"):
        press2d.press(tri(), solids(), [0.0, 1.0], boundary=BoundaryConditions(base="glued"))
    for stresses in ([1.0, 2.0], [0.0, 2.0, 1.0]):
        with pytest.raises(OutOfRange, match="begin with 0"):
            press2d.press(tri(), solids(), stresses)


def test_work_and_energy_are_weighed():
    """A linear spring stores half of stress times way; if it stores more or less, that is told as a share."""
    stress = moved = np.array([0.0, 1.0, 2.0])
    assert pressed._imbalance(stress, moved, np.array([0.0, 0.5, 2.0])) == pytest.approx([0, 0, 0], abs=1e-12)
    assert pressed._imbalance(stress, moved, np.array([0.0, 0.5, 2.5]))[2] == pytest.approx(-0.2)


@pytest.mark.parametrize(("stiffer", "closes"), [(2, 48.0), (5, 42.0), (10, 50.0), (10, 55.0)])
def test_a_gap_that_closes_within_a_load_step_is_no_fault(stiffer, closes):
    """Springs of which more carry from one load on: the sum alone is off by up to 1.8 %; wrong energy is still seen."""
    stress = np.array([0, 2.5, 5, 10, 20, 30, 40, 60, 75])
    beyond = np.maximum(stress - closes, 0)
    moved = stress - beyond * (1 - 1 / stiffer)
    energy = stress**2 / 2 - ((beyond + closes) ** 2 - closes**2) / 2 * (1 - 1 / stiffer)
    assert np.abs(pressed._imbalance(stress, moved, energy)).max() < 0.9e-2
    assert np.abs(pressed._imbalance(stress, moved, 1.05 * energy)).max() > 1.4e-2


def test_a_peak_stays_though_the_same_bodies_lie_on_both_sides():
    points = {point for edge in tri().edges for point in edge}
    assert any(x == pytest.approx(1.0) and y == pytest.approx(0.64) for x, y in points)
