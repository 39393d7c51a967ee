"""``characterise``: the choice of coupons, the posterior, the form, and values that designs take."""

import dataclasses
import json
import re
from itertools import combinations_with_replacement
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np
import pytest
import virtual_lab

from sensorgen.analysis.characterise import Meters
from sensorgen.analysis.characterise import posterior as posteriors
from sensorgen.design.design import make
from sensorgen.design.values import resistivities, spread
from sensorgen.workflows.characterise import Study, _line_width, plan, read

METERS = Meters()
NAMES = (
    "bar-45-1.6", "bar-90-1.6", "ladder-0-0.8", "ladder-print-0.8", "plate-0.4-2", "plate-0.4-2.8", "disc-x60-8x6",
    "disc-x60-8x6-b", "disc-etpu-8x6", "disc-etpu-12x2", "pads-4x0.4-2x2.4",
)  # fmt: skip


@pytest.fixture(scope="module")
def study():
    return Study.of("diabase-h5", ["etpu", "x60"])


def named(study, names):
    """Coupons of these names; more than one of a kind have a letter behind it."""
    known = {c.name: c for c in study.coupons}
    return [dataclasses.replace(known[re.sub("-[bcd]$", "", name)], name=name) for name in names if name != "lines"]


@pytest.fixture(scope="module")
def coupons(study):
    return named(study, NAMES)


@pytest.fixture(scope="module")
def truth():
    return dataclasses.replace(virtual_lab.hidden(np.random.default_rng(5), NAMES), dead="")


@pytest.fixture(autouse=True)
def own_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("SENSORGEN_MATERIALS", str(tmp_path / "materials"))


def test_selection_equals_the_search_through_all_sets(study):
    rng = np.random.default_rng(1)
    some = [study.coupons[k] for k in sorted(rng.choice(len(study.coupons), 8, replace=False))]
    found = posteriors.candidates(some, study.unknowns, study.targets, METERS)
    most = 0.6 * sum(c.volume_mm3 for c in some)

    def fits(chosen):
        return sum(some[k].volume_mm3 for k in chosen) <= most

    every = [s for n in range(1, 5) for s in combinations_with_replacement(range(8), n)]
    allowed = [s for s in every if fits(s) and all(s.count(k) <= posteriors.COPIES for k in s)]
    best = max(allowed, key=found.worth)
    assert found.worth(posteriors.select(found, 4, fits)) == pytest.approx(found.worth(best), rel=1e-9)


def test_goals_of_the_issue_are_expected_within_four_hours(study):
    found = posteriors.candidates(study.coupons, study.unknowns, study.targets, METERS)
    chosen = posteriors.select(found, 11, lambda s: study.hours([study.coupons[k] for k in s]) <= 4)
    expected = found.expected(chosen, study.unknowns)
    missed = {t.quantity for t in study.targets if t.goal and expected.interval(t).half_width() > t.goal}
    assert not missed


