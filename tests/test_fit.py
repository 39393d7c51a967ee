"""Fits against a known truth, what the thesis's table can tell and what not, and the source that comes of it."""

import json
import math
import re
import statistics
from dataclasses import replace

import bench_files
import numpy as np
import pytest
import yaml
from drawn_sensor import sensor_of
from scipy import stats

from no_numbers import roughly_at_rest
from sensorgen.analysis.comparison import AllowedValues
from sensorgen.analysis.comparison.expected import Movable
from sensorgen.analysis.fit import fit, held_back
from sensorgen.analysis.fit.estimates import (
    Fit,
    Fitted,
    OfSpecimen,
    Untold,
    _of_prints,
    leak,
    resistivity,
    text,
    values,
)
from sensorgen.cli import cli
from sensorgen.core.document import text as document_text
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName
from sensorgen.design import materials, packs
from sensorgen.design.design import make
from sensorgen.design.materials import source_folder, source_path
from sensorgen.design.specimen_name import design_of, parse
from sensorgen.measure.log import Log, bench, exchange, notes, prints
from sensorgen.measure.signal.verdicts import across_ohm, along_ohm
from sensorgen.models import columns
from sensorgen.prediction import capacitance as prediction_of_c
from sensorgen.prediction.bodies import default_body, drawn
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.query import Query
from sensorgen.prediction.rest_state import lost, rest_state


@pytest.fixture(autouse=True)
def _own(monkeypatch, tmp_path):
    monkeypatch.setenv(packs.SOURCES, str(tmp_path / "materials"))


def value(made, quantity):
    return next(v for v in made.values if v.quantity == quantity)


@pytest.fixture(scope="module")
def of_thesis(tmp_path_factory):
    with Log(tmp_path_factory.mktemp("fit") / "log.db", create=True) as log, roughly_at_rest():
        exchange.thesis(log)
        return fit(log, 23)


def test_a_known_resistivity_and_leak_come_back(tmp_path):
    """Readings made by the closed form, of electrodes of 0.05 ohm m: between those with cogs, 0.86, and without."""
    design = design_of(parse("60 triX .1mm"))
    p = design.params
    squares = p.length_mm / (p.electrode_mm * p.width_mm) * 1e3
    r, area = 0.05 * squares * 0.93, p.length_mm * p.width_mm * 1e-6
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        for k in range(8):
            g = 2e-4 * 1.1 ** (k - 4)
            name = f"60 triX .1mm {k + 1}"
            log.add([notes.reading(name, f"{along_ohm(r, g):.9g}", f"{across_ohm(r, g):.9g}")])
        made = fit(log, 60)
    rho = value(made, "resistivity_ohm_m")
    assert rho.low < 0.05 < rho.high
    assert rho.value == pytest.approx(0.05, rel=0.35)
    conductance = value(made, "leak_s_per_m2")
    assert conductance.value == pytest.approx(2e-4 / area, rel=0.25)
    assert len(made.held_back) == 2
    assert made.errors[0].after < made.errors[0].before


def test_readings_of_electrodes_of_two_materials_are_no_resistivity_of_one(tmp_path):
    (tmp_path / "two.yaml").write_text(
        "shape: tri\nmaterials: {bottom_electrode: filaflex-conductive}\ntools: {filaflex-conductive: 1}\n"
    )
    names = [f"T{k}" for k in range(6)]
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        prints.bind(log, names, str(tmp_path / "two.yaml"))
        log.add([notes.reading(name, "1.5k", "OL", log=log) for name in names])
        made = fit(log, None, specimens=names)
    assert not made.values
    assert not made.groups
    (why,) = (untold.why for untold in made.untold if untold.parameter == "resistivity_ohm_m along")
    assert "etpu and filaflex-conductive: not determined which" in why


def test_the_interval_of_a_resistivity_is_as_wide_as_the_bounds_and_the_scatter():
    same = [AllowedValues(math.log(0.03), math.log(0.06), math.nan)] * 9
    found = resistivity(same, "etpu")
    assert (found.value, found.low, found.high) == pytest.approx((math.sqrt(0.03 * 0.06), 0.03, 0.06))
    ends = [0.02, 0.025, 0.03, 0.035, 0.04, 0.05, 0.06]
    scattered = [AllowedValues(math.log(v), math.log(v), math.nan) for v in ends]
    wide = resistivity(scattered, "etpu")
    assert wide.value == pytest.approx(statistics.median(ends))
    reach = stats.t.ppf(0.975, 6) * statistics.stdev(map(math.log, ends)) * math.sqrt(8 / 7)  # of one more print
    assert (wide.low, wide.high) == pytest.approx((wide.value / math.exp(reach), wide.value * math.exp(reach)))
    assert isinstance(resistivity(same[:2], "etpu"), Untold)


