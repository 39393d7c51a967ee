"""Results in Python: a few lines, tables, figures, lists of designs, and names that are refused at once."""

import re
import sys

import numpy as np
import pytest

import sensorgen as sg
from no_numbers import roughly_at_rest
from sensorgen.core.display import LINES
from sensorgen.core.errors import BadInput, MissingValue, SensorgenError
from sensorgen.measure.log.notes import reading
from sensorgen.prediction.query import TONES_HZ

PLATE = sg.Design(shape="reference")
TRI = sg.Design(shape="tri", parameters={"length_mm": 6.0, "width_mm": 6.0})


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    with roughly_at_rest():
        checked = sg.check(TRI)
    with sg.Log(folder / "log.db", create=True) as log:
        log.add([reading(f"30 SX60 {k}", f"1.{k}k", "OL") for k in range(2, 6)])
        measured = {
            "compare": sg.compare(log, 30),
            "fit": sg.fit(log, iteration=30),
            "report": sg.report(log, 30, path=folder / "report.html"),
        }
    z = sg.predict(PLATE, force_n=[0.0, 3.0, 6.0], position_mm=30).impedance.impedance_ohm[..., 0].T
    return measured | {
        "build": sg.build(PLATE, folder, cad=False),
        "invert": sg.invert(PLATE, TONES_HZ, z[1:], rest_ohm=z[:1]),
        "perfect": sg.invert(PLATE, TONES_HZ, z[1:], perfect=True),
        "check": checked,
        "predict": sg.predict(PLATE),
        "loaded": sg.predict(PLATE, force_n=[1.0, 2.0, 3.0], position_mm=[30.0, 50.0]),
        "compress": sg.compress(PLATE, [10.0, 20.0]),
        "cell": sg.cell(PLATE),
        "sweep": sg.sweep(PLATE, electrode_mm=[0.3, 0.4], dielectric_mm=[0.4, 0.6]),
        "list": sg.cell([PLATE, TRI]),
    }


ALL = (
    "check", "predict", "loaded", "compress", "cell", "sweep", "list", "compare", "fit", "report", "build", "invert",
    "perfect",
)  # fmt: skip


@pytest.mark.parametrize("name", ALL)
def test_a_result_is_shown_in_a_few_lines(results, name):
    lines = repr(results[name]).splitlines()
    assert 1 < len(lines) <= LINES
    assert lines[:3] == results[name].text().splitlines()[:3]
    assert "<table " in results[name]._repr_html_()


@pytest.mark.parametrize("name", ALL)
def test_a_result_has_a_figure(results, name):
    axes = results[name].plot().axes
    drawn = [line for one in axes for line in one.lines if np.size(line.get_xdata())]
    assert drawn, name
    assert any(one.get_xlabel() for one in axes)


def test_lines_of_a_figure_are_the_impedances(results):
    loaded = results["loaded"]
    first = loaded.plot().axes[0]  # R at the lowest frequency, a line and points for each position
    z = loaded.impedance.impedance_ohm[0].real
    assert first.lines[0].get_xdata() == pytest.approx([1.0, 2.0, 3.0])
    ratio = first.lines[0].get_ydata() / z[:, 0]
    assert ratio == pytest.approx(np.full(3, ratio[0]))
    assert ratio[0] in (pytest.approx(1.0), pytest.approx(1e-3))  # ohm or kohm


def test_a_sweep_has_all_combinations(results):
    sweep = results["sweep"]
    assert sweep.settings() == [{"electrode_mm": e, "dielectric_mm": d} for e in (0.3, 0.4) for d in (0.4, 0.6)]
    pf = [point.prediction.drawn.capacitance.value * 1e12 for point in sweep.results]
    plate = [8.8541878128 * 4.68 * 1000e-6 / (d * 1e-3) for d in (0.4, 0.6)]  # eps0 eps A / d [pF]
    assert pf == pytest.approx([*plate, *plate], rel=1e-6)
    with pytest.raises(BadInput, match="without values"):
        sg.sweep(PLATE)


def test_tables_for_pandas(results):
    pd = pytest.importorskip("pandas")
    table = results["sweep"].to_pandas()
    assert isinstance(table, pd.DataFrame)
    assert list(table.columns[:3]) == ["electrode_mm", "dielectric_mm", "capacitance [pF]"]
    assert len(table) == 4
    assert len(results["check"].to_pandas()) == len(results["check"].findings)
    loaded = results["loaded"]
    rest = loaded.prediction.to_pandas().set_index("quantity")
    assert rest.loc["capacitance", "drawn"] == pytest.approx(8.8541878128e-12 * 4.68 * 1e-3 / 0.6e-3, rel=1e-4)
    assert rest.loc["capacitance", "printed_lower"] < rest.loc["capacitance", "printed"]
    assert rest.loc["top electrode", "unit"] == "ohm"
    built = results["build"].to_pandas().set_index("quantity")
    assert built.loc["capacitance", "drawn"] == rest.loc["capacitance", "drawn"]
    pressed, z = loaded.to_pandas(), loaded.impedance
    assert len(pressed) == len(z.force_n) * len(z.position_mm)
    assert pressed["im_ohm_1.1kHz"].iloc[-1] == pytest.approx(z.impedance_ohm[0, -1, -1].imag)


