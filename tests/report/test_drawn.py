"""What figures are made of: thinned curves, packed numbers, choices; recordings in blocks; the command."""

import base64
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sensorgen.analysis.comparison import measured
from sensorgen.analysis.plots.figure import Axis, Curve, Figure, Panel, thinned
from sensorgen.analysis.plots.interactive import data, packed
from sensorgen.analysis.plots.static import files, whole
from sensorgen.analysis.report import errors, identifiability
from sensorgen.analysis.report.recordings import compared
from sensorgen.cli import cli
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import log_recording


def test_thinned_curves_keep_what_stands_out():
    rng = np.random.default_rng(1)
    values = rng.normal(size=100_003)
    values[[5, 777, 99_999]] = 50.0, -50.0, 40.0
    values[5000:5200] = np.nan
    at = thinned(values, 2000)
    assert len(at) <= 2003
    assert (np.diff(at) > 0).all()
    assert {5, 777, 99_999} <= set(at.tolist())
    width = -(-len(values) // 1000)
    for start in (0, 40 * width, 999 * width):
        part = values[start : start + width]
        here = values[at[(at >= start) & (at < start + width)]]
        if np.isfinite(part).any():
            assert (here.min(), here.max()) == (np.nanmin(part), np.nanmax(part))


def test_few_points_stay_all():
    assert thinned(np.arange(10.0), 10).tolist() == list(range(10))
    assert len(thinned(np.full(5000, np.nan), 100)) <= 101


def unpacked(data):
    values = np.frombuffer(base64.b64decode(data["bdata"]), np.dtype(data["dtype"]).newbyteorder("<"))
    return values.reshape([int(n) for n in data["shape"].split(",")]) if "shape" in data else values


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.linspace(0, 1, 7), "f4"),
        (1e6 + np.linspace(0, 1, 7), "f8"),
        (np.arange(12).reshape(3, 4) ** 2.0, "f4"),
        (np.array([1, 2, 70_000]), "i4"),
        (np.array([1, -2, 3]), "i4"),
        (np.array([0, 2, 60_000]), "u2"),
    ],
)
def test_packed_numbers(values, kind):
    data = packed(values)
    assert data["dtype"] == kind
    assert unpacked(data) == pytest.approx(values, rel=1e-6)
    assert np.ptp(unpacked(data)) == pytest.approx(np.ptp(values), rel=1e-6)


def test_names_in_figures_are_text():
    bad = "<a href='http://example.org'>$\\frac{</a>"
    panel = Panel((Curve("points", bad, [1.0], [bad], text=[bad]),), Axis(bad), Axis(bad, names=(bad,)), title=bad)
    chart = Figure("k", bad, bad, {"": (panel, panel)})
    assert "<a" not in json.dumps(data(chart))
    svg = dict(files(chart))["k.svg"].decode()
    assert "<a href" not in svg
    assert "\\frac{" in svg


def test_logarithmic_axes_have_plain_numbers():
    """Formulas are not drawn, names being text; a decade's tick would otherwise stand there as its TeX."""
    for high in (5.0, 500.0, 5e6):
        panel = Panel((Curve("points", "", [1.0, high], [1.0, high]),), Axis("x", log=True), Axis("y", log=True))
        chart = Figure("k", "t", "a", {"": (panel,)})
        canvas = whole(chart)
        canvas.draw_without_rendering()
        ticks = [tick.get_text() for tick in canvas.axes[0].get_xticklabels()]
        assert not any("math" in tick for tick in ticks)
        assert len({"1", "2", "5", "10", "100", "1000"} & set(ticks)) >= 2


def test_what_is_no_number_is_a_gap():
    panel = Panel((Curve("line", "", [1.0, 2.0], [np.nan, np.inf]),), Axis("x"), Axis("y"))
    assert data(Figure("k", "t", "a", {"": (panel,)}))["choices"][0]["data"][0]["y"] == [None, None]


def test_differences_of_all_recordings_on_scales_of_their_own(recorded):
    with Log(recorded) as log:
        every = list(measured.runs(log, 30, []))
    (chart,) = compared(every)
    assert len(chart.choices) == 7
    for k, panels in enumerate(chart.choices.values()):
        traces = [(row, curve) for row, panel in enumerate(panels) for curve in panel.content]
        assert [row for row, _ in traces] == [0, 0, 1, 1]
        for (row, trace), run in zip(traces, every * 2, strict=True):
            moved = run.pairs.pressed_ohm[:, k] - run.pairs.before_ohm[:, k]
            part = moved.imag if row else moved.real
            assert trace.x == pytest.approx(run.pairs.force_n)
            assert trace.y == pytest.approx((part - part.min()) / (part.max() - part.min()))
    shifted = replace(every[1], tones_hz=every[1].tones_hz * 1.01)
    (chart,) = compared([every[0], shifted])
    assert [len(panel.content) for panel in chart.choices["1.1 kHz"]] == [1, 1]
    assert "Left out: 1 recordings of other frequencies" in chart.alt
    assert not list(compared([]))