def test_posterior_against_importance_sampling(study, coupons, truth):
    """The density of every set of dead coupons at once, by another derivation; a bar across the lines is dead."""
    rng = np.random.default_rng(11)
    broken = dataclasses.replace(truth, dead="bar-90-1.6")
    observed = [virtual_lab.measured(c, broken, METERS, rng) for c in coupons]
    found = posteriors.posterior(observed, study.unknowns)
    centre, spread = np.array([(u.centre, u.spread) for u in study.unknowns]).T

    def log_density(theta):
        values = {u.key: theta[:, k] if u.linear else np.exp(theta[:, k]) for k, u in enumerate(study.unknowns)}
        total = -0.5 * (((theta - centre) / spread) ** 2).sum(axis=1)
        for o in observed:
            sizes = {s.key: np.full(len(theta), s.drawn) for s in o.sizes}
            middle = np.log(np.stack(o.coupon.expected(values, sizes)))
            covariance = np.zeros((len(theta), len(middle), len(middle))) + np.diag(o.noise**2)
            for s in o.sizes:
                h = 1e-3 * s.spread
                up, down = (
                    np.log(np.stack(o.coupon.expected(values, sizes | {s.key: sizes[s.key] + d}))) for d in (h, -h)
                )
                by = ((up - down) / 2e-3).T
                covariance += by[:, :, None] * by[:, None, :]
            off = (o.log_values[:, None] - middle).T
            _, log_det = np.linalg.slogdet(2 * np.pi * covariance)
            alive = -0.5 * (off[:, None, :] @ np.linalg.solve(covariance, off[:, :, None]))[:, 0, 0] - 0.5 * log_det
            dead = -len(middle) * np.log(6 * np.log(10))
            total = total + np.logaddexp(np.log(0.95) + alive, np.log(0.05) + dead)
        return total

    count, freedom = 1200, 8.0
    best = found.modes[0]
    root = np.linalg.cholesky(best.covariance * 1.3)
    normal = rng.normal(size=(count, len(centre)))
    scale = np.sqrt(freedom / rng.chisquare(freedom, count))
    theta = best.at + (normal * scale[:, None]) @ root.T
    distance = (normal**2).sum(axis=1) * scale**2
    log_proposal = -(freedom + len(centre)) / 2 * np.log1p(distance / freedom)
    with np.errstate(all="ignore"):
        log_weight = log_density(theta) - log_proposal
    weight = np.exp(np.where(np.isfinite(log_weight), log_weight - np.nanmax(log_weight), -np.inf))
    weight /= weight.sum()
    assert 1 / (weight**2).sum() > 120  # effective samples
    assert found.dead()["bar-90-1.6"] > 0.99
    values = {u.key: theta[:, k] if u.linear else np.exp(theta[:, k]) for k, u in enumerate(study.unknowns)}
    for target in study.targets:
        at = target.value(values)
        order = np.argsort(at)
        low, middle, high = np.interp([0.025, 0.5, 0.975], np.cumsum(weight[order]), at[order])
        interval, sigma = found.interval(target), (high - low) / 3.92
        assert abs(interval.value - middle) < 0.25 * sigma, target.title
        assert (interval.high - interval.low) / (high - low) == pytest.approx(1, abs=0.15), target.title


@pytest.mark.nightly
def test_hidden_truth_of_a_few_labs(study, coupons):
    """A sample of bench/characterise.py, whose 400 labs cover more than 90 %."""
    rng, inside, found_dead = np.random.default_rng(23), [], 0
    for _ in range(5):
        truth = virtual_lab.hidden(rng, NAMES)
        found = posteriors.posterior([virtual_lab.measured(c, truth, METERS, rng) for c in coupons], study.unknowns)
        found_dead += truth.dead in found.dead()
        values = virtual_lab.true_targets(truth)
        for t in study.targets:
            value = values["conductor" if t.material == "etpu" else "dielectric", t.quantity]
            interval = found.interval(t)
            inside.append(interval.low <= value <= interval.high)
    assert np.mean(inside) >= 0.85
    assert found_dead >= 4


def test_wrong_model_is_seen_in_the_coverage(study, coupons, truth):
    """Planted fault: a form that forgets the joints of lines to and fro is off by more than its interval."""
    rng = np.random.default_rng(3)
    contact = dataclasses.replace(truth, line_contact_ohm_m2=4 * truth.bulk_ohm_m * 0.44e-3)
    observed = [virtual_lab.measured(c, contact, METERS, rng) for c in coupons if not c.name.startswith("bar-45")]

    def straight(values, sizes, line=0.44e-3):
        across = values["along_ohm_m"] + values["line_contact_ohm_m2"] / line
        bar = across * sizes["taps_mm"] / sizes["width_mm"] / sizes["height_mm"] * 1e3
        return (bar * sizes["fill"] * sizes["edge"],)

    target = next(t for t in study.targets if t.quantity == "resistivity_across_ohm_m")
    value = virtual_lab.true_targets(contact)["conductor", target.quantity]
    right = posteriors.posterior(observed, study.unknowns).interval(target)
    assert right.low <= value <= right.high
    at = next(k for k, o in enumerate(observed) if o.coupon.name == "bar-90-1.6")
    wrong = dataclasses.replace(observed[at], coupon=dataclasses.replace(observed[at].coupon, expected=straight))
    found = posteriors.posterior([*observed[:at], wrong, *observed[at + 1 :]], study.unknowns).interval(target)
    assert not found.low <= value <= found.high


