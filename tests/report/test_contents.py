"""A report of Table D.1 against the table itself, in every format; with bad words, with recordings, with nothing."""

import csv
import dataclasses
import io
import itertools
import json
import math
import re
import shutil
from functools import cache
from pathlib import Path
from statistics import median, stdev

import numpy as np
import pytest
from bench_files import FORMULA, HOSTILE, ladder, written
from html_page import HtmlPage
from scipy import stats

from no_numbers import roughly_at_rest
from sensorgen.analysis.comparison import measured, of_iteration
from sensorgen.analysis.plots.static import files
from sensorgen.analysis.report import FORMATS, electrodes, report, yields
from sensorgen.core import document
from sensorgen.core.document import shown as shown_as
from sensorgen.core.errors import BadInput
from sensorgen.design import materials
from sensorgen.measure.log import Log, bench, notes
from sensorgen.measure.signal import run

TABLE = Path(__file__).parents[2] / "src" / "sensorgen" / "measure" / "log" / "table_d1.csv"
FACTOR = {"": 1.0, "k": 1e3, "m": 1e6}


def ohms(cell):
    """Least reading of a cell, read by hand."""
    found = [re.fullmatch(r"([0-9.]+)([km]?)", part.strip(), re.IGNORECASE) for part in cell.split("/") if part.strip()]
    return min((float(m[1]) * FACTOR[m[2].lower()] for m in found), default=math.nan)


@pytest.fixture(scope="module")
def by_hand():
    rows = csv.DictReader(TABLE.read_text("utf-8").splitlines())
    return [(ohms(r["y"]), ohms(r["z"]), r["specimen"]) for r in rows if r["specimen"].startswith("23")]


@pytest.fixture(scope="module")
def of_thesis(thesis):
    with Log(thesis) as log, roughly_at_rest():
        return report(log, 23)


def has_gap(name):
    """Whether a specimen's electrodes have a gap as printed: with a film, or under the blunt tips of triangles."""
    return "mm" in name or name.startswith("23 tri")


def table(made, key):
    return next(t for t in made.tables if t.key == key)


def column(found, name):
    at = [c.name for c in found.columns].index(name)
    return [row[at] for row in found.cells]


def test_every_reading_is_there_once_with_its_numbers(of_thesis, by_hand):
    found = table(of_thesis, "readings")
    pairs = zip(column(found, "electrode resistance measured"), column(found, "film resistance measured"), strict=True)
    ours = sorted((y if y is not None else -1.0, z if z is not None else -1.0) for y, z in pairs)
    theirs = sorted((-1.0 if math.isnan(y) else y, -1.0 if math.isnan(z) else z) for y, z, _ in by_hand)
    assert ours == theirs


def test_how_many_have_a_z_of_the_order_of_their_y(of_thesis, by_hand):
    both = [(y, z) for y, z, _ in by_hand if not math.isnan(y + z)]
    shorted = sum(z <= 10 * y for y, z in both)
    said_so = next(text for text in of_thesis.findings if "sensors have a low film resistance (" in text)
    assert said_so.startswith(f"{shorted} of {len(both)} sensors")
    parted = [(y, z, name) for y, z, name in by_hand if not math.isnan(y + z) and has_gap(name)]
    assert f"{len(both) - len(parted)} by design" in said_so
    shares = [row for row in table(of_thesis, "yield").rows if row.by == "film"]
    assert sum(row.shorted for row in shares) == sum(z <= 10 * y for y, z, _ in parted)
    assert [row.total for row in shares] == [10, 16, 16]
    bare = [z <= 10 * y for y, z, name in parted if "mm" not in name]
    assert f"{sum(bare)} of {len(bare)} such sensors have a low film resistance" in " ".join(of_thesis.findings)


def test_what_is_shorted_as_printed_says_nothing_of_the_yield(of_thesis, by_hand):
    """What touches as printed cannot be intact: 0 of the others is an upper bound of 1 - 0.025^(1/42)."""
    parted = [(y, z) for y, z, name in by_hand if not math.isnan(y + z) and has_gap(name)]
    said_so = next(text for text in of_thesis.headline if "intact" in text)
    assert said_so.startswith(f"None of the {len(parted)} testable sensors is intact")
    assert f"yield 0 to {100 * (1 - 0.025 ** (1 / len(parted))):.2g} %" in said_so
    exact = stats.binomtest(sum(z <= 10 * y for y, z in parted), len(parted)).proportion_ci(0.95, "exact")
    assert any(f"{100 * exact.low:.2g} to {100 * exact.high:.2g} %" in text for text in of_thesis.findings)