def test_specimens_of_one_plate_do_not_tell_how_prints_differ():
    """Seven specimens of a plate that agree: the next print may differ as those of the thesis, by a factor of 1.45."""
    plate = [AllowedValues(at, at, print="P1") for at in np.log([0.0400, 0.0404, 0.0396, 0.0400, 0.0402, 0.0398, 0.04])]
    found = resistivity(plate, "etpu")
    assert found.high / found.value == pytest.approx(1.45 ** (stats.t.ppf(0.975, 35) * math.sqrt(2)), rel=1e-3)
    alone = resistivity([replace(one, print="") for one in plate], "etpu")  # each a print of its own
    assert alone.high / alone.value < 1.03


def test_ac_readings_of_a_dry_joint_are_no_resistivity(tmp_path):
    """Multimeter: 25 times what the other specimens have."""
    names = [f"60 SX60 {k}" for k in range(2, 7)]
    rows = [
        notes.reading(name, ohm, "OL")
        for name, ohm in zip(names, ("1.2k", "1.3k", "1.25k", "1.22k", "30k"), strict=True)
    ]
    joint = notes.with_ac(notes.reading(names[-1]), {"R": ["20k@100kHz"], "X": ["-27kohm@100kHz"]})
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        log.add([*rows, joint])
        found = value(fit(log, 60, held_share=0.0), "resistivity_ohm_m")
    assert found.high / found.low < 2.0


def test_tight_films_and_leaks_that_differ_by_decades_are_no_property():
    films = [AllowedValues(0.0, 0.0, leak=at) for at in (-7.0, -7.01, -7.02, -math.inf)]
    assert isinstance(leak(films[:3], "x60", 1), Fitted)
    assert "1 of 4 films are tight" in leak(films, "x60", 1).why
    decades = [AllowedValues(0.0, 0.0, math.log(10.0**k)) for k in range(-3, 4)]
    assert "no property of x60" in leak(decades, "x60", 1).why


def test_a_specimen_counts_once_however_often_it_was_read(tmp_path):
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        log.add([notes.reading("60 triX .1mm 1", f"{ohm}", "OL") for ohm in (2000, 2001, 2002, 2001)])
        assert "1 specimen with sound electrodes" in next(u.why for u in fit(log, 60).untold if "along" in u.parameter)


def test_what_the_thesis_table_tells_and_what_not(of_thesis):
    rho = value(of_thesis, "resistivity_ohm_m")
    assert rho.material == "etpu"
    assert rho.low < 0.042 < rho.high  # the ladder of tests/report/test_contents.py, of all specimens
    assert rho.value == pytest.approx(0.042, rel=0.1)
    told = {u.parameter for u in of_thesis.untold}
    assert told == {"resistivity_ohm_m across", "relative_permittivity", "youngs_modulus_pa", "leak"}
    assert [v.quantity for v in of_thesis.values] == ["resistivity_ohm_m"]
    error = of_thesis.errors[0]
    assert error.count == len(of_thesis.held_back) == 12
    assert error.after == pytest.approx(error.before, rel=0.1)  # the default is what the table says


def test_groups_are_predicted_by_the_others(of_thesis):
    """45 of 53 readings, broken electrodes among them, and no shape or direction apart from the others."""
    assert {g.group: g.readings for g in of_thesis.groups} == {"tri X": 12, "tri Y": 18, "rect XY": 12, "rect YX": 11}
    assert sum(g.inside for g in of_thesis.groups) >= 45
    assert all(0.7 < g.ratio < 1.4 for g in of_thesis.groups)
    assert "Leaving out a group: 45 of 53 readings within the range" in "\n".join(document_text(of_thesis.document()))