def test_what_impedance_could_tell_is_the_cards_map():
    force, position = [[k, 10.0 + k] for k in range(5)], [[None, k / 1e3] for k in range(5)]
    known = {"sigma_force_n": force, "sigma_position_m": position, "position_m": [0.0, 0.05]}
    needs = SimpleNamespace(sigma_force_n=0.6, sigma_position_m=0.01)
    of = SimpleNamespace(force_n=[0.0, 1.0, 2.0, 3.0, 4.0], **known)
    above, under = errors(SimpleNamespace(required=needs, map=of))
    (weak, middling, strong, needed), below = above.content, under.content
    assert [list(t.y) for t in (weak, middling, strong, needed)] == [[1, 11], [2, 12], [4, 14], [0.6, 0.6]]
    assert [t.name for t in (weak, middling, strong)] == ["1 N", "2 N", "4 N"]
    assert np.isnan([t.y[0] for t in below[:3]]).all()
    assert [t.y[1] for t in below] == pytest.approx([1.0, 2.0, 4.0, 10.0])
    assert list(weak.x) == [0.0, 50.0]


def run(*words):
    return cli.main(["report", *words], standalone_mode=False)


def test_the_command(thesis, tmp_path, capsys, monkeypatch, shared_cache, unpainted):
    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    log = ["--log", str(thesis)]
    run("--iteration", "19", "--open", *log)
    assert opened == [(tmp_path / "report-19.html").as_uri()]
    headline, *_, file = capsys.readouterr().out.splitlines()
    assert headline.startswith("Electrode resistance of 19 sqXY: measured 900 ohm")
    assert file == "report-19.html"
    run("--iteration", "19", "--format", "json", "-o", "-", *log)
    assert json.loads(capsys.readouterr().out)["iteration"] == 19
    run("--iteration", "19", "--format", "csv", "--figures", "figures", *log)
    assert (tmp_path / "report-19.csv").read_text("utf-8").startswith("table,row,column,unit,value\n")
    assert (tmp_path / "figures" / "resistance.svg").exists()
    with pytest.raises(BadInput, match="--open shows an HTML file"):
        run("--iteration", "23", "--open", "--format", "md", *log)
    with pytest.raises(BadInput, match="no readings of iteration 99"):
        run("--iteration", "99", *log)
    assert not (tmp_path / "report-99.html").exists()
    with pytest.raises(BadInput):
        run("--iteration", "23", "--log", str(tmp_path / "none.db"))


def test_a_table_with_columns_of_its_own_is_not_left_out(tmp_path):
    """Read again by the names that were told when it was logged."""
    rows = "".join(f"{k / 10},{1000 + k % 3},{-5e5 - k % 5}\n" for k in range(60))
    (tmp_path / "own.csv").write_text("t,r,x\n" + rows, "utf-8")
    columns = {"t": "time_s", "r": "re_ohm_1.1kHz", "x": "im_ohm_1.1kHz"}
    left_out = []
    with Log(tmp_path / "log.db", create=True) as log:
        log_recording(log, "31 triX .1mm", tmp_path / "own.csv", None, columns=columns)
        (found,) = measured.runs(log, 31, left_out)
    assert left_out == []
    assert found.rest_ohm[0].real == pytest.approx(1001, abs=0.1)
    assert any("no log of the rig" in note for note in found.notes)


def test_errors_of_position_stand_in_millimetres_and_unknown_ones_are_empty():

    def card(force_n, position_m, correlation, **more):
        return SimpleNamespace(sigma_force_n=force_n, sigma_position_m=position_m, correlation=correlation, **more)

    known = card(0.25, 4e-3, -0.5, verdict="senses force", calibrated=card(0.5, 8e-3, None))
    lost = card(0.25, None, None, verdict="no position", calibrated=None)
    cards = {"a": known, "b": lost, "c": None}
    of = {name: SimpleNamespace(identifiability=card, reason="a short") for name, card in cards.items()}
    predictions = {name: SimpleNamespace(prediction=one) for name, one in of.items()}
    (table,) = identifiability(SimpleNamespace(predictions=predictions))
    assert table.columns[2].unit == "mm"
    assert list(table.cells) == [
        ("a", 0.25, 4.0, -0.5, 0.5, 8.0, "senses force"),
        ("b", 0.25, None, None, None, None, "no position"),
        ("c", None, None, None, None, None, "a short"),
    ]