def test_libraries_that_are_missing_are_named(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(MissingValue, match="pip install pandas"):
        results["cell"].to_pandas()
    with pytest.raises(MissingValue, match="pip install xarray"):
        results["loaded"].to_xarray()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"shape": "tri", "dielectric_mm": 0.2}, "dielectric_mm is a parameter; expected parameters: {dielectric_mm:"),
        ({"shape": "tri", "qualty": "fine"}, "unknown key 'qualty'; did you mean 'quality'"),
        ({"shape": "tri", "quality": 3}, "quality is 3; expected text"),
    ],
)
def test_wrong_names_are_refused_when_a_design_is_made(wrong, message):
    with pytest.raises(SensorgenError, match=re.escape(message)):
        sg.Design(**wrong)


@pytest.mark.parametrize(
    "wrong", [{"tools": {"x60": 77}}, {"materials": {"dielectric": "etpu"}}, {"materials": {"dielectric": "x60@nix"}}]
)
def test_a_design_with_a_name_of_its_own_is_looked_at_as_any(wrong):
    for named in ({}, {"name": "mine"}):
        with pytest.raises(SensorgenError, match=r"no tool 77|etpu conducts|unknown source"):
            sg.check(sg.Design(shape="tri", **wrong, **named))


def test_a_design_shows_what_differs_from_the_defaults():
    design = sg.Design(shape="tri", parameters={"period_mm": 3}, quality="extrafine")
    assert repr(design) == "Design(shape='tri', parameters={'period_mm': 3.0}, quality='extrafine')"


def test_the_figure_of_a_prediction_has_every_cause_of_its_ranges(results):
    causes = [label.get_text() for label in results["predict"].plot().axes[0].get_yticklabels()]
    assert {"top electrode: leads", "top electrode: material", "capacitance: print"} <= set(causes)


def test_lists_of_designs():
    assert [found.verdict for found in sg.check([PLATE, PLATE])] == ["PRINT", "PRINT"]
    films = [sg.Design(shape="reference", parameters={"dielectric_mm": d}) for d in (0.4, 0.6)]
    at_rest = [each.impedance.impedance_ohm[0, 0, 0] for each in sg.predict(films, force_n=[0.0, 1.0], position_mm=50)]
    assert at_rest[1].imag / at_rest[0].imag == pytest.approx(1.5, rel=1e-3)  # a plate's C goes as 1 over its film