def test_whether_groups_differ_is_asked_of_what_has_a_gap(of_thesis, by_hand):
    """Probability of all tables with these sums that are no more likely: Freeman and Halton's test, by hand."""
    groups_by = {"film": lambda name: ".1mm" in name or 2 * ("2mm" in name), "shape": lambda name: "tri" in name}
    for by, group in groups_by.items():
        rows = [(z <= 10 * y, group(name)) for y, z, name in by_hand if not math.isnan(y + z) and has_gap(name)]
        sizes = [sum(g == k for _, g in rows) for k in sorted({g for _, g in rows})]
        seen = [sum(s for s, g in rows if g == k) for k in sorted({g for _, g in rows})]
        tables = (t for t in itertools.product(*(range(n + 1) for n in sizes)) if sum(t) == sum(seen))
        ways = {t: math.prod(map(math.comb, sizes, t)) for t in tables}
        chance = sum(n for n in ways.values() if n <= ways[tuple(seen)]) / sum(ways.values())
        said_so = next(text for text in of_thesis.findings if f" by {by}:" in text)
        assert f"p = {chance:.2g}" in said_so
        assert "no significant difference" in said_so


def test_what_leaks_at_dc_is_judged_by_frequency_too(of_thesis, by_hand):
    """By hand with some 61 pF of triangles, 203 pF of squares with 0.1 mm: beyond 26 and 8 kohm at 99.7 kHz."""
    said_so = next(text for text in of_thesis.findings if "films that leak at DC" in text)
    leaking, capacitors = 0, 0
    for y, z, name in by_hand:
        if not math.isnan(y + z) and has_gap(name) and z > 2 * y:
            leaking += 1
            capacitors += z > 1 / (2 * math.pi * 99.7e3 * (61e-12 if "tri" in name else 203e-12))
    assert f"{capacitors} of {leaking} films that leak" in said_so
    assert capacitors == 5


def test_triangles_along_the_length_have_less_resistance(of_thesis, by_hand):
    """Ten prints without a film: each triX above each triY, which chance does in 2 of 252 orders."""
    x, y = ([ry for ry, _, name in by_hand if re.fullmatch(f"23 tri{axis}( [0-9r])?", name)] for axis in "XY")
    assert (len(x), len(y), min(x) > max(y)) == (5, 5, True)
    row = next(r for r in table(of_thesis, "direction").rows if (r.shape, r.film) == ("tri", "0 mm"))
    assert row.ratio == pytest.approx(median(y) / median(x))
    assert round(row.ratio, 2) == 0.67
    assert row.p == pytest.approx(2 / math.comb(10, 5))
    assert 0.7 < row.predicted < 0.9  # cogs that carry current: 0.71 of a full electrode where they fuse whole
    assert any(text.startswith("Direction: tri Y has 0.67 times") for text in of_thesis.findings)


@pytest.mark.parametrize(("first", "second"), [(5, 7), (9, 30)])
def test_a_rank_sum_test_is_exact_with_ties_up_to_20_000_orders_and_1_where_all_are_alike(first, second):
    """All orders of the ranks, by hand; beyond, the normal approximation with ties and continuity."""
    one, other = np.arange(first) // 2, 1 + np.arange(second) // 2
    ranks, k = stats.rankdata([*one, *other]), first + second
    if math.comb(k, first) <= 20_000:
        sums = [sum(pick) for pick in itertools.combinations(ranks, first)]
        expected = 2 * sum(s <= ranks[:first].sum() for s in sums) / len(sums)
    else:
        sigma = math.sqrt(first * second / (k - 1) * ranks.var())
        expected = 2 * stats.norm.cdf((ranks[:first].sum() - first * (k + 1) / 2 + 0.5) / sigma)
    assert yields.rank_p(one, other) == pytest.approx(expected, rel=1e-9)
    assert yields.rank_p([1.0] * first, [1.0] * second) == 1.0