def test_the_default_of_the_electrodes_is_what_the_command_makes_of_the_thesis(capsys):
    with roughly_at_rest():
        cli.main(["fit", "--thesis", "--dry-run", "--json"], standalone_mode=False)
    (row,) = json.loads(capsys.readouterr().out)["values"]
    default = materials.load("etpu").value("resistivity_ohm_m")
    assert default.source == "thesis-d.1"
    expected = (default.value, default.low, default.high)
    assert (row["value"], row["low"], row["high"]) == pytest.approx(expected, rel=5e-3)


def test_specimens_held_back_have_no_say(tmp_path):
    """Whatever they read, the values stay the same; only the error tells."""
    names = [f"60 triX .1mm {k + 1}" for k in range(8)]
    kept_back = held_back(sorted(names), 23)
    made = []
    for factor in (1.0, 2.0):
        with Log(tmp_path / f"{factor}.db", create=True) as log, roughly_at_rest():
            for k, name in enumerate(names):
                ohm = (600 + 30 * k) * (factor if name in kept_back else 1.0)
                log.add([notes.reading(name, f"{ohm:g}", "OL")])
            made.append(fit(log, 60))
    assert set(made[0].held_back) == set(made[1].held_back) == kept_back
    assert made[0].values == made[1].values
    assert made[0].errors[0].after != pytest.approx(made[1].errors[0].after)


def test_the_next_prediction_takes_the_source(of_thesis, tmp_path):
    source_folder().mkdir()
    source_path("fit-23").write_text(text(of_thesis), "utf-8")
    rho = value(of_thesis, "resistivity_ohm_m").value
    taken = {"top_electrode": "etpu@fit-23", "bottom_electrode": "etpu@fit-23"}
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}, "materials": taken})
    p, found = design.params, evaluate(drawn(design), Query(law="unconfined"))
    ohm = rho * p.length_mm / (p.electrode_mm * p.width_mm) * 1e3
    told = {end: r.value for end, r in found.resistance.items()}
    assert told == pytest.approx({"top": 0.845677 * ohm, "bottom": ohm}, rel=1e-5)
    assert {v.source for v in found.values if v.material == "etpu" and "resistivity" in v.quantity} == {"fit-23"}
    assert materials.citations()["fit-23"].startswith("fit of iteration 23: 36 specimens, 12 held back")


def test_a_source_changes_no_design_that_does_not_name_it(of_thesis):
    before = make({"shape": "tri"}).id()
    source_folder().mkdir()
    source_path("fit-23").write_text(text(of_thesis), "utf-8")
    assert make({"shape": "tri"}).id() == before
    named = make({"shape": "tri", "materials": {"top_electrode": "etpu@fit-23"}}).id()
    source_path("fit-23").write_text(re.sub(r"(value: 0\.0\d)", r"\g<1>1", text(of_thesis)), "utf-8")
    assert make({"shape": "tri", "materials": {"top_electrode": "etpu@fit-23"}}).id() != named


@pytest.mark.parametrize(
    ("content", "error", "said"),
    [
        ("about: a\nmaterials: {etpu: {resistivity_ohm_m: {value: -1}}}", OutOfRange, "resistivity_ohm_m of etpu is"),
        ("about: a\nmaterials: {etpy: {resistivity_ohm_m: {value: 1}}}", UnknownName, "etpu"),
        ("about: a\nmaterials: {etpu: {resistivity_ohm_m: {value: much}}}", BadInput, "value"),
        ("about: a", BadInput, "materials"),
        ("{", BadInput, "fit-1.yaml"),
    ],
)
def test_damaged_sources_are_told_with_their_file(content, error, said):
    source_folder().mkdir()
    source_path("fit-1").write_text(content, "utf-8")
    with pytest.raises(error, match=said) as caught:
        make({"shape": "tri", "materials": {"top_electrode": "etpu@fit-1"}})
    assert "fit-1.yaml" in str(caught.value)
    assert make({"shape": "tri"})  # nobody else minds


def test_words_in_a_source_are_text():
    bad = 'a": }\n# b: [&x]'
    found = (Fitted("etpu", "resistivity_ohm_m", 1.0, 0.5, 2.0, bad),)
    made = Fit(1, (), 1, found, (Untold("E", bad),), (), 1, (), (), bad)
    data = yaml.safe_load(text(made))
    assert data["materials"]["etpu"]["resistivity_ohm_m"]["note"] == bad
    assert set(data) == {"about", "materials"}