def test_gaps_widen_intervals_and_nothing_else(study, coupons, truth):
    rng = np.random.default_rng(2)
    whole = [virtual_lab.measured(c, truth, METERS, rng) for c in coupons]
    target = next(t for t in study.targets if t.quantity == "relative_permittivity")
    unread = {k: np.full(len(o.noise), np.nan) for k, o in enumerate(whole) if o.coupon.kind == "plate"}
    without = [dataclasses.replace(o, log_values=unread.get(k, o.log_values)) for k, o in enumerate(whole)]
    full, gap = (posteriors.posterior(obs, study.unknowns) for obs in (whole, without))
    unknown = posteriors.prior(study.unknowns).interval(target).half_width()
    assert full.interval(target).half_width() < 0.05
    assert gap.interval(target).half_width() == pytest.approx(unknown, rel=1e-3)
    other = study.targets[1]
    assert gap.interval(other).value == pytest.approx(full.interval(other).value, rel=0.01)


@pytest.fixture(scope="module")
def planned(study, tmp_path_factory):
    out = tmp_path_factory.mktemp("plates")
    return plan(study, out, name="spool7")


def test_plate_has_all_files(planned, study):
    projects = {f"spool7.{slicer}.3mf" for slicer in ("prusa", "cura", "orca")}
    assert {"form.yaml", "plate.svg", "intervals.svg", "profiles/prusa/diabase-h5-fine.ini"} <= set(planned.files)
    assert projects <= set(planned.files)
    assert len(planned.coupons) <= 12
    assert planned.hours <= 4
    for name in ("plate.svg", "intervals.svg"):
        text = (planned.folder / name).read_text("utf-8")
        ElementTree.fromstring(text)
    assert all(name in (planned.folder / "plate.svg").read_text("utf-8") for name in planned.coupons[:-1])


def test_bars_have_lines_of_one_direction_and_others_the_profile(planned):
    with ZipFile(planned.folder / "spool7.prusa.3mf") as file:
        config = ElementTree.fromstring(file.read("Metadata/Slic3r_PE_model.config"))
    settings = {}
    for volume in config.iter("volume"):
        entries = {m.get("key"): m.get("value") for m in volume.iter("metadata")}
        settings[entries["name"]] = entries
    bar = next(v for k, v in settings.items() if k.startswith("bar-90"))
    assert (bar["fill_pattern"], bar["fill_angle"], bar["perimeters"]) == ("alignedrectilinear", "0", "0")
    disc = next(v for k, v in settings.items() if k.startswith("disc"))
    assert disc["fill_pattern"] == "rectilinear"
    assert {v["extruder"] for v in settings.values()} == {"3", "4"}


def filled(planned, study, truth, seed=4):
    blank = (planned.folder / "form.yaml").read_text("utf-8")
    return virtual_lab.filled(blank, named(study, planned.coupons), truth, METERS, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("walls_mm", "words"), [((0.45, 0.9), "as wide as"), ((0.44, 0.89), "0.010 mm narrower than"), ((0.46, 0.0), "")]
)
def test_walls_beside_their_lines(walls_mm, words):
    """Wider ones: from plate to prediction."""
    found = list(_line_width((*walls_mm, None, None), 0.44))
    expected = f"line width 0.450 mm (set 0.44); a wall is {words} its lines"
    assert found == [expected if words else "walls of 2 lines or fewer are not printed"]


