"""Ranges of what is not known: values of one source or none, leads, contacts, the edge, and what narrows them."""

from dataclasses import replace
from math import exp, inf, log, pi, sqrt
from statistics import mean
from types import SimpleNamespace

import numpy as np
import pytest
from drawn_sensor import sensor_of

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import BadInput
from sensorgen.design import materials, packs, values
from sensorgen.design.design import make
from sensorgen.design.materials import Value
from sensorgen.design.values import lead_ranges, material_value, spread
from sensorgen.models.overlap import edge_fringe_f
from sensorgen.prediction import bodies, compression_law
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.quantities import MULTIMETER, WEIGHT, WIDE
from sensorgen.prediction.query import Query
from sensorgen.prediction.results import _change

pytestmark = pytest.mark.usefixtures("shared_cache")
EPS0 = 8.8541878128e-12
OWN = "title: own\nabout: own\ncolour: '#cccccc'\nconductor: {}\ncitations: {{lab: own}}\nproperties: {{{}}}\n"


def own(folder, conductor, text):
    """A design of tri whose electrodes or film are of a material of the user's own."""
    (folder / "materials").mkdir(exist_ok=True)
    (folder / "materials" / "own.yaml").write_text(OWN.format(str(conductor).lower(), text), "utf-8")
    parts = ("top_electrode", "bottom_electrode") if conductor else ("film", "dielectric", "isolation")
    data = {"shape": "reference", "materials": dict.fromkeys(parts, "own"), "tools": {"own": 1 if conductor else 2}}
    return make(data, str(folder / "d.yaml"))


@pytest.mark.parametrize("quantity", sorted(values.LN_SOURCES))
def test_spread_of_one_source_is_that_of_materials_with_several(quantity):
    """Pooled over the packs, conductors' permittivities left out: they decide nothing."""
    squares = freedom = 0.0
    for file in packs.files("materials"):
        material = materials.load(file.name)
        several = [log(v.value) for v in material.properties.get(quantity, []) if not v.implausible]
        if file.pack.where == "shipped" and len(several) > 1 and (quantity[:3] != "rel" or not material.conductor):
            squares += sum((x - mean(several)) ** 2 for x in several)
            freedom += len(several) - 1
    assert values.LN_SOURCES[quantity] == pytest.approx(sqrt(squares / freedom), rel=0.03)


def test_one_source_or_its_own_deviation_is_the_range(tmp_path):
    """1.96 deviations of ln on either side; one that the file states goes before the packs'."""
    for text, factor in (("", exp(1.96 * 1.32)), (", sd: 0.05", exp(1.96 * 0.1)), (", low: 0.4, high: 0.6", 1.2)):
        design = own(tmp_path, True, f"resistivity_ohm_m: [{{value: 0.5, source: lab, default: true{text}}}]")
        ends = spread(design, values.resistivities(design)["top"])
        assert ends[1] == pytest.approx(0.5 * factor, rel=1e-3)
        assert ends[0] == pytest.approx(0.5 / factor if "low" not in text else 0.4, rel=1e-3)
    with pytest.raises(BadInput, match="sd beside low or high"):
        own(tmp_path, True, "resistivity_ohm_m: [{value: 0.5, source: lab, default: true, sd: 0.1, low: 0.4}]")


def test_deviation_is_kept_as_ends_so_that_identities_last():
    stored = Value(value=5.0, source="a", sd=0.5).model_dump()
    assert "sd" not in stored
    assert Value(**stored).high == pytest.approx(5 * exp(1.96 * 0.1), rel=1e-4)
    assert set(Value(value=5.0, source="a").model_dump()) == {
        "value", "source", "default", "implausible", "note", "low", "high",
    }  # fmt: skip


def test_nothing_of_a_material_is_certain():
    found = evaluate(bodies.drawn(make({"shape": "tri"})))
    for bounds in (found.capacitance, *found.resistance.values(), found.sensitivity):
        assert bounds.material.lower < bounds.value
        assert bounds.value < bounds.material.upper or bounds.open == "upper"  # softer than the law reaches