def test_recordings_give_back_what_they_were_made_with(tmp_path):
    """Factors to the prediction: resistivity 0.5, capacitance 1.3, modulus 0.5; a leak of 2 nS on 10 cm2.

    Values are as sure as a bench is that may have a lead, a stray capacitance and gains of its own.
    """
    names = [f"30 triX .1mm {k}" for k in (1, 2)]
    design = design_of(parse(names[0]))
    sensor = bench_files.truth(design, **bench_files.TRUTH)
    with Log(tmp_path / "log.db", create=True) as log:
        for k, name in enumerate(names):
            bench.log_recording(log, name, *bench_files.write(tmp_path, f"run{k}", sensor, count=5, seed=k + 1))
        made = fit(log, 30)
    rho = value(made, "resistivity_ohm_m")
    assert rho.low < 0.5 * 0.042 < rho.high
    assert rho.value == pytest.approx(0.5 * 0.042, rel=0.05)  # a lead of some ohm has its share of 1.3 kohm
    assert value(made, "youngs_modulus_pa").value == pytest.approx(0.5 * 6e6, rel=0.015)
    leak_ = next(u.why for u in made.untold if u.parameter == "leak")  # 0.3 % of what C takes: a phase of 0.2 degrees
    assert 2e-9 / 1e-3 < float(leak_.partition("no more than ")[2].split()[0]) < 3 * 2e-9 / 1e-3
    eps = value(made, "relative_permittivity")
    known = materials.load("x60").value("relative_permittivity").value

    def capacitance(permittivity):
        data = {"shape": "tri", "parameters": {"dielectric_mm": 0.1}}
        own_value = {"x60": {"relative_permittivity": permittivity}}
        return rest_state(default_body(make(data | {"material_values": own_value})), ranges=False).capacitance.value

    assert capacitance(eps.value) / capacitance(known) == pytest.approx(1.3, rel=1.5e-2)
    assert eps.high / eps.low > 1.5  # the bounds of the cell's model are in it
    for v in made.values:
        assert v.low < v.value < v.high


def test_a_leak_comes_back_in_the_next_prediction(tmp_path):
    """A film that leaks a third of what it stores at the lowest tone: measured, fitted, kept, predicted."""
    design, name = design_of(parse("30 triX .1mm")), "30 triX .1mm 1"
    sensor = bench_files.truth(design, resistivity=0.5, capacitance=1.2, leak_s=4e-7)
    with Log(tmp_path / "log.db", create=True) as log:
        bench.log_recording(log, name, *bench_files.write(tmp_path, "run", sensor, count=3))
        made = fit(log, 30)
    source_folder().mkdir()
    source_path("fit-30").write_text(text(made), "utf-8")
    taken = {"top_electrode": "etpu@fit-30", "bottom_electrode": "etpu@fit-30", "dielectric": "x60@fit-30"}
    plain = Query(law="unconfined")  # no load is asked for
    fitted = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}, "materials": taken})
    found, unfitted = (evaluate(default_body(d), plain, beside=False) for d in (fitted, design))
    truth = [complex(sensor.impedance(z.frequency_hz, 0.0, 0.05)) for z in found.impedance]
    for z, now in zip(truth, found.impedance, strict=True):
        assert (now.re.value, now.im.value) == (pytest.approx(z.real, rel=0.07), pytest.approx(z.imag, rel=0.03))
    assert unfitted.impedance[0].re.value < truth[0].real / 20
    assert {"leak_s_per_m2": "fit-30"}.items() <= {v.quantity: v.source for v in found.values}.items()
    line_of = sensor_of(make({"shape": "tri", "materials": taken})).sensor
    assert line_of.leak_s_per_m * line_of.length_m == pytest.approx(4e-7, rel=0.03)


def test_a_leak_that_the_design_sets_itself_is_per_area():
    given = {"shape": "tri", "parameters": {"width_mm": 20.0}, "material_values": {"x60": {"leak_s_per_m2": 1e-3}}}
    assert lost(make(given)).leak_s == pytest.approx(1e-3 * 20e-3 * 0.1, rel=1e-12, abs=0)


