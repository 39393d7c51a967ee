"""An array live: lots against the whole recording, files as invert reads them, the queue, the page in Chromium."""

import json
from pathlib import Path

import numpy as np
import pytest
from served_frames import HERTZ, Device, lines, walker

from in_process import run, run_all
from sensorgen.core.errors import BadInput
from sensorgen.design.design import load
from sensorgen.measure.array_frames import read, swapped
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock
from sensorgen.measure.lab.frame_live import FrameFeed, MapView, NamedPress, follow, recorder
from sensorgen.measure.lab.frame_stream import FrameForm, FrameStream
from sensorgen.measure.lab.port import SimulatedPort
from sensorgen.measure.virtual.array import FrameSender, simulated, walked
from sensorgen.prediction.array.frames import inverted
from sensorgen.prediction.array.live import LiveMaps
from sensorgen.prediction.array.model import array_model
from sensorgen.prediction.array.readout import ArrayReadout

OUT = Path(__file__).parents[2] / "out" / "live"  # CI keeps it
DESIGN = """shape: array
parameters: {length_mm: 60, width_mm: 50, between: air}
cell: {shape: tri, parameters: {dielectric_mm: 0.2}}
regions: {heel: [[0, 0], [30, 50]], toe: [[30, 0], [60, 50]]}
"""
REST = 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    found = tmp_path_factory.mktemp("array")
    (found / "a.yaml").write_text(DESIGN)
    return found


@pytest.fixture(scope="module")
def model(folder):
    return array_model(load(folder / "a.yaml"))


def recording(model, readout):
    load_kpa = np.concatenate([np.zeros((REST, 5, 6)), walked(model.layout, frames=20).pressure_kpa])
    return simulated(model, readout, load_kpa), np.arange(len(load_kpa)) / 100, np.arange(len(load_kpa)) < REST


@pytest.mark.parametrize("hertz", [1e3, 300e3])
def test_lots_give_what_the_whole_recording_gives(model, hertz):
    """By C/C0, and from the first frame on that needs it by the network, the cover undone: a frame has one answer."""
    readout = ArrayReadout(frequency_hz=(hertz,))
    siemens, time_s, rest = recording(model, readout)
    whole, live, parts = inverted(model, readout, siemens, rest, time_s), LiveMaps(model, readout), []
    lot_s = np.array_split(np.arange(len(time_s)), 8)
    parts.extend(filter(None, (live.take(siemens[part], time_s[part], rest[part]) for part in lot_s)))
    assert live.plan.network == whole.by.startswith("the network")
    assert live.plan.network == (hertz > 1e4)
    kpa = np.concatenate([maps.pressure_kpa for maps in parts])
    assert kpa == pytest.approx(whole.pressure_kpa, rel=1e-6, abs=1e-6)
    assert np.concatenate([maps.time_s for maps in parts]) == pytest.approx(whole.time_s)
    assert live.dropped == 0


def test_nothing_before_a_tare_and_another_tare(model):
    readout = ArrayReadout(frequency_hz=(300e3,))
    siemens, time_s, rest = recording(model, readout)
    live = LiveMaps(model, readout)
    assert live.take(siemens[REST:], time_s[REST:], rest[REST:]) is None
    assert live.dropped == 20
    live.take(siemens[:REST], time_s[:REST], rest[:REST])
    assert live.tared
    live.take(siemens[15:20], time_s[15:20], rest[15:20])
    live.take(1.5 * siemens[:2], time_s[:2], rest[:2])  # the zero has moved: C/C0 is by the new one
    again = live.take(1.5 * siemens[20:21], time_s[20:21], rest[20:21])
    first = inverted(model, readout, siemens, rest, time_s).pressure_kpa[10]
    assert np.nanmax(np.abs(again.pressure_kpa[0] - first)) < 0.1 * np.nanmax(first) + 10


@pytest.mark.parametrize("suffix", ["csv", "h5", "npz"])
def test_recordings_are_what_invert_reads(tmp_path, suffix):
    path, rng = tmp_path / f"f.{suffix}", np.random.default_rng(0)
    siemens = (rng.normal(size=(5, 2, 3)) + 1j * rng.normal(size=(5, 2, 3))) * 1e-6
    siemens[3, 1, 2] = complex(np.nan, np.nan)
    time_s, rest = np.arange(5) / 100, np.arange(5) < 2
    file = recorder(path, (2, 3), HERTZ)
    for part in (slice(0, 3), slice(3, 5)):
        file.add(siemens[part], time_s[part], rest[part])
    if suffix != "npz":
        assert path.stat().st_size > 100  # as they come
    file.close()
    back = read(path, (2, 3), None)
    assert back.siemens.imag == pytest.approx(siemens.imag, rel=1e-6, nan_ok=True)
    assert (back.siemens.real == pytest.approx(siemens.real, rel=1e-6, nan_ok=True)) == (suffix != "csv")
    assert back.time_s == pytest.approx(time_s)
    assert back.rest.tolist() == rest.tolist()
    assert back.frequency_hz == HERTZ
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(BadInput, match="exists; expected a new name"):
        recorder(path, (2, 3), HERTZ)
    with pytest.raises(BadInput, match=r"ends in \.csv, \.h5 or \.npz"):
        recorder(tmp_path / "f.mat", (2, 3), HERTZ)