@pytest.mark.usefixtures("unpainted")
def test_from_plate_to_prediction(planned, study, truth, tmp_path, run, unpressed):
    """The budget of a prediction shrinks to what the coupons leave open, and the truth lies within."""
    form, text = tmp_path / "form.yaml", filled(planned, study, truth)
    of_lines = {"vernier_x": -2, "wall_1_mm": 0.46, "wall_2_mm": 0.91, "film_1_short": "true", "film_2_short": "false"}
    for key, value in of_lines.items():
        text = text.replace(f"{key}: ~", f"{key}: {value}")
    form.write_text(text, "utf-8")
    refused = run("characterise", "read", form, "--name", "thesis-3.2")
    assert (refused.code, refused.out) == (2, "")
    assert "ships with sensorgen" in refused.err
    said = run("characterise", "read", form, "--name", "lab-spool7", "--picture", "after.svg").ok
    assert "<svg" in (tmp_path / "after.svg").read_text("utf-8")
    assert "doubtful" not in said.words
    assert "smallest film without a short: 2 layers" in said.words
    assert "x -0.20 mm" in said.words
    assert "line width 0.450 mm (set 0.44); a wall is 0.010 mm wider than its lines" in said.words
    own = [word for part in ("electrode=etpu", "dielectric=x60") for word in ("--material", f"{part}@lab-spool7")]
    budgets = []
    for more in ([], own):
        said = run("predict", "tri", "--drawn", "--force", 6, *more, "--json")
        budgets.append({t["name"]: t for t in json.loads(said.out)["prediction"]["budget"]["terms"]})
    before, after = budgets
    assert before["resistivity"]["changes"]["re"] == pytest.approx(0.088 / 0.042 - 1, rel=1e-3)  # of prints
    assert after["resistivity"]["changes"]["re"] < 0.06
    assert after["permittivity of x60"]["changes"]["magnitude"] < 0.04
    assert before["stiffness"]["at_least"]
    assert after["stiffness"]["changes"]["by_force"] < 0.15
    wrong = tmp_path / "wrong.yaml"  # the meter's range ten times too large
    wrong.write_text(re.sub(r"(_pf: )([\d.]+)", lambda m: f"{m[1]}{10 * float(m[2])}", form.read_text("utf-8")))
    said = run("characterise", "read", wrong, "--dry-run")
    assert "doubtful: relative_permittivity of x60" in said.words
    found = read(form, keep=False)
    values = virtual_lab.true_targets(truth)
    for row in found.rows:
        value = values["conductor" if row.material == "etpu" else "dielectric", row.quantity]
        assert row.low - 0.3 * (row.high - row.low) <= value <= row.high + 0.3 * (row.high - row.low), row.title


@pytest.mark.usefixtures("unpainted")
def test_a_form_with_readings_is_never_replaced(run, tmp_path):
    words = ("characterise", "diabase-h5", "etpu", "x60", "--count", "2", "--name", "p")
    form = tmp_path / "out" / "p" / "form.yaml"
    for _ in range(2):  # an empty one is
        assert run(*words).code == 0
    blank = form.read_text("utf-8")
    for text in (blank.replace(": ~", ": 3.1", 1), blank + "  : [\n"):
        form.write_text(text, "utf-8")
        assert (
            "form.yaml' has readings, or is damaged: move it away, or choose another plate's --name"
            in run(*words).refusal
        )
        assert form.read_text("utf-8") == text


def test_values_that_may_be_below_zero_are_taken_by_designs(run, study, tmp_path):
    """A gap that is not there is fitted below 0 as often as above."""
    (tmp_path / "materials").mkdir()
    lines = "".join(f"    {t.quantity}: {{value: -1e-6, low: -3e-6, high: 1e-6}}\n" for t in study.targets if t.linear)
    (tmp_path / "materials" / "lab-1.yaml").write_text(f"about: a fit\nmaterials:\n  x60:\n{lines}", "utf-8")
    assert run("check", "reference", "--length", "10", "--material", "dielectric=x60@lab-1").clean


def test_an_existing_source_is_replaced_on_request_alone(planned, study, truth, tmp_path, run):
    (tmp_path / "form.yaml").write_text(filled(planned, study, truth), "utf-8")
    assert run("characterise", "read", "form.yaml", "--name", "lab-1").code == 0
    kept = tmp_path / "materials" / "lab-1.yaml"
    kept.write_text("mine", "utf-8")
    assert (
        "lab-1.yaml: there is a source lab-1 already; choose another --name, or --force replaces it"
        in run("characterise", "read", "form.yaml", "--name", "lab-1").refusal
    )
    assert kept.read_text("utf-8") == "mine"
    assert run("characterise", "read", "form.yaml", "--name", "lab-1", "--force").code == 0
    assert kept.read_text("utf-8").startswith("about:")