def test_few_prints_are_less_sure_than_their_scatter():
    """Student, with a prior of 10 % that is worth three prints; one print, or one plate, is never the material."""
    mean, error = _of_prints([("a", (1.0, 1e-9)), ("b", (1.2, 1e-9))])
    scatter = ((3 * 0.1**2 + 2 * 0.1**2) / 4) ** 0.5
    assert (mean, 2 * error) == (pytest.approx(1.1), pytest.approx(stats.t.ppf(0.975, 4) * scatter * 1.5**0.5))
    assert _of_prints([("a", (1.0, 0.3)), ("b", (1.0, 0.4))]) == (1.0, pytest.approx(0.25))
    alone = 1.1, pytest.approx(stats.t.ppf(0.975, 3) * 0.1 / 2**0.5)
    assert _of_prints([("plate", (at, 1e-9)) for at in (1.0, 1.2, 1.1)]) == (pytest.approx(alone[0]), alone[1])


def test_an_interval_holds_95_of_100_further_prints():
    """Eight prints that scatter by 15 %, each known to 4 %, and a ninth."""
    rng, inside = np.random.default_rng(2), []
    for _ in range(600):
        *eight, ninth = 0.15 * rng.standard_normal(9)
        mean, error = _of_prints((at, (at + 0.04 * rng.standard_normal(), 0.04)) for at in eight)
        inside.append(abs(ninth - mean) < 2 * error)
    assert 0.92 < np.mean(inside) < 0.98


PILLARS = "shape: pillar\nname: pillars\nparameters: {length_mm: 20, width_mm: 5}\n"
EPS_TRUE = 5.2


def pillars_f(permittivity, end):
    """Closed form of electrode pillars, 0.8 mm wide every 1.25 mm and 0.4 mm high, on 0.2 mm of film, 20 x 5 mm [F].

    The lower end of the field-free bounds is the limit of wide pillars, columns in parallel; the upper end that of fine
    ones, which shield the air between them: a plate on the film.
    """
    share, film, air = 0.8**2 / 1.25**2, 0.2e-3 / permittivity, 0.4e-3 / 1.00059
    covered = {"lower": share / film + (1 - share) / (film + air), "upper": 1 / film}
    return 8.8541878128e-12 * 20e-3 * 5e-3 * covered[end]


