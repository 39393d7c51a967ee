"""AC readings in the report: beside the prediction of the print, with their uncertainty, verdicts and flags."""

import cmath
import itertools
import math
from dataclasses import replace

import pytest

from sensorgen.analysis.comparison import of_iteration
from sensorgen.analysis.comparison.expected import predicted
from sensorgen.analysis.report import alternating, report
from sensorgen.design.design import load
from sensorgen.measure.log import Log, notes, prints
from sensorgen.measure.log.prints import predicted_rows
from sensorgen.prediction import bodies

PF = 1e-12


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    path = tmp_path_factory.mktemp("designs") / "plate.yaml"
    path.write_text("shape: reference\nname: plate\nparameters: {dielectric_mm: 0.4}\n")
    return path


@pytest.fixture
def logged(tmp_path, design):
    """A log with a stored prediction and readings of specimens of any name."""

    def call(**readings):
        with Log(tmp_path / "log.db", create=True) as log:
            prints.bind(log, list(readings), str(design))
            log.add(predicted_rows(load(design)))
            for name, (instrument, typed) in readings.items():
                log.add([notes.with_ac(notes.reading(name, instrument=instrument, log=log), typed)])
            return report(log, None, specimens=list(readings)), of_iteration(log, None)

    return call


def rows(made):
    return next(t for t in made.tables if t.key == "ac").rows


def test_a_reading_stands_beside_the_stored_prediction(logged, design):
    made, found = logged(S1=("HP 4284A", {"Cp": ["60pF@10.1kHz"], "D": ["0.02@10.1kHz"]}))
    (row,) = rows(made)
    stored = found.predictions["plate"].prediction
    z = next(complex(one.re.value, one.im.value) for one in stored.impedance if one.frequency_hz == 10100)
    c = (1 / z).imag / (2 * math.pi * 10100)
    assert row.c_predicted_pf == pytest.approx(c / PF, rel=1e-9)
    assert row.c_predicted_pf == pytest.approx(stored.capacitance.value / PF, rel=0.01)  # the line drops little
    assert row.c_ratio == pytest.approx(60 * PF / c)
    assert row.z_ohm == pytest.approx(1 / (2 * math.pi * 10100 * 60 * PF) / math.hypot(1, 0.02))
    assert row.z_ratio == pytest.approx(row.z_ohm / abs(z))
    assert row.phase_deg == pytest.approx(-90 + math.degrees(math.atan(0.02)))
    limit = 0.05e-2 + 1.2e-3 / row.z_ohm + row.z_ohm * 1.07e-9
    assert row.c_error_pf == pytest.approx(60 * limit / math.sqrt(3) * math.hypot(1, 0.02), rel=1e-6)
    assert "1 of 1 prediction was stored before anything was measured" in " ".join(made.findings)
    assert any(text.startswith("Capacitance of S1 at 10.1kHz: measured 60 ± 0.") for text in made.headline)


def test_the_headline_is_of_values_that_the_meter_can_measure(logged):
    made, _ = logged(S1=("HP 4284A", {"Cp": ["50pF@100Hz", "60pF@10.1kHz"], "D": ["0.02@100Hz", "0.02@10.1kHz"]}))
    assert [row.flag for row in rows(made)] == ["outside the range of HP 4284A", ""]
    assert any(text.startswith("Capacitance of S1 at 10.1kHz: measured 60 ± 0.") for text in made.headline)


def test_scatter_and_stated_uncertainty_add_in_squares(logged):
    made, _ = logged(S1=("", {"Cp": ["59/60/61±0.5pF@1kHz"]}))
    (row,) = rows(made)
    assert row.c_pf == pytest.approx(60)
    assert row.c_error_pf == pytest.approx(math.hypot(1 / math.sqrt(3), 0.5))
    made, _ = logged(S2=("a meter of ours", {"Cp": ["60pF@1kHz"]}))
    assert math.isnan(rows(made)[0].c_error_pf)  # nothing is known of it


def test_verdicts_go_by_frequency_and_flags_name_what_is_impossible(logged):
    made, _ = logged(
        leaky=("", {"R": ["80kohm@1kHz", "2kohm@10kHz"], "X": ["-20kohm@1kHz", "-9kohm@10kHz"]}),
        wrong=("HP 4284A", {"R": ["-11ohm@3MHz"], "X": ["-300ohm@3MHz"]}),
        alone=("", {"R": ["-3ohm@1kHz"]}),
    )
    found = {(row.specimen, row.frequency_hz): row for row in rows(made)}
    assert [found["leaky", f].verdict for f in (1e3, 1e4)] == ["leaking", "capacitor"]
    assert found["wrong", 3e6].flag == "negative resistance; outside the range of HP 4284A"
    ohm, farad = 2 * 0.042 * 0.1 / (0.3e-3 * 0.01), 8.8541878128e-12 * 4.68 * 0.1 * 0.01 / 0.4e-3  # electrodes, film
    line = cmath.sqrt(2j * math.pi * 3e6 * ohm * farad)
    by_tanh = (line * cmath.tanh(line) / ohm).imag / (2 * math.pi * 3e6)
    assert found["wrong", 3e6].c_predicted_pf == pytest.approx(1e12 * by_tanh, rel=1e-3)
    assert found["alone", 1e3].flag == "negative resistance"
    said = " ".join(made.findings)
    assert "By frequency: leaky: a capacitor from 10kHz on." in said
    assert "Flagged: 2 of 4 AC values (2 negative resistance, 1 outside the range of HP 4284A)" in said