@pytest.mark.parametrize(
    "asked",
    [
        lambda: sg.check("tri"), lambda: sg.predict("tri"), lambda: sg.predict([]), lambda: sg.cell([]),
        lambda: sg.sweep(PLATE, dielectric_mm=[]), lambda: sg.sweep(PLATE, dielectric_mm=0.2),
        lambda: sg.as_printed(PLATE, walls="foo"),
        lambda: sg.compress(PLATE, []), lambda: sg.compress(PLATE, [-1.0]), lambda: sg.predict(PLATE, force_n=[-5.0]),
        lambda: sg.predict(PLATE, force_n=[2.0, 1.0]), lambda: sg.predict(PLATE, noise=-1.0),
        lambda: sg.predict(PLATE, frequency_hz=0.0), lambda: sg.cell(PLATE, frequency_hz=-1.0),
        lambda: sg.invert(sg.Design(shape="array"), [1e4], [[1.0]], noise=1e-3),
        lambda: sg.invert(PLATE, [1e4], [[1.0]]), lambda: sg.invert(PLATE, [1e4], [[1.0]], rest_ohm=[1.1]),
        lambda: sg.invert(PLATE, TONES_HZ, [TONES_HZ], rest_ohm=TONES_HZ, noise="much"),
        lambda: sg.predict(PLATE, accuracy=0.0), lambda: sg.predict(PLATE, accuracy=-1.0),
        lambda: sg.predict(PLATE, accuracy=np.nan), lambda: sg.predict(PLATE, accuracy="fine"),
        lambda: sg.compress(PLATE, 10.0, accuracy=np.nan), lambda: sg.predict(PLATE, tip="5mm"),
        lambda: sg.predict(PLATE, force_n="6 N"), lambda: sg.cell(PLATE, frequency_hz=[1e3, 1e4]),
        lambda: sg.cell(PLATE, frequency_hz=0.0), lambda: sg.sweep(PLATE, dielectric_mm=[0.2], jobs=0),
        lambda: sg.sweep(PLATE, dielectric_mm=[0.2], jobs=2.5),
        lambda: sg.sweep(PLATE, dielectric_mm=[0.2], query=3), lambda: sg.check({"a": PLATE}),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(asked):
    with pytest.raises(SensorgenError, match=r"expected|unknown walls 'foo'"):
        asked()


def test_designs_of_any_kind_of_list():
    several = [PLATE, sg.Design(shape="reference", parameters={"dielectric_mm": 0.4})]
    wanted = sg.cell(several).to_json()
    for kind in (np.array(several, dtype=object), iter(several), tuple(several)):
        assert sg.cell(kind).to_json() == wanted


def test_a_reading_without_an_end_leaves_the_others_as_they_are():
    forces = [0.0, 4.0, 6.0]
    z = sg.predict(PLATE, force_n=forces, position_mm=50).impedance.impedance_ohm[..., 0].T
    alone = sg.invert(PLATE, TONES_HZ, z[1:], rest_ohm=z[:1])
    beside = sg.invert(PLATE, TONES_HZ, [*z[1:], np.full(7, np.inf)], rest_ohm=z[:1])
    assert beside.statuses() == [*alone.statuses(), "missing"]


def test_a_softer_specimen_is_within_the_intervals_of_its_design():
    tones = [1.1e3, 1e5]
    z = sg.predict(PLATE, frequency_hz=tones, force_n=[0.0, 12.0], position_mm=50).impedance.impedance_ohm[..., 0]
    pressed, rest = z[:, 1:].T, z[:, :1].T  # of a specimen that gives a third more: by 9 N
    (low, high), *_ = sg.invert(PLATE, tones, pressed, rest_ohm=rest, noise=1e-5).force_90_n
    assert low < 9.0 < high
    (low, high), *_ = sg.invert(PLATE, tones, pressed, noise=1e-5, perfect=True).force_90_n
    assert 9.0 < low < 12.0 < high


def test_readings_that_are_none_are_refused_and_what_they_do_not_tell_is_blank():
    tones = [1.1e3, 1e5]
    z = sg.predict(PLATE, frequency_hz=tones, force_n=[0.0, 12.0], position_mm=50).impedance.impedance_ohm[..., 0].T
    for given in ({"noise": 0.0}, {"noise": 5.0}, {"rest_ohm": z[0, :1]}, {"rest_ohm": z[:1], "perfect": True}):
        with pytest.raises(BadInput, match="expected"):
            sg.invert(PLATE, tones, z[1:], **{"rest_ohm": z[:1]} | given if "perfect" not in given else given)
    with pytest.raises(BadInput, match="a column for each frequency"):
        sg.invert(PLATE, tones, z[1:, :1], rest_ohm=z[:1])
    blank = sg.invert(PLATE, tones, z[1:], perfect=True)
    assert (blank.statuses(), np.isnan(blank.position_m).all()) == (["not identifiable"], True)


def test_a_design_is_pressed_by_its_own_tip():
    wide = sg.Design(shape="reference", tip={"shape": "flat", "width_mm": 30.0})
    assert "tip 30 mm" in sg.predict(wide, force_n=6.0, position_mm=50.0).text()


def test_a_resolution_is_called_that_of_a_perfect_model_where_no_other_is_known(tmp_path):
    round_tip = sg.Design(shape="reference", parameters={"length_mm": 30.0}, tip={"shape": "hertz", "width_mm": 10.0})
    for shape, known in ((round_tip, "of a perfect model"), (PLATE, "after 30 known presses")):
        assert f"(resolution {known}, at 6 N" in sg.predict(shape).text()
        assert f"(resolution {known}, at 6 N" in sg.build(shape, tmp_path, cad=False).text()


def test_reports_of_nothing_are_refused(tmp_path):
    with sg.Log(tmp_path / "log.db", create=True) as log:
        log.add([reading("30 SX60 2", "1.2k", "OL")])
        for asked in (
            lambda: sg.report(log, 30, path=tmp_path / "r.pdf"),
            lambda: sg.compare(log, 99),
            lambda: sg.calibrate(log),
            lambda: sg.fit(log, "30 SX60 2", iteration=30),
        ):
            with pytest.raises(SensorgenError, match=r"unknown format|expected"):
                asked()
        named = sg.report(log, None, "30 SX60 2", "30 sx60 2", path=tmp_path / "r.csv")
    assert (named.specimens, [path.name for path in tmp_path.glob("r.*")]) == (("30 SX60 2",), ["r.csv"])


def test_coupons_on_other_tools_and_few_of_them(tmp_path):
    tools = {"etpu": 1, "x60": 2}
    planned = sg.characterise("diabase-h5", "etpu", "x60", tmp_path, tools=tools, count=3, name="few")
    assert (planned.name, len(planned.coupons)) == ("few", 3)
    assert 'tools: {"etpu": 1, "x60": 2}' in (planned.folder / "form.yaml").read_text("utf-8")


def test_files_are_written(tmp_path):
    (body,) = sg.export_design(PLATE, tmp_path / "plate.3mf")
    assert body.read_bytes()[:2] == b"PK"
    page = sg.show(PLATE, tmp_path / "plate.html")
    assert page.read_text("utf-8").startswith("<!doctype html>")
