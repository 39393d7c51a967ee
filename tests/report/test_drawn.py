"""What figures are made of: thinned curves, packed numbers, choices; recordings in blocks; the command."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from sensorgen.analysis.comparison import runs
from sensorgen.analysis.report.charts import Axis, Chart, Trace
from sensorgen.analysis.report.identified import _lines
from sensorgen.analysis.report.interactive import figure, packed
from sensorgen.analysis.report.pictures import files
from sensorgen.analysis.report.recordings import normalised_differences
from sensorgen.analysis.report.thinned import kept
from sensorgen.cli import cli
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import log_recording


def test_thinned_curves_keep_what_stands_out():
    rng = np.random.default_rng(1)
    values = rng.normal(size=100_003)
    values[[5, 777, 99_999]] = 50.0, -50.0, 40.0
    values[5000:5200] = np.nan
    at = kept(values, 2000)
    assert len(at) <= 2002
    assert (np.diff(at) > 0).all()
    assert {5, 777, 99_999} <= set(at.tolist())
    width = -(-len(values) // 1000)
    for start in (0, 40 * width, 999 * width):
        part = values[start : start + width]
        here = values[at[(at >= start) & (at < start + width)]]
        if np.isfinite(part).any():
            assert (here.min(), here.max()) == (np.nanmin(part), np.nanmax(part))


def test_few_points_stay_all():
    assert kept(np.arange(10.0), 10).tolist() == list(range(10))
    assert len(kept(np.full(5000, np.nan), 100)) <= 101


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
    ],
)
def test_packed_numbers(values, kind):
    data = packed(values)
    assert data["dtype"] == kind
    assert unpacked(data) == pytest.approx(values, rel=1e-6)
    assert np.ptp(unpacked(data)) == pytest.approx(np.ptp(values), rel=1e-6)


def test_names_in_figures_are_text():
    bad = "<a href='http://example.org'>$\\frac{</a>"
    chart = Chart(
        "k", bad, bad, {"": (Trace("points", bad, [1.0], [bad], text=[bad]),)}, Axis(bad), (Axis(bad, names=(bad,)),)
    )
    assert "<a" not in json.dumps(figure(chart))
    svg = dict(files(chart))["k.svg"].decode()
    assert "<a href" not in svg
    assert "\\frac{" in svg


def test_logarithmic_axes_have_plain_numbers():
    """Formulas are not drawn, names being text; a decade's tick would otherwise stand there as its TeX."""
    for high in (5.0, 500.0, 5e6):
        drawn = (Trace("points", "", [1.0, high], [1.0, high]),)
        chart = Chart("k", "t", "a", {"": drawn}, Axis("x", log=True), (Axis("y", log=True),))
        svg = dict(files(chart))["k.svg"].decode()
        assert "math" not in svg
        assert sum(f">{number}</text>" in svg for number in ("1", "2", "5", "10", "100", "1000")) >= 2


def test_what_is_no_number_is_a_gap():
    chart = Chart("k", "t", "a", {"": (Trace("line", "", [1.0, 2.0], [np.nan, np.inf]),)}, Axis("x"), (Axis("y"),))
    assert figure(chart)["choices"][0]["data"][0]["y"] == [None, None]


def test_differences_of_all_recordings_on_scales_of_their_own(recorded):
    with Log(recorded) as log:
        every = list(runs.runs(log, 30, []))
    (chart,) = normalised_differences(every)
    assert len(chart.choices) == 7
    for k, traces in enumerate(chart.choices.values()):
        assert [t.row for t in traces] == [0, 0, 1, 1]
        for trace, run in zip(traces, every * 2, strict=True):
            moved = run.pairs.pressed_ohm[:, k] - run.pairs.before_ohm[:, k]
            part = moved.imag if trace.row else moved.real
            assert trace.x == pytest.approx(run.pairs.force_n)
            assert trace.y == pytest.approx((part - part.min()) / (part.max() - part.min()))
    shifted = replace(every[1], recording=replace(every[1].recording, tones_hz=every[1].recording.tones_hz * 1.01))
    (chart,) = normalised_differences([every[0], shifted])
    assert len(chart.choices["1.1kHz"]) == 2
    assert "1 recordings of other tones are left out" in chart.alt
    assert not list(normalised_differences([]))


def test_what_impedance_could_tell_is_the_cards_map():
    card = {
        "required": {"sigma_force_n": 0.6, "sigma_position_m": 0.01},
        "map": {
            "force_n": [0.0, 1.0, 2.0, 3.0, 4.0], "position_m": [0.0, 0.05],
            "sigma_force_n": [[k, 10.0 + k] for k in range(5)],
            "sigma_position_m": [[None, k / 1e3] for k in range(5)],
        },
    }  # fmt: skip
    weak, middling, strong, needed, *below = _lines(card)
    assert [list(t.y) for t in (weak, middling, strong, needed)] == [[1, 11], [2, 12], [4, 14], [0.6, 0.6]]
    assert [t.name for t in (weak, middling, strong)] == ["press of 1 N", "press of 2 N", "press of 4 N"]
    assert np.isnan([t.y[0] for t in below[:3]]).all()
    assert [t.y[1] for t in below] == pytest.approx([1.0, 2.0, 4.0, 10.0])
    assert list(weak.x) == [0.0, 50.0]
    assert {t.row for t in below} == {1}


def test_presses_of_a_run(recorded):
    with Log(recorded) as log:
        found = next(runs.runs(log, 30, []))
    assert len(found.pairs.time_s) == 7
    assert not any("no log of the rig" in note for note in found.notes)


def run(*words):
    return cli.main(["report", *words], standalone_mode=False)


def test_the_command(thesis, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    log = ["--log", str(thesis)]
    run("--iteration", "99", "--open", *log)
    assert opened == [(tmp_path / "report-99.html").as_uri()]
    run("--iteration", "99", "--format", "json", "-o", "-", *log)
    assert '"iteration": 99' in capsys.readouterr().out
    run("--iteration", "19", "--format", "csv", "--figures", "figures", *log)
    assert (tmp_path / "report-19.csv").read_text("utf-8").startswith("table,row,column,unit,value\n")
    assert (tmp_path / "figures" / "residuals.svg").exists()
    with pytest.raises(BadInput, match="--open shows an HTML file"):
        run("--iteration", "23", "--open", "--format", "md", *log)
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
        (found,) = runs.runs(log, 31, left_out)
    assert left_out == []
    assert found.rest_ohm[0].real == pytest.approx(1001, abs=0.1)
    assert any("no log of the rig" in note for note in found.notes)
