"""Exposures of a reading: against closed forms, and presses that an own chain of pieces is misread as."""

import numpy as np
import pytest
from drawn_sensor import sensor_of
from scipy.optimize import least_squares

import tilted_layer
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.models import pressure
from sensorgen.models.compression import Plate, averaged, beyond, curve
from sensorgen.prediction.error_budget import error_budget
from sensorgen.prediction.query import TONES_HZ, Load
from sensorgen.prediction.reference_load import Dispersed
from sensorgen.prediction.rest_state import LOWEST_HZ

FORCE_N, PLACE_M = 6.0, 0.04
STILL = {
    "temperature_k": 0, "humidity_percent": 0, "permittivity_dispersion": 0, "resistivity_dispersion": 0,
    "piezoresistance": 0, "hysteresis": 0, "creep": 0, "off_middle_mm": 0, "tilt_deg": 0, "meter": 0, "squeezed_mm": 0,
    "bed_mm": 0, "person_n": 0, "person_mm": 0, "meter_circuit": False,
}  # fmt: skip
# of the plain plate, as the thesis has it: 100 x 10 mm, 4.68, 0.6 mm of 6 MPa, 0.3 mm of 0.07 and 0.2 ohm m
VALUES = {"etpu": {"resistivity_ohm_m": 0.2}, "x60": {"relative_permittivity": 4.68, "youngs_modulus_pa": 1e6}}
C_F_PER_M, R_OHM_PER_M, MODULUS_PA, TIP_M, WIDTH_M, LENGTH_M = (
    4.68 * 8.8541878128e-12 * 0.01 / 0.6e-3, 2 * 0.2 / (0.3e-3 * 0.01), 1e6, 0.01, 0.01, 0.1,
)  # fmt: skip


def terms(**effects):
    design = make({"shape": "reference", "material_values": VALUES, "effects": STILL | effects})
    budget = error_budget(sensor_of(design, "unconfined"), Load(TONES_HZ, FORCE_N, PLACE_M))
    return {t.name: t for t in budget.terms}


def chain(force, place, eps=1.0, rho=1.0, under=1.0, rise=1.0, n=500):
    """Impedance of a chain of n short pieces, each a resistor and a capacitor, open at its far end."""
    omega = 2 * np.pi * np.array(TONES_HZ)
    edges = np.linspace(0.0, LENGTH_M, n + 1)
    low, high = np.maximum(edges[:-1], place - TIP_M / 2), np.minimum(edges[1:], place + TIP_M / 2)
    covered = np.clip(high - low, 0, None) * n / LENGTH_M
    strain = force / (WIDTH_M * TIP_M) / MODULUS_PA
    c = C_F_PER_M * eps * (1 + covered * rise * strain / (1 - strain)) * LENGTH_M / n
    r = R_OHM_PER_M * rho * (1 + covered * (under - 1)) * LENGTH_M / n
    y = np.zeros(len(omega), complex)
    for ohm, farad in zip(r[::-1], c[::-1], strict=True):  # half of each resistor on either side of its capacitor
        y = 1 / (ohm / 2 + 1 / (1j * omega * farad + y / (1 + y * ohm / 2)))
    return 1 / y


def misread(**changed):
    """Errors of force and position [N], [m] of a chain that reads a changed one, by the ratio to rest."""

    def told(force, place, rest, **how):
        ln = np.log(chain(force, place, **how) / rest)
        return np.concatenate([ln.real, ln.imag])

    rest = chain(0.0, PLACE_M)
    seen = told(FORCE_N, PLACE_M, rest, **changed)

    def off(at):
        return told(at[0] * FORCE_N, at[1] * LENGTH_M, rest) - seen

    found = least_squares(off, [1.0, PLACE_M / LENGTH_M], xtol=1e-12, ftol=1e-12, diff_step=1e-3)
    return abs(found.x[0] - 1) * FORCE_N, abs(found.x[1] * LENGTH_M - PLACE_M)


@pytest.mark.parametrize(
    ("name", "effects", "changed"),
    [
        ("permittivity, temperature", {"temperature_k": 2, "permittivity_per_k": 5e-4},
         [{"eps": 1.001}, {"eps": 0.999}]),
        ("resistivity, humidity", {"humidity_percent": 2, "resistivity_per_percent": 2.5e-4},
         [{"rho": 1.0005}, {"rho": 0.9995}]),
        ("piezoresistance", {"piezoresistance": 0.002}, [{"under": 1.002}, {"under": 0.998}]),
        ("hysteresis", {"hysteresis": 0.1}, [{"rise": 1.1}]),
    ],
)  # fmt: skip
def test_a_press_is_misread_as_by_a_chain_of_pieces(name, effects, changed):
    found = terms(**effects)[name].changes
    force, place = np.max([misread(**one) for one in changed], axis=0)
    assert found.force_n == pytest.approx(force, rel=0.02, abs=2e-4)
    assert found.position_m == pytest.approx(place, rel=0.02, abs=2e-5)