@pytest.mark.parametrize(("shorted", "said"), [(6, "; no significant difference"), (5, "; a significant difference")])
def test_of_two_questions_each_has_to_be_twice_as_sure(shorted, said, tmp_path):
    """6 and 5 of 10 against 12 of 12: p = 0.029 and 0.010, of which the first would do if only one thing were asked."""
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        first = [notes.reading(f"40 triX .1mm {k + 1}", "700", "30" if k < shorted else "OL") for k in range(10)]
        log.add(first + [notes.reading(f"40 triX .2mm {k + 1}", "700", "30") for k in range(12)])
        found = of_iteration(log, 40)
    chance = stats.fisher_exact([[shorted, 10 - shorted], [12, 0]]).pvalue
    assert chance < 0.05
    text = next(text for text in yields.findings(found) if " by film:" in text)
    assert said in text
    assert f"p = {chance:.2g}" in text
    assert yields.table(found).columns[0].head == "grouped by"


def test_r_z_is_not_compared_where_the_electrodes_touch_as_printed(of_thesis, by_hand):
    """One leak for all: ln of the meter's highest range and of the readings, without those of 0 ohm and of no gap."""
    known = [z for y, z, name in by_hand if has_gap(name) and z > 0 and 1 < y < 5e4]
    rows = table(of_thesis, "explained").rows
    row = next(r for r in rows if (r.kind, r.parameter) == ("film resistance", "film leakage"))
    mean = sum(map(math.log, known)) / len(known)
    left = sum((math.log(z) - mean) ** 2 for z in known) / sum((math.log(z) - math.log(1e8)) ** 2 for z in known)
    assert row.share_percent == pytest.approx(100 * (1 - left), abs=0.2)


def test_a_specimen_counts_once_and_with_its_last_reading(tmp_path):
    with Log(tmp_path / "log.db", create=True) as log:
        log.add([notes.reading("40 triX .1mm", "0.7k", z) for z in ("10", "12", "OL")])
        log.add([notes.reading("40 triX .1mm 2", "0.7k", "20")])
        made = report(log, 40)
    assert any(text.startswith("1 of the 2 testable sensors is intact") for text in made.headline)
    assert any(text.startswith("1 of 2 sensors have a low film resistance") for text in made.findings)
    assert "2 earlier readings are not counted" in " ".join(w for s in made.sections for w in s.notes)
    assert len(table(made, "readings").rows) == 4
    assert [(row.by, row.specimens) for row in table(made, "yield").rows] == [("all", 2)]


def test_more_readings_than_are_drawn_and_listed(tmp_path, monkeypatch, shared_cache):
    """Of so many only what a browser can bear is drawn and listed, and it says so; the files for programs hold all."""
    monkeypatch.setattr(document, "MOST_ROWS", 50)
    monkeypatch.setattr(electrodes, "MOST_ROWS", 40)
    with Log(tmp_path / "log.db", create=True) as log, roughly_at_rest():
        names = [f"40 {shape} .1mm {k + 1}" for k in range(60) for shape in ("triX", "triY")]
        log.add([notes.reading(n, f"{700 + k}", "30" if k % 3 else "OL") for k, n in enumerate(names)])
        made = report(log, 40)
    charts = {chart.key: chart for chart in made.figures}
    assert [len(charts[key].choices[""][0].y.names) for key in ("residuals", "resistance")] == [40] * 2
    assert "Not drawn: 80 readings" in charts["residuals"].alt
    drawn = [float(x) for t in charts["residuals"].choices[""][0].content if t.kind == "points" for x in t.x]
    every = column(table(made, "readings"), "measured / predicted")
    assert (min(drawn), max(drawn)) == pytest.approx((min(every), max(every)))
    assert "80 of 120 " in " ".join(made.findings)
    assert "40 of the 120 " in " ".join(made.headline)
    page = HtmlPage(written(made, "html"))
    assert len(page.cells["readings"]) == 50 + 1
    assert "the first 50 of 120 rows" in "".join(page.text)
    assert written(made, "csv").count("\nreadings,") == 120 * 16