def test_a_conductor_without_a_ratio_senses_force(monkeypatch, tmp_path):
    """Filaflex has none: in the range, the plate that was taken in its place is not. Pressed by 6 N alone."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path))
    monkeypatch.setattr(compression_law, "STRESS_PA", (0.0, 6e4, 1.2e5))
    electrodes = dict.fromkeys(("top_electrode", "bottom_electrode"), "filaflex-conductive")
    design = make({"shape": "tri", "materials": electrodes, "tools": {"filaflex-conductive": 1}})
    assert material_value(design.material("filaflex-conductive"), "", "poisson_ratio").source == values.ASSUMED
    found = evaluate(bodies.drawn(design))
    assert 0.1 < found.force_resolution.value < 0.4
    assert "cannot sense" not in " ".join(str(part) for part in found.summary())


def test_hardness_bounds_a_modulus():
    """Gent's relation against the filaments that have both: 3 of 5 within a factor of 2, all within the range."""
    for name in ("x60", "etpu", "filaflex-82a", "filaflex-conductive", "etpu-95-250"):
        material = materials.load(name)
        without = material.model_copy(update={"properties": material.properties | {"youngs_modulus_pa": []}})
        design = SimpleNamespace(material=lambda _, of=without: of)
        low, high = spread(design, material_value(without, "", "youngs_modulus_pa"))
        assert low < material.value("youngs_modulus_pa").value < high


def test_edge_of_plates_by_kirchhoff():
    """Round thin plates (1877): C = eps0 pi R^2 / d + eps0 R (ln(16 pi R / d) - 1); Palmer's is of a strip."""
    for d in (1e-4, 1e-3, 5e-3):
        disc = EPS0 * 0.05 * (log(16 * pi * 0.05 / d) - 1)
        assert disc < edge_fringe_f(2 * pi * 0.05, d, 0.1) < 1.15 * disc
    assert edge_fringe_f(1.0, 1e-3, 0.1, 1e-3) > edge_fringe_f(1.0, 1e-3, 0.1)


@pytest.mark.parametrize(("radius_m", "gap_mm", "measured"), [(0.09, 1, 230), (0.05, 5, 20)])
def test_air_plates_of_laboratories_are_inside(radius_m, gap_mm, measured):
    """As published in pF; squares of equal area."""
    side = radius_m * sqrt(pi) * 1e3
    own_air = {"x60": {"relative_permittivity": 1.0006}}
    size = {"length_mm": side, "width_mm": side, "electrode_mm": 2.0, "dielectric_mm": float(gap_mm)}
    c = evaluate(bodies.drawn(make({"shape": "reference", "parameters": size, "material_values": own_air}))).capacitance
    assert c.lower < measured * 1e-12 < c.upper
    assert c.upper / c.lower < 2.2


def test_leads_are_a_two_port_in_front_of_the_line():
    """ABCD matrices of a resistor and of a capacitor across, and differences for the slopes."""
    sensor = sensor_of(make({"shape": "reference"})).sensor
    led = replace(sensor, lead_ohm=120.0, lead_f=3e-12)
    tones, force, place = np.array([1.1e3, 99.7e3]), 3.0, 0.04
    z = sensor.impedance(tones, force, place)
    for k, f in enumerate(tones):
        a, b, c, d = (np.array([[1, 120.0], [0, 1]]) @ np.array([[1, 0], [2j * pi * f * 3e-12, 1]])).ravel()
        assert abs(led.impedance(tones, force, place)[k] / ((a * z[k] + b) / (c * z[k] + d)) - 1) < 1e-12
    by_force = (led.impedance(tones, force + 1e-4, place) - led.impedance(tones, force - 1e-4, place)) / 2e-4
    assert led.response(tones, force, place).by_force_ohm_per_n == pytest.approx(by_force, rel=1e-6)