def test_a_rise_that_is_larger_is_a_larger_force():
    """Of a plate s/(1 - s) rises with force: 1.1 times that is at s = 1.1 s0 / (1 + 0.1 s0)."""
    strain = FORCE_N / (WIDTH_M * TIP_M) / MODULUS_PA
    found = terms(creep=0.1)["creep"].changes
    assert found.force_n == pytest.approx(FORCE_N * (1.1 / (1 + 0.1 * strain) - 1), rel=1e-3)
    assert found.position_m < 1e-6


@pytest.mark.parametrize("hertz", [1e4, 1e6])
def test_a_series_circuit_that_is_taken_for_a_parallel_one(hertz):
    """A resistor before a plate: D = w R C. Values of R and C in parallel with that impedance, and the press read."""
    ohm, omega, area_m2 = 2e4, 2 * np.pi * hertz, WIDTH_M * TIP_M
    values = {"etpu": {"resistivity_ohm_m": 1e-13}, "x60": VALUES["x60"]}
    leads = {"resistance_ohm": ohm, "capacitance_pf": 0}
    data = {"shape": "reference", "material_values": values, "leads": leads, "effects": STILL | {"meter_circuit": True}}
    budget = error_budget(sensor_of(make(data), "unconfined"), Load((hertz,), FORCE_N, PLACE_M))
    found = next(t for t in budget.terms if t.name == "meter: series or parallel")

    def farad(force):
        strain = force / area_m2 / MODULUS_PA
        return C_F_PER_M * (LENGTH_M + TIP_M * strain / (1 - strain))

    def impedance(force):
        return ohm + 1 / (1j * omega * farad(force))

    def parallel(force):  # R and C with the impedance
        y = 1 / impedance(force)
        return 1 / y.real, y.imag / omega

    rp, cp = parallel(FORCE_N)
    assert found.changes.re == pytest.approx(rp / ohm - 1, rel=1e-3)
    others = sum(t.changes.re for t in budget.terms if t is not found)
    named = f"R at its worst is that of one term, meter: series or parallel: {100 * others:.2g} % without it"
    assert (named in budget.document()) is (others < 0.01 * (others + rp / ohm - 1))
    assert found.changes.capacitance == pytest.approx(farad(0) / parallel(0)[1] - 1, rel=1e-3)
    assert found.changes.magnitude == pytest.approx(farad(FORCE_N) / cp - 1, rel=1e-3)

    def taken(force, c, power):  # of C and D in a circuit, as readings of the other one
        d = omega * ohm * farad(force)
        return (1 / (omega * c(force))) * (d - 1j) * (1 + d * d) ** power

    def misread_by(c, power):
        seen = taken(FORCE_N, c, power) / taken(0, c, power)
        fit = least_squares(
            lambda f: [np.log(z := impedance(f[0]) / impedance(0) / seen).real, np.angle(z)], [FORCE_N],
            bounds=(0, 90), xtol=1e-14,  # a tip cannot pull: at D = 2.6 one circuit reads as no press at all
        )  # fmt: skip
        return abs(fit.x[0] - FORCE_N)

    def slope_off(*other):
        both = impedance, lambda force: taken(force, *other)
        own, others = (one(FORCE_N + 0.01) - one(FORCE_N - 0.01) for one in both)
        return abs(others / own - 1)

    circuits = (farad, -1), (lambda force: parallel(force)[1], 0)
    wrong = [misread_by(*one) for one in circuits]
    assert found.changes.by_force == pytest.approx(max(slope_off(*one) for one in circuits), rel=1e-3)
    assert found.changes.force_n == pytest.approx(max(wrong), rel=1e-2)
    assert (found.changes.position_m, found.kind, found.source) == (0.0, "meter", "the design")


def test_what_a_design_leaves_out_is_no_term_and_what_it_states_has_it_as_source():
    left_out = {"creep", "dispersion", "person", "meter's gain", "meter: series or parallel", "tip tilted"}
    assert not left_out & set(terms())
    given = terms(creep=0.1)
    assert (given["creep"].source, given["cell"].source) == ("the design", "model")
    own = make({"shape": "reference"})
    empty, still = (make({"shape": "reference", "effects": effects}).id() for effects in ({}, STILL))
    assert own.id() == empty != still
    budget = error_budget(sensor_of(own, "unconfined"), Load(TONES_HZ, FORCE_N, PLACE_M))
    assert {t.source for t in budget.terms if t.kind in ("drift", "tip", "person", "meter")} == {"guess"}