def test_ratios_are_measured_over_the_predicted_value(of_thesis):
    found = table(of_thesis, "readings")
    predictions = ("predicted from", "predicted", "predicted to")
    names = ("electrode resistance measured", *predictions, "measured / predicted")
    for y, low, middle, high, ratio in zip(*(column(found, name) for name in names), strict=True):
        if y is not None:
            assert low < middle < high
            assert ratio == pytest.approx(y / middle)
    sizes = [abs(math.log(r)) for r in column(found, "measured / predicted") if r is not None]
    assert sizes == sorted(sizes, reverse=True)
    assert "made after the measurement" in " ".join(of_thesis.findings)
    ratios = [row.ratio for row in found.rows if 1 < row.measured_ohm < 5e4]
    assert 1 / 1.05 < median(ratios) < 1.05
    assert of_thesis.headline[0].startswith("Electrode resistance: measured as predicted (median of 51 readings; 49 ")


COGS = {"triX": 0.865, "triY": 0.716, "sqXY": 0.722, "sqYX": 0.679}  # printed top electrode over the plain bottom one


@cache
def rungs_of(share):
    """R_Y and R_Z of ladders of every strength, with the top and with the bottom electrode read."""
    return [(ladder(share, g, 30, 1 / share), ladder(1.0, g, 30, share)) for g in np.geomspace(1e-5, 1e5, 40)]


def by_ladder(ry, rz, share):
    """Resistivity [ohm m] that a plain bottom electrode and a top one of ``share`` have, of 100 x 10 x 0.3 mm.

    Of the geometric mean of both electrodes as the one that was read.
    """
    rungs = rungs_of(share)
    read, across = (np.array([math.sqrt(top[k] * bottom[k]) for top, bottom in rungs]) for k in (0, 1))
    order = np.argsort(across / read)
    return ry / np.interp(math.log(max(rz, 1e-9) / ry), np.log(across / read)[order], read[order]) * 3e-5


def test_resistivity_of_the_prints_by_a_ladder_of_resistors(by_hand):
    """The default of PI-eTPU, its range, and that groups agree: by Kirchhoff's law, without the closed form."""
    groups = {}
    for y, z, name in by_hand:
        kind = name.replace("sa", "sq").replace("\u00a5", "Y").replace("triV", "triY").split()[1].partition(".")[0]
        if not math.isnan(y):
            groups.setdefault(kind, []).append((y, by_ladder(y, 1e9 if math.isnan(z) else z, COGS[kind])))
    usual = {s: median(y for kind, of in groups.items() if kind.startswith(s) for y, _ in of) for s in ("tri", "sq")}
    sound = {
        kind: [rho for y, rho in of if 0.1 < y / usual[kind[:-1] if "tri" in kind else "sq"] <= 3]
        for kind, of in groups.items()
    }  # fmt: skip
    groups = {kind: [rho for _, rho in of] for kind, of in groups.items()}
    every = [rho for values in sound.values() for rho in values]
    etpu = materials.load("etpu").value("resistivity_ohm_m")
    assert len(every) == 48  # of 53: three broken electrodes, a lost k, and one of four times the median
    assert median(every) == pytest.approx(etpu.value, rel=0.03)
    reach = stats.t.ppf(0.975, len(every)) * stdev(map(math.log, every))
    assert (etpu.low, etpu.high) == pytest.approx((etpu.value / math.exp(reach), etpu.value * math.exp(reach)), rel=0.1)
    assert sum(etpu.low <= rho <= etpu.high for values in groups.values() for rho in values) >= 45
    for kind, values in groups.items():
        others = [rho for other, of in sound.items() if other != kind for rho in of]
        assert 0.7 < median(values) / median(others) < 1.4


def test_resistivity_explains_what_it_must(of_thesis):
    """With one factor on a logarithm, the best one is the mean residual, and takes away the mean's square."""
    found, explained = table(of_thesis, "readings"), table(of_thesis, "explained")
    residuals = [math.log(row.ratio) for row in found.rows if 1 < row.measured_ohm < 5e4]
    mean = sum(residuals) / len(residuals)
    row = next(r for r in explained.rows if (r.kind, r.parameter) == ("electrode resistance", "electrode resistivity"))
    assert row.value == pytest.approx(math.exp(mean), rel=1e-5)
    assert row.slope == pytest.approx(1.0, rel=1e-6)
    assert row.share_percent == pytest.approx(100 * len(residuals) * mean**2 / sum(r * r for r in residuals), rel=1e-6)
    idle = {r.parameter: r.share_percent for r in explained.rows if r.kind == "electrode resistance"}
    assert idle["film permittivity"] == idle["all moduli"] == idle["film thickness"] == 0