@pytest.fixture
def bounded(monkeypatch, unpressed, tmp_path):
    """No model of the cell but the closed-form bounds."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(prediction_of_c, "capacitance_models", lambda: {"columns": columns})


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_the_interval_of_a_permittivity_covers_prints_at_the_end_of_the_models_bounds(end, bounded):
    """40 fits of five prints each, whose capacitances scatter by 10 % about an end of the bounds, read to 2 %."""
    of, rng = Movable(drawn(make(yaml.safe_load(PILLARS)))), np.random.default_rng(7)
    predicted, hits = of.model.sensor.capacitance_f(), 0
    for _ in range(40):
        read = pillars_f(EPS_TRUE, end) * np.exp(rng.normal(0, math.hypot(0.1, 0.02), 5))
        off, none = np.log(read / predicted).tolist(), (0.0, math.inf)
        prints = [OfSpecimen(str(k), str(k), of, none, (c, 0.02), None, None) for k, c in enumerate(off)]
        (found,) = (one for one in values(prints) if isinstance(one, Fitted))
        hits += found.low <= EPS_TRUE <= found.high
    assert hits >= stats.binom.ppf(1e-3, 40, 0.95)


def test_a_cell_at_the_end_of_the_models_bounds_is_fitted_from_the_log(bounded, tmp_path):
    (tmp_path / "pillars.yaml").write_text(PILLARS)
    names, rng = [f"P{k}" for k in range(3)], np.random.default_rng(3)
    with Log(tmp_path / "log.db", create=True) as log:
        prints.bind(log, names, str(tmp_path / "pillars.yaml"))
        for name in names:
            pf = 1e12 * pillars_f(EPS_TRUE, "upper") * math.exp(rng.normal(0, 0.02))
            log.add([notes.with_ac(notes.reading(name, log=log), {"Cp": [f"{pf:.6g}pF@1kHz"]})])
        eps = value(fit(log, None, specimens=names, body_of=drawn), "relative_permittivity")
    assert eps.low <= EPS_TRUE <= eps.high
    c = math.log(pillars_f(EPS_TRUE, "upper") / pillars_f(EPS_TRUE, "lower"))
    assert c < math.log(eps.high / eps.low) < 2 * c


def test_nothing_to_fit_to(tmp_path):
    with Log(tmp_path / "log.db", create=True) as log, pytest.raises(BadInput, match="no readings of sound electrodes"):
        fit(log, 23)


@pytest.mark.usefixtures("roughly")
def test_the_command(tmp_path, capsys):
    place = str(tmp_path / "log.db")
    with Log(tmp_path / "log.db", create=True) as log:
        for k in range(6):
            log.add([notes.reading(f"60 triX .1mm {k + 1}", f"{600 + 10 * k}", "OL")])
    assert not cli.main(["fit", "--iteration", "60", "--log", place, "--dry-run"], standalone_mode=False)
    assert packs.source_names() == []
    cli.main(["fit", "--iteration", "60", "--log", place], standalone_mode=False)
    said = capsys.readouterr().out
    assert "--material electrode=etpu@fit-60" in said
    assert "not determined: relative_permittivity" in said
    assert packs.source_names() == ["fit-60"]
    with pytest.raises(SensorgenError):
        cli.main(["fit", "--iteration", "61", "--log", place], standalone_mode=False)


@pytest.mark.usefixtures("roughly")
def test_specimens_of_any_name(tmp_path, capsys):
    """Three plates of an own design, bound by their names: an LCR meter's C 20 % above the prediction, and R_Y."""
    place, file = str(tmp_path / "log.db"), tmp_path / "mine.yaml"
    file.write_text("shape: tri\nname: mine\nparameters:\n  dielectric_mm: 0.2\n")
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})
    c_pf = rest_state(drawn(design), ranges=False).capacitance.value * 1e12
    resistance = max(r.value for r in rest_state(drawn(design), ranges=False).resistance.values())
    for k, name in enumerate(("S1", "S2", "S3")):
        words = ["--design", str(file), "--y", f"{resistance * (0.97 + 0.03 * k):.6g}"]
        words += ["--C", f"{1.2 * c_pf * (0.99 + 0.01 * k):.6g}pF@1kHz", "--instrument", "HP 4284A"]
        assert not cli.main(["log", "add", name, *words, "--log", place], standalone_mode=False)
    cli.main(["fit", "S1", "S2", "S3", "--drawn", "--log", place], standalone_mode=False)
    said = " ".join(capsys.readouterr().out.split())
    assert "S1, S2, S3: fitted to 3, 0 held back" in said
    (source,) = packs.source_names()
    assert source.startswith("fit-s1-")
    fitted = yaml.safe_load(source_path(source).read_text("utf-8"))["materials"]
    eps = fitted["x60"]["relative_permittivity"]
    data = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}, "materials": {"dielectric": f"x60@{source}"}}
    assert rest_state(drawn(make(data)), ranges=False).capacitance.value * 1e12 == pytest.approx(1.2 * c_pf, rel=0.02)
    assert eps["low"] < eps["value"] < eps["high"]
    # a specimen of which one quantity is known, and one whose repeats are all but equal, take nothing away
    few = (("--Cs", f"{1.2 * c_pf:.6g}pF@1kHz"), ("--C", f"{1.2 * c_pf:.9g}/{1.2 * c_pf * (1 + 1e-13):.16g}pF@4kHz"))
    for name, words in zip(("S4", "S5"), few, strict=True):
        assert not cli.main(["log", "add", name, "--design", str(file), *words, "--log", place], standalone_mode=False)
        cli.main(["fit", name, "--drawn", "--dry-run", "--log", place], standalone_mode=False)
    capsys.readouterr()
    cli.main(["fit", "S1", "S2", "S3", "S4", "S5", "--drawn", "--log", place], standalone_mode=False)
    assert len(packs.source_names()) == 2  # other specimens, another source
    said = " ".join(capsys.readouterr().out.split())
    assert "relative_permittivity" in said.partition("not determined")[0]
    assert "resistivity_ohm_m" in said.partition("not determined")[0]
    words = ["log", "add", "S6", "--design", str(file), "--C", "1e999pF@1kHz", "--log", place]
    with pytest.raises(BadInput, match="no value"):
        cli.main(words, standalone_mode=False)
    with pytest.raises(BadInput, match="expected either specimens"):
        cli.main(["fit", "S1", "--iteration", "3", "--log", place], standalone_mode=False)
    with pytest.raises(BadInput, match="nobody"):
        cli.main(["fit", "nobody", "--log", place], standalone_mode=False)