def test_uneven_pressure_by_integrals():
    """Of a plate, C rises by 1 / (1 - p/E) at each place: logarithms, under a line and under a triangle."""
    s, law = 0.1, Plate("free", "", 1.0)

    def mean(shares):
        return averaged(law, shares, s).ratio[-2]  # at the last pressure

    e = 0.1
    line = np.log((1 - s * (1 - 6 * e)) / (1 - s * (1 + 6 * e))) / (12 * e * s)
    assert mean(lambda _: pressure.off_middle(e)) == pytest.approx(line, rel=1e-5)
    e, wide = 0.3, 0.6
    corner = (1 - wide) - np.log(1 - 2 / wide * s) * wide / (2 / wide * s)
    assert mean(lambda _: pressure.off_middle(e)) == pytest.approx(corner, rel=1e-4)
    rise = 0.8  # from side to side, 8 times the mean: touches over (2/8)^1/2
    tilted = 0.5 - np.log(1 - rise * 0.5) / rise
    assert mean(lambda p: pressure.tilted(rise, p)) == pytest.approx(tilted, rel=1e-4)
    tilted = pressure.tilted(0.8, 0.1), pressure.tilted(0.1, 0.1)
    for shares in (pressure.off_middle(0.1), pressure.off_middle(0.3), *tilted):
        assert shares.mean() == pytest.approx(1, rel=1e-3)


def test_dispersion_by_kramers_and_kronig():
    """A permittivity as (j omega)^-n is in phase with its loss: tan(n pi / 2) at every frequency."""
    sensor = sensor_of(make({"shape": "reference"})).sensor
    there = Dispersed(**vars(sensor), permittivity_power=0.04, resistivity_power=0.0).at(10 * LOWEST_HZ)
    admittance = 1j * there.capacitance_f_per_m * (1 - 1j * there.tan_delta) / sensor.capacitance_f_per_m
    assert np.angle(admittance) == pytest.approx(np.pi / 2 * (1 - 0.04))
    assert there.capacitance_f_per_m / sensor.capacitance_f_per_m == pytest.approx(10**-0.04)


def test_what_alone_turns_a_verdict_is_named():
    """Drift of 10 % in C since the rest reading is more than any press of a stiff plate: no force is told.

    A drift of the resistivity hides the place from where a chain of pieces reads it 100 mm / 12^1/2 off.
    """
    lost = terms(temperature_k=50, permittivity_per_k=2e-3)["permittivity, temperature"].turns
    assert lost == "cannot sense force, cannot locate"
    assert terms(temperature_k=1e-3)["permittivity, temperature"].turns == ""
    guess_m, drift = LENGTH_M / 12**0.5, 2e-3
    for _ in range(4):
        drift *= guess_m / max(misread(rho=1 + sign * drift)[1] for sign in (-1, 1))
    for factor, turns in ((0.95, ""), (1.05, "cannot locate")):
        found = terms(temperature_k=1, resistivity_per_k=factor * drift)["resistivity, temperature"]
        assert found.turns == turns


W, K, SLOPE, MEAN_PA = 0.01, 2.7e9, np.tan(np.radians(2)), 6e4  # tri 0.2: 36.4 um at 100 kPa


def test_a_tip_held_at_an_angle_presses_as_by_finite_elements():
    """On a thin electrode as the closed form has it; a thick one carries further, towards an even pressure."""
    closed = MEAN_PA * pressure.tilted(SLOPE * W * K, MEAN_PA)
    share, thin = tilted_layer.pressure(W, 2e-5, 22e6, K, SLOPE, MEAN_PA)
    assert thin.max() == pytest.approx(closed.max(), rel=0.01)
    assert share @ (thin > 0.01 * MEAN_PA) == pytest.approx(np.mean(closed > 0), abs=0.02)
    share, thick = tilted_layer.pressure(W, 7.4e-4, 22e6, K, SLOPE, MEAN_PA)
    for power in (0.5, 2.0):  # rises that flatten and that steepen
        ends = sorted([MEAN_PA**power, np.mean(closed**power)])
        assert ends[0] < share @ np.clip(thick, 0, None) ** power < ends[1]


def test_beyond_a_cell_the_rise_lies_between_none_and_the_last_slope():
    flattens = curve("sqrt", "", [0.0, 1e4, 2e4, 3e4], [1, *(1 + 1e-3 * np.sqrt([1e4, 2e4, 3e4]))])
    shares = pressure.tilted(SLOPE * W * K, MEAN_PA)
    with pytest.raises(OutOfRange):
        averaged(flattens, lambda _: shares, MEAN_PA)
    laws = beyond(flattens, MEAN_PA, lambda _: shares)
    least, most = (averaged(law, lambda _: shares, MEAN_PA).ratio[-2] - 1 for law in laws)
    assert least < np.mean(1e-3 * np.sqrt(shares * MEAN_PA)) < most


def test_a_tilted_stiff_tip_is_a_row_with_a_range():
    design = make({"shape": "tri", "tip": {"block": "stiff"}})
    terms = {t.name: t for t in error_budget(sensor_of(design), Load(TONES_HZ, FORCE_N, PLACE_M)).terms}
    tilted = terms["tip tilted"]
    assert (tilted.at_least, tilted.source) == (True, "guess")
    assert tilted.changes.force_n > 0.1
    assert "beyond" in tilted.what