def test_what_explains_recordings_is_what_is_wrong(of_recorded):
    """C is 1.3 times the prediction, the modulus half of it: nothing else moves X at rest, and presses, so much."""
    rows = table(of_recorded, "explained").rows
    rest = [r for r in rows if r.kind == "impedance at rest"]
    assert {rest[0].parameter, rest[1].parameter} == {"film permittivity", "film thickness"}
    assert rest[0].share_percent > 95
    loaded = next(r for r in rows if (r.kind, r.parameter) == ("impedance under load", "all moduli"))
    assert loaded.value == pytest.approx(0.5, rel=0.03)
    assert loaded.share_percent > 95


def test_tones_beside_their_prediction(of_recorded):
    found = table(of_recorded, "impedance")
    assert len(found.rows) == 2 * 7
    c = [v for v, f in zip(column(found, "Cs measured"), column(found, "frequency"), strict=True) if f < 3e3]
    assert c == pytest.approx([1.3 * column(found, "C predicted")[0]] * len(c), rel=3e-3)
    x, expected, residual = (np.array(column(found, n)) for n in ("X measured", "X predicted", "residual of X"))
    assert residual == pytest.approx((x - expected) / abs(expected), rel=2e-2)


def test_figures_as_files(of_recorded):
    chart = next(chart for chart in of_recorded.figures if chart.key == "reactance-1-1")
    chart = dataclasses.replace(chart, choices=dict(list(chart.choices.items())[:1]))
    found = dict(files(chart))
    assert sorted(content[:4] for content in found.values()) == [b"<?xm", b"\x89PNG"]
    assert dict(files(chart)) == found  # the same bytes again
    assert all(re.fullmatch(r"[A-Za-z0-9.-]+", name) for name in found)


@pytest.fixture(scope="module")
def page(of_recorded):
    return HtmlPage(written(of_recorded, "html"))


def cell_of(page, found, k, j):
    """A cell of a table on the page, without columns that are empty throughout; a table of one row stands as a list."""
    heads, *rows = page.cells[found.key]
    pairs = zip(heads, rows[k], strict=True) if len(found.rows) > 1 else page.cells[found.key]
    return {head[1]: cell for head, cell in pairs}.get(found.columns[j].head, ("", ""))


def test_all_formats_have_the_same_numbers(of_recorded, page):
    rows = list(csv.reader(io.StringIO(written(of_recorded, "csv"))))
    data = {t["key"]: t for s in json.loads(written(of_recorded, "json"))["sections"] for t in s["tables"]}
    lines = written(of_recorded, "md").splitlines()
    for found in of_recorded.tables:
        ours = [r for r in rows[1:] if r[0] == found.key]
        assert len(ours) == len(found.rows) * len(found.columns)
        for k, row in enumerate(found.cells):
            for j, value in enumerate(row):
                cell = ours[k * len(found.columns) + j][4]
                plain = data[found.key]["rows"][k][j]
                exact, shown = cell_of(page, found, k, j)
                if isinstance(value, str):
                    assert cell.removeprefix("'") == plain == shown == value
                elif value is None:
                    assert (cell, plain, exact) == ("", None, "")
                else:
                    assert float(cell) == float(plain) == float(exact) == value
                    assert shown == shown_as(value)
    assert sum(line.startswith("| ") for line in lines) >= sum(len(t.rows) for t in of_recorded.tables if t.rows[1:])
    assert any(row[4] == f"'{FORMULA}" for row in rows)
    assert any(row[4] == HOSTILE for row in rows)


def test_words_of_strangers_stay_text(of_recorded, page):
    assert HOSTILE in "".join(page.text)
    assert [a for t, a in page.tags if t == "img" and a.get("src") == "x"] == []
    assert sum(tag == "script" for tag, _ in page.tags) == 3
    assert not any(name.startswith("on") for _, attrs in page.tags for name in attrs)
    markdown = written(of_recorded, "md")
    assert "<script>" not in markdown.replace("\\<", "")
    assert all(line.count("|") - line.count("\\|") in (0, line.count("|")) or line.startswith("|")
               for line in markdown.splitlines())  # fmt: skip