def test_before_and_after_the_bake_stay_apart(tmp_path, design):
    defects = {"S1": ("hole", "zits"), "S2": ()}
    with Log(tmp_path / "log.db", create=True) as log:
        prints.bind(log, ["S1", "S2"], str(design))
        for name, baked in itertools.product(defects, (False, True)):
            one = notes.reading(name, "2k", "OL" if baked else "10", baked=baked, log=log)
            log.add([replace(one, defects=defects[name])])
        made = report(log, None)
    table = next(t for t in made.tables if t.key == "yield")
    assert {row.group for row in table.rows if row.by == "defect"} == {"hole, zits", "none"}
    of = {row.group: row for row in table.rows if row.by == "bake"}
    assert {name: (row.specimens, row.short) for name, row in of.items()} == {"baked": (2, 0), "not baked": (2, 2)}


def test_dc_resistances_have_the_meters_uncertainty_and_its_ranges(tmp_path, design):
    with Log(tmp_path / "log.db", create=True) as log:
        prints.bind(log, ["S1"], str(design))
        log.add([replace(notes.reading("S1", "600 / 602", "500M", instrument="HP 34401A", log=log), wires=4)])
        made = report(log, None)
    (row,) = next(t for t in made.tables if t.key == "readings").rows
    limit = 600 * 1e-4 + 1000 * 1e-5  # 0.010 % of the reading, 0.001 % of the 1 kohm range
    assert row.error_ohm == pytest.approx(math.hypot(2 / math.sqrt(2) / math.sqrt(2), limit / math.sqrt(3)))
    assert "Flagged: a resistance beyond the meter's ranges: S1 (HP 34401A)." in made.findings


def test_a_reading_at_any_frequency_is_compared_with_the_prediction_at_it(design, logged):
    frequencies = (500.0, 1700.0, 15e3, 100e3, 1e6)
    of = predicted(bodies.default_body(load(design)))
    r, c = (sum(one.value for one in of.prediction.resistance.values()), of.prediction.capacitance.value)
    for f in frequencies:  # a line of R and C, open at its end, fed at one end of both electrodes
        gamma = (2j * math.pi * f * r * c) ** 0.5
        assert of.impedance_at(f)[0] == pytest.approx(r / gamma / cmath.tanh(gamma), rel=1e-9)
    made, _ = logged(S1=("", {"Cp": ["60pF@100kHz", "60pF@1MHz"], "D": ["0.02@100kHz", "0.02@1MHz"]}))
    assert "Capacitance of S1 at 100kHz" in " ".join(made.headline)
    sums = [sum(getattr(one, end) for one in of.prediction.resistance.values()) for end in ("lower", "upper")]
    known = of.prediction.capacitance
    for row in rows(made):  # resistive enough that the electrodes decide its range
        ends = []
        for r, c in itertools.product(sums, (known.lower, known.upper)):
            gamma = (2j * math.pi * row.frequency_hz * r * c) ** 0.5
            ends.append(1e12 * (gamma * cmath.tanh(gamma) / r).imag / (2 * math.pi * row.frequency_hz))
        assert (row.c_from_pf, row.c_to_pf) == pytest.approx((min(ends), max(ends)), rel=1e-9)
    assert row.c_from_pf < 0.5 * 1e12 * known.lower


def test_the_leak_of_a_capacitor_is_judged_by_its_reactance(tmp_path, design):
    with Log(tmp_path / "log.db", create=True) as log:
        prints.bind(log, ["S1", "S2"], str(design))
        log.add([notes.reading(name, "2k", word, log=log) for name, word in (("S1", "45M"), ("S2", "10M"))])
        made, found = report(log, None), of_iteration(log, None)
    assert [row.verdict.word for row in found.rows] == ["intact", "leak"]
    c = found.predictions["plate"].prediction.capacitance.value
    limit = 10 / (2 * math.pi * 1100 * c)
    assert abs(1 + 1j * 10) / 10 - 1 == pytest.approx(0.005, rel=0.01)  # of a leak of ten reactances
    assert f"1 of the 2 testable sensors is intact (film from {limit / 1e6:.3g} Mohm on)" in " ".join(made.headline)


def test_bake_shrinkage_and_defects_stand_beside_their_change(tmp_path, design):
    shrunk = tmp_path / "shrunk.yaml"
    shrunk.write_text(design.read_text() + "shrinkage: 0.2\n")
    with Log(tmp_path / "log.db", create=True) as log:
        prints.bind(log, ["S1"], str(shrunk))
        for baked, ohm, farad, defects in ((False, "2k", "100pF", ()), (True, "1.5k", "62pF", ("hole",))):
            one = notes.reading("S1", ohm, "50M", baked=baked, log=log)
            typed = {"Cp": [f"{farad}@100kHz"], "D": ["0.02@100kHz"]}
            log.add([notes.with_ac(replace(one, defects=defects), typed)])
        made = report(log, None, specimens=["S1"])
    first, second = next(t for t in made.tables if t.key == "changes").rows
    assert (first.against, first.bake, first.shrinkage_percent) == ("prediction", "not baked", 20)
    assert (second.against, second.bake, second.defects) == ("reading 1", "baked", "hole")
    changes = (second.electrode_change, second.film_change, second.capacitance_change, second.expected_change)
    assert changes == pytest.approx((0.75, 1, 0.62, 0.64))
    said = "baked, hole) against reading 1: electrode resistance x 0.75, film resistance x 1, C at 100kHz x 0.62"
    assert said in " ".join(made.findings)


def test_words_for_a_verdict_that_changes_over_frequency():
    said = alternating.capacitor_from
    assert said({1e3: "capacitor", 1e4: "capacitor"}) == "a capacitor at 1kHz to 10kHz"
    assert said({1e3: "capacitor", 1e4: "leaking"}) == "no capacitor up to 10kHz"
    assert said({1e3: "capacitor", 5e3: "short", 1e4: "capacitor"}) == "a capacitor from 10kHz on"