def test_leads_that_are_stated_are_known_to_a_tenth():
    stated = make({"shape": "tri", "leads": {"capacitance_pf": 2.0, "resistance_ohm": 0.0}})
    (c, least, most), ohm = lead_ranges(stated)
    assert (c, least, most) == pytest.approx((2e-12, 2e-12 / 1.1, 2.2e-12))
    assert ohm == (0.0, 0.0, 0.0)  # four wires
    assert lead_ranges(make({"shape": "tri"})) == ((0.0, 0.0, 5e-12), (0.0, 0.0, 4300.0))
    assert lead_ranges(make({"shape": "tri", "leads": {"guard": "driven"}}))[0][2] == pytest.approx(1e-13)
    silver = {"etpu": {"resistivity_ohm_m": 1e-6}}
    assert lead_ranges(make({"shape": "tri", "material_values": silver}))[1][2] == 1.0
    assert make({"shape": "tri", "leads": {}}).id() == make({"shape": "tri"}).id() != stated.id()


def test_four_wires_leave_no_contact():
    r = Bounds.of(100.0, "ohm", material=Interval(50.0, 200.0))
    assert r.plus(0.0, 0.0, 4300.0).alone() == r
    assert r.plus(5.0, 4.0, 6.0).value == 105.0


def test_a_wide_range_names_the_measurement_that_narrows_it(tmp_path):
    """A multimeter's reading as a source of its own, leads stated: then the range is as narrow as was said."""
    wide = evaluate(bodies.drawn(own(tmp_path, True, "resistivity_ohm_m: [{value: 0.07, source: lab, default: true}]")))
    said = {n.quantity: n for n in wide.narrowing}
    assert said["top electrode"].measurement == MULTIMETER
    assert said["top electrode"].factor == pytest.approx(wide.resistance["top"].upper / wide.resistance["top"].lower)
    assert all(n.factor > WIDE and n.left < n.factor for n in said.values())
    read = "{value: 0.07, source: lab, default: true, low: 0.0695, high: 0.0705}"
    known = own(tmp_path, True, f"resistivity_ohm_m: [{read}]")
    data = known.model_dump(exclude_defaults=True, mode="json") | {"leads": {"resistance_ohm": 0.0}}
    found = evaluate(bodies.drawn(make(data, str(tmp_path / "d.yaml"))))
    top = found.resistance["top"]
    assert top.upper / top.lower <= said["top electrode"].left
    assert "top electrode" not in {n.quantity for n in found.narrowing}


def test_a_permittivity_changes_the_rise_of_gaps_too(monkeypatch):
    """Of tri with X60 as its sources have it, solved anew: 1.27 times the sensitivity at most. Pressed by 6 N alone."""
    pytest.importorskip("netgen", reason="solves a cell: pip install sensorgen[fem]")
    design = make({"shape": "tri"})
    known = evaluate(bodies.drawn(design)).sensitivity
    (x60,) = (v for v in values.permittivities(design) if v.material == "x60")
    monkeypatch.setattr(compression_law, "STRESS_PA", (0.0, 6e4, 1.2e5))
    for eps in spread(design, x60):
        other = make({"shape": "tri", "material_values": {"x60": {"relative_permittivity": eps}}})
        value = evaluate(bodies.drawn(other), Query(law="solved"), keep=False).sensitivity.value
        assert known.material.lower <= value <= known.material.upper
    assert value > 1.2 * known.value


def test_force_of_a_soft_print_is_narrowed_by_a_weight():
    found = evaluate(bodies.estimated(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})))
    by = {n.quantity: n for n in found.narrowing}
    assert by["force resolution"].measurement == by["sensitivity"].measurement == WEIGHT
    assert by["force resolution"].left < by["force resolution"].factor < inf


def test_first_screen_has_the_figures_of_a_bench():
    found = evaluate(bodies.drawn(make({"shape": "tri"})))
    force, place = found.bench()
    known = found.identifiability.calibrated
    of_the_worst_top = (known.sigma_force_n, known.sigma_position_m)
    assert (force.value, place.value) == pytest.approx(of_the_worst_top, rel=0.01)
    alone = found.force_resolution.upper / found.force_resolution.value
    assert alone <= force.upper / force.value < 1.5 * alone  # the range holds all tops


def test_no_range_reads_0_to_0_percent():
    said = [_change(Interval(*ends), 1.0) for ends in ((1.0, 1.0), (0.99998, 1.00002), (1.0, 1.2), (0.9, 1.0))]
    assert said == ["none", "within 0.01 %", "0 to +20 %", "-10 to 0 %"]