def test_a_page_that_everybody_can_read(page):
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in itertools.pairwise(levels))
    assert all(attrs.get("scope") in ("col", "row") for tag, attrs in page.tags if tag == "th")
    assert sum(tag == "caption" for tag, _ in page.tags) == sum(tag == "table" for tag, _ in page.tags)
    assert all(attrs.get("alt") for tag, attrs in page.tags if tag == "img")
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    for _, attrs in page.tags:
        for target in (attrs.get("aria-labelledby") or "").split():
            assert target in ids
        if (attrs.get("href") or "").startswith("#"):
            assert attrs["href"][1:] in ids
    assert all("src" not in attrs or attrs["src"].startswith("data:") for _, attrs in page.tags)


def test_an_iteration_without_readings_is_refused(thesis):
    message = r"no readings of iteration 99; iterations in it: 19, 20, 21, 22, 23, 25\."
    with Log(thesis) as log, pytest.raises(BadInput, match=message):
        report(log, 99)


def test_one_reading_makes_a_short_report(tmp_path):
    """No table of a group of one, no yield of one, and no explanation of a single number."""
    with Log(tmp_path / "log.db", create=True) as log:
        log.add([notes.reading("40 triX .1mm", "700", "OL")])
        made = report(log, 40)
    assert made.headline[0].startswith("Electrode resistance of 40 triX .1mm: measured 700 ohm, predicted ")
    assert made.headline[1].startswith("Verdict of 40 triX .1mm: intact (film intact from ")
    assert [t.key for t in made.tables] == ["readings", "verdicts", "identifiability", "provenance"]
    assert written(made, "md").count("\n| ") < 20


def test_readings_without_a_design_make_a_report(tmp_path):
    with Log(tmp_path / "log.db", create=True) as log:
        log.add([notes.reading("50 tri", "650", "OL"), notes.reading("50 sq", "", "")])
        made = report(log, 50)
    assert any("stands for no design" in why for _, why in table(made, "left_out").cells)
    for how in FORMATS:
        assert written(made, how)


def test_recordings_that_are_gone_are_told(recorded, tmp_path):
    left_out = []
    with Log(shutil.copy(recorded, tmp_path / "log.db")) as log:
        assert not list(measured.runs(log, 30, left_out))
    assert len(left_out) == 2
    assert all("recording" in what and "No such file or directory" in why for what, why in left_out)


def test_a_bad_recording_is_told_and_the_others_are_reported(recorded, tmp_path, monkeypatch, shared_cache):
    """Parts of a recording with a pause, one of them too short; and faults that nobody foresaw."""
    shutil.copy(recorded, tmp_path / "log.db")
    shutil.copytree(f"{recorded}.files", tmp_path / "log.db.files")
    time = np.arange(600) / 100
    rows = [f"{t},{100 + k % 7},{-50 - k % 5}" for k, t in enumerate([*time, *(time + 7 * 86400), 9e6, 9e6 + 0.01])]
    (tmp_path / "pause.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + "\n".join(rows) + "\n")
    with Log(tmp_path / "log.db") as log:
        bench.log_recording(log, "30 triX .1mm", tmp_path / "pause.csv")
        left_out = []
        runs = list(measured.runs(log, 30, left_out))
        names = [run.name for run in runs]
        assert names[-2:] == ["30 triX .1mm, recording 3, part 1", "30 triX .1mm, recording 3, part 2"]
        assert "after a pause of 604794 s" in "; ".join(runs[-1].notes)
        (said,) = (why for what, why in left_out if "recording 3, 30 triX .1mm, part 3" in what)
        assert "2 valid samples" in said or "2 readings" in said
        real, faults = run.processed, {1: MemoryError(), 2: ZeroDivisionError("by 0"), 3: KeyError("x")}

        def failing(one, *rest):
            if one.source.part:
                raise faults[one.source.part]
            return real(one, *rest)

        monkeypatch.setattr(run, "processed", failing)
        left_out = []
        assert len(list(measured.runs(log, 30, left_out))) == 2
    assert [why for _, why in left_out] == [
        "not enough memory", "ZeroDivisionError: by 0; a fault of sensorgen, please report it",
        "KeyError: 'x'; a fault of sensorgen, please report it",
    ]  # fmt: skip