@pytest.mark.usefixtures("unpainted")
def test_own_materials_and_printer_from_plate_to_values(run, tmp_path, monkeypatch, truth):
    """The form is read where nothing of the packs is, as the plate's folder keeps what it needs."""
    for words in (("printer", "mine"), ("material", "eel"), ("material", "gel")):
        assert run("new", *words).code == 0
    gel, mine = tmp_path / "materials" / "gel.yaml", tmp_path / "printers" / "mine.yaml"
    gel.write_text(gel.read_text("utf-8").replace("conductor: true", "conductor: false"), "utf-8")
    mine.write_text(mine.read_text("utf-8").replace("{etpu: 0, x60: 1}", "{eel: 0, gel: 1}"), "utf-8")
    assert run("characterise", "mine", "eel", "gel", "--name", "own").clean
    plate = tmp_path / "out" / "own"
    form = (plate / "form.yaml").read_text("utf-8")
    assert "e+0" not in form
    picture = (plate / "plate.svg").read_text("utf-8")
    assert 'fill="#404448"' in picture
    assert 'fill="#f2c14e"' in picture  # both templates have the same colour
    own = Study.of("mine", ["eel", "gel"], folder=tmp_path)
    coupons = named(own, re.findall(r"(?m)^  ([a-z][^:]*):$", form))
    near = dataclasses.replace(truth, bulk_ohm_m=0.1, through_ohm_m=0.2, conductor_pa=2e7, dielectric_pa=2e7)
    (plate / "form.yaml").write_text(virtual_lab.filled(form, coupons, near, METERS, np.random.default_rng(1)), "utf-8")
    for folder in ("materials", "printers"):
        (tmp_path / folder).rename(tmp_path / f"was-{folder}")
    monkeypatch.chdir(tmp_path.parent)
    said = run("characterise", "read", plate / "form.yaml", "--name", "lab-2").clean
    for wrong in ("doubtful", "left out", "not determined"):
        assert wrong not in said.words


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("    width_mm: ~", "    width_mm: -6", "is -6; expected a number above 0"),
        ("    width_mm: ~", "    width_mm: 0.006", "drawn 10 mm: check number and unit"),
        ("    resistance_ohm: ~", "    resistance_ohm: 3 pF", "not a resistance"),
        ("    capacitance_1_pf: ~", "    capacitance_1_pf: 4.1e-11", "check its unit"),
        ("    resistance_ohm: ~", "    resistance_ohm: yes", "is not a resistance"),
        ("  bar-90-1.6:", "  bar-91-1.6:", "unknown coupon 'bar-91-1.6'"),
        ("    resistance_ohm: ~", "    resistence_ohm: ~", "did you mean 'resistance_ohm'"),
        ("    vernier_x: ~", "    vernier_x: 7", "whole number from -5 to 5"),
        ("    film_1_short: ~", "    film_1_short: maybe", "expected true, false or ~"),
        ("printer: diabase-h5", "printer: diabase-h6", "unknown printer 'diabase-h6'"),
        ('{"etpu": 3, "x60": 4}', '{"etpu": 3, "x60": 9}', "has no tool 9"),
        ('{"etpu": 3, "x60": 4}', "three", "tools is 'three'; expected a mapping of names to values"),
        ("  calipers_mm: 0.01", "  calipers_mm: 3 pF", "meters.calipers_mm: '3 pF' is not a length"),
        ("  resistance_percent: 1", "  resistance_percent: -1", "resistance_percent is -1"),
        ("", "", "no reading in the form"),
    ],
)
def test_a_wrong_form_is_refused_in_one_line(planned, run, tmp_path, old, new, words):
    text = (planned.folder / "form.yaml").read_text("utf-8")
    assert old in text
    (tmp_path / "form.yaml").write_text(text.replace(old, new, 1), "utf-8")
    assert words in run("characterise", "read", "form.yaml").refusal
    assert not (tmp_path / "materials").exists()


def test_source_with_an_interval_is_as_uncertain_as_that(tmp_path):
    (tmp_path / "materials").mkdir()
    (tmp_path / "materials" / "lab-1.yaml").write_text(
        "about: a plate\nmaterials:\n  etpu:\n    resistivity_ohm_m: {value: 0.1, low: 0.09, high: 0.12}\n", "utf-8"
    )
    slots = {"top_electrode": "etpu@lab-1", "bottom_electrode": "etpu@thesis-c.1-bottom"}
    design = make({"shape": "tri", "materials": slots})
    found = {end: spread(design, value) for end, value in resistivities(design).items()}
    assert found["top"] == (0.09, 0.12)
    assert found["bottom"][1] > 0.8  # its source has no interval of its own
