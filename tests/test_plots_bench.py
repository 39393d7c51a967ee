"""Pictures of a run: what they are drawn from, that they are drawn, and the same bytes every time."""

import base64
import gzip
import re

import made
import numpy as np
import pytest

from sensorgen.analysis.plots import recordings as bench
from sensorgen.analysis.plots import static
from sensorgen.measure.recording import Recording, RecordingClock, Source
from sensorgen.measure.recording.samples import blank
from sensorgen.measure.signal import lowpass, presses
from sensorgen.measure.signal.presses import RunPlan


@pytest.fixture(scope="module")
def run():
    tones = made.TONES_HZ[::3]
    truth = made.run(made.presses(12), rate_hz=35, tones_hz=tones)
    every = np.ones(len(truth.time_s), bool)
    recording = Recording(
        truth.time_s, tones, truth.impedance_ohm, blank(len(every)), RecordingClock(), Source("", "", rate_hz=35)
    )
    pairs = presses.pairs(truth.time_s, truth.impedance_ohm, every, presses.by_force(truth.time_s, truth.force_n),
                          truth.force_n, truth.position_mm)  # fmt: skip
    return bench.DrawnRecording(
        "<b>23 $triX$</b>", tones, truth.time_s, truth.impedance_ohm, *lowpass.filtered(recording), pairs
    )


def test_pictures_are_drawn_and_the_same_every_time(run):
    for figure in (bench.series(run), bench.differences(run, "reactance")):
        first = static.png(figure)
        assert first.startswith(b"\x89PNG")
        assert len(first) > 20_000
    assert static.png(bench.differences(run, "reactance")) == first
    sets = {"$a$ $\\frac$": run.pairs, "b": run.pairs}
    assert static.png(bench.compared(sets, run.tones_hz)).startswith(b"\x89PNG")
    plan = RunPlan(1, 20, (0.0, 6.0), (5.0, 95.0), 4.0, 6.0)
    schedule = bench.schedule(plan.steps(), plan.seconds())
    assert static.png(schedule).startswith(b"\x89PNG")
    axes = static.drawn(schedule, schedule.choices[""]).axes  # the scale of colours is between the two
    assert [one.get_ylabel() for one in axes] == ["force [N]", "force [N]", "number of the load"]


def test_the_page_has_every_tone(run):
    text = bench.html(run)
    packed = [base64.b64decode(block) for block in re.findall(r'id="(?:plotly|content)">(.*?)</script>', text)]
    content, script = (gzip.decompress(block).decode() for block in packed)
    assert script.count("plotly.js v") == 1
    assert "<b>23" not in text
    assert "&lt;b&gt;23 $triX$" in text
    for name in ("1.1 kHz", "99.7 kHz"):
        assert text.count(f"<option>{name}</option>") == 3
    assert content.count('"type":"heatmap"') >= 6


def test_many_recordings_on_a_page_share_its_points(run):
    """Thirty take little more room than ten, and each stretch of a curve keeps its least and its largest value."""

    def drawn(together):
        figures = bench.series(run, "", together), bench.differences(run, "reactance", "", together)
        raw, surface = (next(iter(figure.choices.values()))[0].content[0] for figure in figures)
        return raw, np.size(surface.values)

    (one, whole), (ten, _), (thirty, least) = map(drawn, (1, 10, 30))
    assert len(thirty.y) <= len(ten.y) <= 202 < len(one.y)
    assert (min(thirty.y), max(thirty.y)) == (min(one.y), max(one.y))
    assert least < whole / 5