def feed_of(device, clock, path=None):
    meter = FrameStream(SimulatedPort(device, clock), clock)
    meter.identify()
    return FrameFeed(meter, clock, recorder(path, meter.shape, meter.frequency_hz) if path else None)


def test_the_queue_is_bounded_the_file_has_all(tmp_path):
    clock = SimulatedClock()
    feed = feed_of(walker(100.0), clock, tmp_path / "f.csv")
    feed.unloaded_s = 0.2
    while clock.now() < 3.0:
        clock.wait_until(clock.now() + 0.1)
        feed.step()
    siemens, time_s, rest = feed.taken()
    assert len(siemens) == len(time_s) == len(rest) == 128
    assert feed.counts == {"frames": 300, "lost": 0, "damaged": 0, "saturated": 0, "dropped": 172, "recorded": 300}
    assert len(feed.taken()[1]) == 0
    feed.recorder.close()
    assert read(tmp_path / "f.csv", (2, 3), None).rest.sum() == 20


def test_a_cut_line_ends_it_with_what_came(model, tmp_path):
    clock = SimulatedClock()
    sender = walker(100.0)
    feed = feed_of(sender, clock, tmp_path / "f.csv")
    clock.wait_until(0.5)
    feed.step()
    sender.fault = "cut"
    feed.run()
    with pytest.raises(DeviceFault, match="cable out"):
        follow(feed, LiveMaps(model, ArrayReadout()), None, clock, 10.0)
    feed.recorder.close()
    assert len(read(tmp_path / "f.csv", (2, 3), None).siemens) == 50


def test_a_full_disk_is_a_fault(model):
    clock = SimulatedClock()
    feed = feed_of(walker(100.0), clock)
    clock.wait_until(0.5)

    class Full:
        def add(self, *_):
            raise OSError(28, "No space left on device")

    feed.recorder = Full()
    feed.run()
    with pytest.raises(DeviceFault, match="recording: No space left on device"):
        follow(feed, LiveMaps(model, ArrayReadout()), None, clock, 10.0)


def shown(model, view, clock):
    """Feed of a walked array, of which the page has some frames."""
    readout = ArrayReadout()
    siemens, _, _ = recording(model, readout)
    siemens[:, 1, 2] = 0  # a dead crossing
    feed = feed_of(FrameSender(siemens[0], siemens[REST:], readout, 100.0), clock)
    feed.unloaded_s, live = 0.5, LiveMaps(model, readout)
    while clock.now() < 3.6:
        clock.wait_until(clock.now() + 0.05)
        feed.step()
        follow(feed, live, view, clock, clock.now() + 1e-3)
    return feed, live


def test_the_page_shows_map_trace_force_and_regions(browser, model):
    clock = SimulatedClock()
    with MapView("a & b", model) as view:
        feed, live = shown(model, view, clock)
        browser.call("Page.navigate", url=view.url)
        browser.until("document.documentElement?.dataset.drawn === 'yes'")
        browser.until("document.getElementById('force').textContent.endsWith('N')")
        assert browser.run("document.title") == "a & b"
        assert browser.run("document.getElementById('message').textContent").startswith("C/C0")
        assert browser.run("document.getElementById('recorded').textContent") == "no file"
        state = json.loads(view.data(0))["state"]
        assert [row[0] for row in state["regions"]] == ["heel", "toe"]
        assert state["kpa"][1 * 6 + 2] is None
        rows = browser.run("[...document.querySelectorAll('#regions tr')].map(r => r.cells[1].textContent)")
        assert sum(map(float, rows)) == pytest.approx(float(browser.run("page.rows.at(-1)[1]")), rel=0.01)
        assert int(browser.run("document.getElementById('frames').textContent")) == feed.counts["frames"]
        for width in (360, 1280):
            browser.size(width, 900)
            browser.run("show()")
            assert browser.run("document.documentElement.scrollWidth") <= width
            browser.picture(OUT / f"map-{width}.png")
        browser.key(" ", 32)
        browser.until("(poll, true)")
        browser.run("document.getElementById('rest').click()")
        until = 200
        while not feed.unloaded_s and until:
            feed.obey(view.commands())
            browser.run("new Promise(done => setTimeout(done, 50))")
            until -= 1
        assert feed.paused
        assert feed.unloaded_s == 1.0
        feed.obey(["resume", "record", "stop"])
        assert (feed.paused, feed.recording, feed.over, live.dropped) == (False, False, True, 0)
        assert browser.complaints() == []


def test_frames_of_the_standard_input_are_inverted(folder, model, monkeypatch):
    siemens, time_s, rest = recording(model, ArrayReadout())
    file = recorder(folder / "in.csv", (5, 6), HERTZ)
    file.add(siemens, time_s, rest)
    file.close()
    code, _ = run(folder, "invert", "a.yaml", "in.csv", "-o", "whole.csv")
    assert code == 0
    with (folder / "in.csv").open() as given:
        monkeypatch.setattr("sys.stdin", given)
        code, text = run(folder, "invert", "a.yaml", "-")
    assert code == 0
    head, *rows = [line.split(",") for line in text.splitlines() if line[:1] in "t0123456789"][: len(time_s) - REST + 1]
    expected = [line.split(",") for line in (folder / "whole.csv").read_text().splitlines()]
    assert head == expected[0]
    assert np.array(rows, float) == pytest.approx(np.array(expected[1:], float))
    text = (folder / "in.csv").read_text().splitlines()
    (folder / "standing.csv").write_text("\n".join([text[0], *text[REST + 1 :]]) + "\n")
    with (folder / "standing.csv").open() as given:
        monkeypatch.setattr("sys.stdin", given)
        code, _, text = run_all(folder, "invert", "a.yaml", "-")
    assert code == 2
    assert "never taken for rest" in text


def test_the_command_records_a_virtual_array(folder):
    words = (
        "--simulate",
        "--rate",
        "20",
        "--unloaded",
        "1",
        "--seconds",
        "2",
        "--no-page",
        "--fault",
        "r2:3",
        "--press",
        "r2c3",
    )
    code, _, text = run_all(folder, "bench", "array", "a.yaml", *words, "--record", "v.npz")
    assert code == 0
    assert "array of 5 x 6, capacitance" in text
    assert "no press of 20 frames" in text
    found = read(folder / "v.npz", (5, 6), None)
    assert found.rest.sum() == 20
    assert np.abs(found.siemens.imag[0, 1, 3:]).max() < 1e-3 * np.abs(found.siemens.imag[0, 0, 0])  # the row is broken
    for wrong in ((), ("--port", "x", "--simulate"), ("--port", "x", "--kind", "hp-4284a")):
        assert run(folder, "bench", "array", "a.yaml", *wrong)[0] == 2
    code, _, text = run_all(folder, "bench", "array", "a.yaml", "--simulate", "--press", "r9c3")
    assert (code, "r9c3; expected r1c1 to r5c6" in text) == (2, True)


def test_frames_of_another_array_are_refused(folder):
    import serving

    from sensorgen.measure.lab.devices import RealClock

    form = FrameForm(2, 3)
    with serving.pseudo_terminal(Device([form.header(), *lines(3)] * 5000), RealClock()) as path:
        code, _, text = run_all(folder, "bench", "array", "a.yaml", "--port", path, "--no-page", "--seconds", "1")
    assert code == 2
    assert "frames of 2 x 3; expected 5 x 6, as of a" in text


@pytest.mark.parametrize(("order", "words"), [
    ([0, 1, 2, 3, 4, 5], "the press on r2c3 is read there"),
    ([0, 1, 4, 3, 2, 5], "presses on c3 are read at c5: wires swapped"),
])  # fmt: skip
def test_a_known_press_names_swapped_wires(model, order, words):
    """100 kPa on r2c3, then elsewhere for longer: wires of columns 3 and 5 are exchanged in the readings."""
    load_kpa = np.zeros((REST + 80, 5, 6))
    load_kpa[REST + 5 : REST + 30, 1, 2] = 100.0
    load_kpa[REST + 30 :, 4, 0] = 100.0
    readout, press = ArrayReadout(frequency_hz=(1e4,)), NamedPress((1, 2))
    siemens = simulated(model, readout, load_kpa)[:, :, order]
    rest = np.arange(len(load_kpa)) < REST
    live = LiveMaps(model, readout)
    live.take(siemens[rest], np.arange(REST) / 100, rest[rest])
    for lot in np.array_split(np.arange(REST, len(load_kpa)), 20):
        press.take(live.take(siemens[lot], lot / 100, rest[lot]))
        if lot[-1] < REST + 20:
            assert not press.words()
            assert press.shown()["words"].startswith("press r2c3: ")
    assert press.words().startswith(words)
    assert press.shown() == {"at": (1, 2), "words": press.words(), "swapped": "swapped" in words}


def test_a_swapped_row_and_a_swapped_column_are_both_named():
    pressed, largest = (np.repeat([[row], [column]], 20, axis=1) for row, column in ((2, 1), (4, 6)))
    assert swapped(pressed, largest).startswith("presses on r3 are read at r5, on c2 are read at c7: wires swapped")
