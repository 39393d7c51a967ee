"""Frames to pressure maps: truth by another formulation of the network, coverage, missing readings, files."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from array_network import by_currents

from sensorgen.analysis.plots import array as plots
from sensorgen.analysis.plots import static
from sensorgen.core import document
from sensorgen.core.errors import BadInput
from sensorgen.measure.array_frames import of_frames, read
from sensorgen.measure.virtual.array import foot, nodal, printed, simulated, walked
from sensorgen.prediction.array import frames as frames_module
from sensorgen.prediction.array.frames import PressureMaps, inverted
from sensorgen.prediction.array.readout import ArrayReadout, broken_where_dead, faulty
from sensorgen.prediction.array.study import study
from sensorgen.solvers.tracks import readings

from .conftest import array_of

PRESSURE = np.random.default_rng(1).uniform(0, 300, (2, 5, 6)) * 1e3  # Pa


def frames_of(model, readout, ohm=1.0, pressures_pa=PRESSURE, faults=None):
    """Three frames at rest and one for each map of what cells carry; they differ at rest by 10 %; without noise.

    Of sound tracks by the currents of crossings, of those with faults by the matrix of all nodes.
    """
    rest = model.capacitances(1 + 0.1 * np.random.default_rng(2).normal(size=(5, 6)))
    frames = [rest * ratio for ratio in [np.ones((5, 6))] * 3 + [model.under(p)[0] for p in pressures_pa]]
    if faults is not None:
        network = faulty(model.tracks(), faults, model.here)
        return np.array([nodal(network, farad, readout) for farad in frames])
    tracks, given = model.tracks(ohm=ohm), (readout.frequency_hz[0], readout.input_ohm, readout.kind == "two-terminal")
    return np.array([by_currents(replace(tracks, capacitance_f=farad), *given) for farad in frames])


def maps(model, readout, frames, **more):
    rest = np.arange(len(frames)) < 3
    return inverted(
        model, readout, frames, rest, np.arange(len(frames)) / 100, **{"scatter": 0.0, "surface": False} | more
    )


@pytest.mark.parametrize(
    ("kind", "hertz", "by", "kpa"),
    [
        ("guarded", 1e3, "C/C0", 0.02),
        ("guarded", 300e3, "the network", 0.2),
        ("two-terminal", 10e3, "the network", 0.2),
    ],
)
def test_pressures_come_back(model, kind, hertz, by, kpa):
    readout = ArrayReadout(kind, 50.0, (hertz,), 1e-4)
    frames = frames_of(model, readout)
    found = maps(model, readout, frames)
    assert found.by.startswith(by)
    assert np.abs(found.pressure_kpa - PRESSURE / 1e3).max() < kpa
    own = frames.imag[3:] / frames[0].imag
    alone = np.abs(model.pressures(own)[0] - PRESSURE).max() / 1e3
    assert (alone > 10 * kpa) == (by != "C/C0")  # and so C/C0 does not do everywhere


def test_force_centre_and_area_are_those_of_the_map(model):
    readout = ArrayReadout(frequency_hz=(1e3,), noise=1e-4)
    pressure = np.zeros((1, 5, 6))
    pressure[0, 1, 2], pressure[0, 3, 2] = 100e3, 300e3
    found = maps(model, readout, frames_of(model, readout, pressures_pa=pressure))
    x, y = model.layout.x_mm, model.layout.y_mm
    assert found.force_n[0] == pytest.approx([40.0], rel=1e-3)
    assert found.centre_mm[0] == pytest.approx([x[2]], abs=0.05)
    assert found.centre_mm[1] == pytest.approx([(y[1] + 3 * y[3]) / 4], abs=0.05)
    assert found.area_mm2 == pytest.approx([200.0])
    row = found.table().cells[0]
    assert row[1] == pytest.approx(40.0, rel=1e-3)
    assert row[6] == pytest.approx(300.0, rel=1e-3)


def test_a_crossing_that_flickers_is_named_and_not_determined(model):
    """A row's multiplexer shows another crossing in every tenth frame; steps without it are as they are."""
    readout = ArrayReadout(frequency_hz=(1e3,), noise=1e-4)
    of_steps = np.tile(PRESSURE[:1], (100, 1, 1)) * np.sin(np.linspace(0, 6, 100))[:, None, None] ** 2
    frames = frames_of(model, readout, pressures_pa=of_steps)
    sound = maps(model, readout, frames)
    assert "flicker" not in sound.by
    frames[3::10, 2, 1] = 1.5 * frames[0, 2, 1]
    found = maps(model, readout, frames)
    assert found.by.endswith("left out, as they flicker: r3c2")
    lost = np.isnan(found.pressure_kpa).all(0)
    assert np.argwhere(lost).tolist() == [[2, 1]]
    assert np.array_equal(found.pressure_kpa[:, ~lost], sound.pressure_kpa[:, ~lost])


def test_capacitances_alone_do(model):
    readout = ArrayReadout(frequency_hz=(10e3,), noise=1e-4)
    frames = frames_of(model, readout)
    frames.real = np.nan
    assert np.abs(maps(model, readout, frames).pressure_kpa - PRESSURE / 1e3).max() < 0.1


def test_capacitances_alone_are_refused_where_two_give_one_reading(model):
    """Of R and C in series the imaginary part of 1 / (R + 1 / jwC) is largest at wRC = 1, a phase of 45 degrees."""
    readout = ArrayReadout(frequency_hz=(3e6,), noise=1e-4)
    frames = frames_of(model, readout)
    assert np.isfinite(maps(model, readout, frames).pressure_kpa).any()
    frames.real = np.nan
    with pytest.raises(BadInput, match=r"capacitances alone at 3 MHz: .* two give one reading"):
        maps(model, readout, frames)


@pytest.mark.parametrize("kind", ["guarded", "two-terminal"])
def test_intervals_hold_and_the_foot_is_found(model, kind):
    """Scatter of 5 % at rest and in gain, noise of 0.1 %: 95 % of the pressures in their intervals."""
    readout, pressure = ArrayReadout(kind), np.concatenate([np.zeros((3, 5, 6)), PRESSURE / 1e3])
    inside, off = [], []
    for seed in range(4):
        found = maps(model, readout, simulated(model, readout, pressure, seed=seed), scatter=0.05, surface=True)
        low, high = found.interval_kpa
        inside.append((low < PRESSURE / 1e3) & (high > PRESSURE / 1e3))
        off.append((found.force_n[0] - pressure[3:].sum((1, 2)) * 0.1) / found.force_n[1])
    assert 0.9 < np.mean(inside) < 0.985
    assert 0.5 < np.std(off) < 1.6
    whole = foot(model.layout)
    assert whole.max() == pytest.approx(357)
    assert 40 < whole.mean() < 120


def test_what_is_not_read_is_not_no_pressure(model):
    readout = ArrayReadout()
    frames = frames_of(model, readout)
    frames[4, 2, 3] = np.nan  # one reading of one frame
    frames[:3, 0, 1] = np.nan  # never read at rest
    found = maps(model, readout, frames)
    dark = np.isnan(found.pressure_kpa)
    assert [tuple(k) for k in np.argwhere(dark).tolist()] == [(0, 0, 1), (1, 0, 1), (1, 2, 3)]
    force, sigma = found.force_n  # lost ones by those around, of which a random load says little: so the error states
    assert (np.abs(force - (PRESSURE / 1e3).sum((1, 2)) * 0.1) < 3 * sigma).all()
    assert found.table().cells[1][7] == 2
    pressure = np.concatenate([np.zeros((3, 5, 6)), PRESSURE / 1e3])
    broken = maps(model, readout, simulated(model, readout, pressure, faults=["r2:3"]))
    assert np.isnan(broken.pressure_kpa[:, 1, 3:]).all()
    assert np.isnan(broken.pressure_kpa).sum() == 2 * 3
    assert static.png(plots.figure(broken, PRESSURE))[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("faults", "turned"),
    [(["r2:4"], False), (["c3:0", "r2:3"], False), (["r4:0", "c2:1"], False), (["r5:2", "r3:1"], True)],
)
def test_a_track_is_broken_where_its_crossings_are_dead_to_the_end(model, faults, turned):
    """And nothing else is, though the crossings of two dead tracks end all those across them."""
    tracks = model.tracks()
    if turned:  # leads at the other end
        tracks = replace(tracks, row_end=0 * tracks.row_end, column_end=0 * tracks.column_end)
    true = faulty(tracks, faults, model.here)
    dead = np.abs(readings(true, 1e3).siemens) < np.abs(readings(tracks, 1e3).siemens) / 3
    dead[0, 0] = True  # by itself
    known = broken_where_dead(tracks, model.here, dead)
    for name in ("row_ohm", "column_ohm", "row_lead_ohm", "column_lead_ohm"):
        assert np.array_equal(getattr(known, name), getattr(true, name)), name


@pytest.mark.parametrize(
    ("faults", "lost"), [(["c5:0", "c6:0"], None), (["c5:1", "c6:1", "r3c2"], None), (["r2:3"], 3)]
)
def test_what_faults_leave_is_right(model, faults, lost):
    """To 1 kPa at a noise by which the network inverts; faults are named, and crossings of no fault are determined."""
    readout = ArrayReadout(frequency_hz=(1e4,), noise=1e-4)
    left = maps(model, readout, frames_of(model, readout, faults=faults))
    assert set(left.faults) == set(faults)
    assert np.nanmax(np.abs(left.pressure_kpa - PRESSURE / 1e3)) < 1
    if lost:
        assert np.isnan(left.pressure_kpa[0]).sum() == lost


def test_two_terminals_keep_what_a_broken_track_leaves(model):
    readout = ArrayReadout("two-terminal", 50.0, (1e4,), 1e-3)
    assert np.isfinite(maps(model, readout, frames_of(model, readout, faults=["r2:3"])).pressure_kpa).any()


def test_beside_a_short_the_loose_part_of_a_broken_row_mixes_crossings_that_are_not_determined(model):
    """Row 2 is broken behind column 3, row 4 shorted in column 5; all that a map has is right to 1 kPa."""
    readout = ArrayReadout(frequency_hz=(1e3,), noise=1e-5)
    mixed = maps(model, readout, frames_of(model, readout, faults=["r2:3", "r4c5"]))
    lost = np.zeros((5, 6), bool)
    lost[1, 3:] = lost[3, 3:] = True
    assert (np.isnan(mixed.pressure_kpa) == lost).all()
    assert np.nanmax(np.abs(mixed.pressure_kpa - PRESSURE / 1e3)) < 1
    assert mixed.faults == ("r4c5", "r2:3")
    assert "faults at rest" in "".join(document.text(mixed.document()))


def test_force_and_centre_count_lost_crossings_by_those_around(model):
    """A load straight along both axes: a lost corner, edge and two inner crossings come back; the map stays dark."""
    x, y = np.meshgrid(model.layout.x_mm, model.layout.y_mm)
    load = (200.0 + 3.0 * (x - x.min()) - 2.0 * (y - y.min()))[None]
    kpa = load.copy()
    for i, j in ((0, 0), (4, 3), (2, 2), (2, 3)):
        kpa[0, i, j] = np.nan
    found = PressureMaps(model, "by hand", np.zeros(1), kpa, np.where(np.isnan(kpa), np.nan, 1.0))
    assert found.force_n[0] == pytest.approx(load.sum() * 0.1, abs=float(found.force_n[1][0]))
    assert found.force_n[1] < 2e-3 * load.sum() * 0.1  # 26 determined ones of 0.1 N are 0.7e-3
    true = [(load[0] * at).sum() / load.sum() for at in (x, y)]
    assert [float(at[0]) for at in found.centre_mm[:2]] == pytest.approx(true, abs=0.01)
    assert np.isnan(found.pressure_kpa).sum() == found.table().cells[0][7] == 4


def correlation(model, length_mm):
    """Matern's, of order 5/2, between all crossings: Rasmussen and Williams (2006), eq. 4.17."""
    at = np.stack(np.meshgrid(model.layout.x_mm, model.layout.y_mm), -1).reshape(-1, 2)
    r = np.sqrt(5) * np.linalg.norm(at[:, None] - at, axis=2) / length_mm
    return (1 + r + r**2 / 3) * np.exp(-r)


LOST = [0, 8, 9, 21]  # r1c1, r2c3, r2c4, r4c4


def fields(model, sizes_kpa, length_mm, count, noise_kpa):
    """Draws of a Gaussian field of some sizes, (sizes count, 30), and maps of them with noise and lost crossings."""
    draw = np.random.default_rng(7)
    root = np.linalg.cholesky(correlation(model, length_mm) + 1e-9 * np.eye(30))
    true = np.repeat(sizes_kpa, count)[:, None] * (draw.normal(size=(len(sizes_kpa) * count, 30)) @ root.T)
    kpa = true + noise_kpa * draw.normal(size=true.shape)
    kpa[:, LOST] = np.nan
    sigma = np.where(np.isnan(kpa), np.nan, noise_kpa)
    shape = (len(kpa), 5, 6)
    return true, PressureMaps(model, "by hand", np.arange(len(kpa)) / 100, kpa.reshape(shape), sigma.reshape(shape))


def test_sessions_by_two_terminals_are_calibrated_as_such(model, tmp_path):
    """They were taken as guarded: C/C0 of a press on some squares alone was that of all around it."""
    readout, true = ArrayReadout("two-terminal", noise=1e-4), model.under(PRESSURE[0])[0]
    frames = frames_of(model, readout, pressures_pa=PRESSURE[:1])
    np.savez(
        tmp_path / "s.npz", siemens=frames, rest=[1, 1, 1, 0], time_s=np.arange(4.0), frequency_hz=10e3,
        pressure_kpa=np.stack([np.zeros((5, 6))] * 3 + [PRESSURE[0] / 1e3]),
    )  # fmt: skip
    by_two, guarded = (
        of_frames([tmp_path / "s.npz"], model, readout=kind)[0].reading[3].reshape(5, 6) + 1
        for kind in ("two-terminal", "guarded")
    )
    assert by_two == pytest.approx(true, abs=5e-4)
    assert np.nanmax(np.abs(guarded - true)) > 0.1
    with pytest.raises(BadInput, match="a calibration of guarded frames; expected no two-terminal ones"):
        maps(model, readout, frames, calibration=SimpleNamespace(readout="guarded"))


def test_lost_crossings_are_the_conditional_mean_of_a_gaussian_field(model, monkeypatch):
    """Mean k' (K + n)^-1 y and covariance k - k' (K + n)^-1 k', by matrices over all 30 crossings."""
    monkeypatch.setattr("sensorgen.prediction.array.frames._LENGTHS", (1.7,))
    monkeypatch.setattr("sensorgen.prediction.array.frames._RATIOS", np.array([3.0**2 / 50.0**2]))
    frames_module._field.cache_clear()
    _, maps_ = fields(model, [50.0], 17.0, 4, 3.0)
    known = np.setdiff1d(np.arange(30), LOST)
    k = 50.0**2 * correlation(model, 17.0)
    gain = k[np.ix_(LOST, known)] @ np.linalg.inv(k[np.ix_(known, known)] + 9.0 * np.eye(26))
    left = k[np.ix_(LOST, LOST)] - gain @ k[np.ix_(known, LOST)]
    kpa, sigma = (of.reshape(4, 30) for of in maps_.filled)
    frames_module._field.cache_clear()
    assert kpa[:, LOST] == pytest.approx(maps_.pressure_kpa.reshape(4, 30)[:, known] @ gain.T)
    assert (sigma[:, LOST] ** 2).sum(1) == pytest.approx(left.sum())
    assert maps_.force_n[1] == pytest.approx(0.1 * np.sqrt(left.sum() + 26 * 9.0))
    assert np.array_equal(kpa[:, known], maps_.pressure_kpa.reshape(4, 30)[:, known])


def test_errors_of_lost_crossings_hold_whatever_size_and_length_the_load_has(model):
    """Length and size by each frame alone: sums over lost crossings within 1.645 errors in 85 to 95 % of the draws."""
    for length_mm in (12.0, 40.0):
        true, maps_ = fields(model, [10.0, 300.0], length_mm, 300, 3.0)
        kpa, sigma = (of.reshape(-1, 30)[:, LOST] for of in maps_.filled)
        off = kpa.sum(1) - true[:, LOST].sum(1)
        inside = np.abs(off) < 1.645 * np.sqrt((sigma**2).sum(1))
        assert 0.85 < inside.mean() < 0.95, length_mm


def test_a_light_load_beside_a_heavy_one_counts_in_the_centre_and_noise_does_not(model):
    """Forefoot of 2.5 standard errors on each of nine crossings, which alone none shows; errors as stated."""
    draw, load = np.random.default_rng(1), np.zeros((300, 5, 6))
    load[:, 1:4, 0], load[:, 1:4, 3:6] = 200.0, 10.0
    kpa = load + 4.0 * draw.normal(size=load.shape)
    found = PressureMaps(model, "by hand", np.arange(300.0), kpa, np.full(load.shape, 4.0))
    x, _, error, _ = found.centre_mm
    true = (load[0].sum(0) @ model.layout.x_mm) / load[0].sum()
    assert x.mean() == pytest.approx(true, abs=0.5)  # 5 mm nearer to the heel without them
    across = 10 * np.sqrt((load[0].sum(0) ** 2).sum() / 12) / load[0].sum()  # anywhere in the 10 mm of each column
    assert 0.5 < np.sqrt(error.mean() ** 2 - across**2) / x.std() < 1.2  # which of them count varies, too


def test_a_press_on_one_square_lies_anywhere_on_it(model):
    """Evenly likely in 10 mm: 10 / sqrt(12). A press of five errors was lost in the noise of the 25 around it."""
    draw, kpa = np.random.default_rng(2), np.zeros((300, 5, 6))
    kpa[:, 2, 3] = 200.0
    _, _, dx, dy = PressureMaps(model, "by hand", np.arange(300.0), kpa, np.full(kpa.shape, 1e-3)).centre_mm
    assert np.array([dx, dy]) == pytest.approx(10 / 12**0.5, rel=1e-4)
    noisy = kpa / 10 + 4.0 * draw.normal(size=kpa.shape)
    x, _, dx, _ = PressureMaps(model, "by hand", np.arange(300.0), noisy, np.full(kpa.shape, 4.0)).centre_mm
    off = x + draw.uniform(-5, 5, 300) - model.layout.x_mm[3]
    assert np.mean(np.abs(off[np.isfinite(x)]) < 1.96 * dx[np.isfinite(x)]) > 0.9


@pytest.mark.parametrize("kind", ["guarded", "two-terminal"])
def test_the_error_of_the_total_force_counts_what_errors_of_crossings_share(model, kind):
    """Resistive tracks mix readings: independent errors gave half of the scatter guarded, and four times it by two."""
    ohm = 50.0
    resistive = replace(
        model, row_ohm=model.row_ohm.times(ohm, "ohm"), column_ohm=model.column_ohm.times(ohm, "ohm"),
        lead_ohm=tuple(ohm * each for each in model.lead_ohm),
    )  # fmt: skip
    readout, draw = ArrayReadout(kind), np.random.default_rng(3)
    exact = frames_of(model, readout, ohm=ohm, pressures_pa=PRESSURE[:1])[2:].repeat((50, 120), axis=0)
    noise = readout.noise * np.abs(exact) * (draw.normal(size=exact.shape) + 1j * draw.normal(size=exact.shape))
    found = inverted(resistive, readout, exact + noise, np.arange(170) < 50, np.arange(170.0), scatter=0.0)
    assert found.by.startswith("the network")
    force, error = found.force_n
    assert error.mean() == pytest.approx(force.std(), rel=0.2)


def test_readings_of_no_capacitance_are_no_numbers(model):
    """The other sign of i, one frame or all; pF typed as F; real parts alone; nothing."""
    readout = ArrayReadout(frequency_hz=(10e3,))
    frames = frames_of(model, readout)
    frames[4] = frames[4].conj()
    found = maps(model, readout, frames)
    assert np.isfinite(found.pressure_kpa[0]).all()
    assert np.isnan(found.pressure_kpa[1]).all()
    assert [found.table().cells[1][k] for k in (1, 2, 6)] == [None] * 3
    assert found.heaviest() == 0
    frames[3] = np.nan
    assert "none is determined" in "\n".join(document.text(maps(model, readout, frames).document()))
    frames = frames_of(model, readout)
    farad = model.capacitance.value
    for wrong, words in (
        (frames.conj(), "median imaginary part is -"),
        (frames * 1e12, f"predicted .*{farad * 1e12:.3g}.* pF"),
        (frames.real + 0j, "0 S"),
        (frames * np.nan, "is none, predicted"),
    ):
        with pytest.raises(BadInput, match=words):
            maps(model, readout, wrong)


def test_what_does_not_settle_is_counted(model, monkeypatch):
    readout = ArrayReadout("two-terminal", frequency_hz=(10e3,), noise=1e-6)
    monkeypatch.setattr("sensorgen.prediction.array.frames._STEPS", 1)
    found = maps(model, readout, frames_of(model, readout))
    dark = int(np.isnan(found.pressure_kpa).sum())
    assert dark > 0
    assert f"{dark} values left out that 1 steps" in found.by


def test_not_determined_is_one_thing_here_and_in_a_study(model):
    readout, flat = ArrayReadout(noise=0.0, noise_s=3e-7), np.full((1, 5, 6), 1e3)
    known = study(model, readout, 1.0).determined
    found = maps(model, readout, frames_of(model, readout, pressures_pa=flat))
    assert np.isfinite(found.pressure_kpa[0]).tolist() == known.tolist()
    assert not known.all()


def test_frames_settle_beside_a_loose_track_at_a_high_frequency():
    """Slopes at rest alone swing there: of the crossings that are read, none settles in 25 steps."""
    long = array_of({"length_mm": 260, "width_mm": 90})
    readout = ArrayReadout(frequency_hz=(100e3,), noise=1e-3)
    print_ = printed(long, 0, 0.0, ["r3:8", "r2c4"])
    heavy = walked(long.layout, frames=8).pressure_kpa[4:5]
    load = np.concatenate([np.zeros((3, *heavy.shape[1:])), heavy])
    frames = print_.frames(load, np.arange(4) / 100, replace(readout, noise=1e-9), np.random.default_rng(0), 0.0)
    found = maps(long, readout, frames)
    assert found.faults == ("r2c4", "r3:8")
    assert "did not settle" not in found.by
    known = np.isfinite(found.pressure_kpa)
    assert known.sum() > 200
    assert np.abs(found.pressure_kpa - heavy)[known].max() < 20


def test_a_standing_load_is_never_taken_for_rest(model):
    readout = ArrayReadout()
    frames = frames_of(model, readout)
    with pytest.raises(BadInput, match="never taken for rest"):
        inverted(model, readout, frames[3:], np.zeros(2, bool), np.arange(2.0))
    with pytest.raises(BadInput, match="all frames are at rest"):
        inverted(model, readout, frames[:3], np.ones(3, bool), np.arange(3.0))
    apart = inverted(model, readout, frames[3:], np.zeros(2, bool), np.arange(2.0), 0.0, frames[:3], surface=False)
    assert np.abs(apart.pressure_kpa - maps(model, readout, frames).pressure_kpa).max() < 1e-6


def test_files_of_both_kinds_say_the_same(tmp_path, model):
    readout = ArrayReadout()
    frames = frames_of(model, readout)
    farad = frames.imag / (2 * np.pi * 10e3)
    np.savez(tmp_path / "f.npz", siemens=frames, rest=np.arange(5) < 3, frequency_hz=10e3, time_s=np.arange(5) / 50)
    names = [f"r{i + 1}c{j + 1}" for i, j in np.ndindex(5, 6)]
    lines = [",".join(["time_s", "rest", *names])]
    for k, frame in enumerate(farad):
        words = [repr(v) for v in frame.ravel().tolist()]
        words[7] = "" if k == 4 else words[7]
        lines.append(",".join([f"{k / 50}", "1" if k < 3 else "", *words]))
    (tmp_path / "f.csv").write_text("\n".join(lines) + "\n")
    one, other = read(tmp_path / "f.npz", (5, 6), None), read(tmp_path / "f.csv", (5, 6), 10e3)
    assert one.time_s.tolist() == other.time_s.tolist()
    assert one.rest.tolist() == other.rest.tolist() == [True] * 3 + [False] * 2
    assert np.isnan(other.siemens.real).all()
    assert np.argwhere(np.isnan(other.siemens.imag)).tolist() == [[4, 1, 1]]
    assert np.nan_to_num(other.siemens.imag[:4]) == pytest.approx(one.siemens.imag[:4])


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("f.csv", "r1c1,r9c1\n1,2\n", "columns r9c1; expected r1c1 to r5c6"),
        ("f.csv", "time_s\n1\n", "without any crossing"),
        ("f.csv", "r1c1,r1c2\n1\n", "row 2: 1 cells, but the header has 2"),
        ("f.csv", "r1c1\nmany\n", "row 2, column r1c1: 'many' is not a number"),
        ("f.csv", "r1c1\n", "no rows below the header"),
        ("f.csv", "r1c1,r01c1\n1,2\n", "columns r1c1, r01c1 repeat"),
        ("f.csv", "time_ms,frequency_hz,r1c1\n0,1e4,1e-12\n", "'time_ms' is not read; expected the time as time_s"),
        ("f.csv", "time_s,frequency_hz,r1c1\n1,1e4,1e-12\n0,1e4,1e-12\n", "time_s does not rise"),
        ("f.npz", "text", "no NPZ file"),
        ("f.npz", {"siemens": np.ones((2, 6, 5))}, "siemens is 2 x 6 x 5; expected frames x 5 rows x 6 columns"),
        ("f.npz", {"other": np.ones(2)}, "no readings; expected siemens or capacitance_f"),
        ("f.npz", {"siemens": np.ones((2, 5, 6)), "frequency_hz": 1e4, "rest": [1]}, "rest has 1 values"),
        ("f.npz", {"siemens": np.array([{}])}, "no NPZ file"),
        ("none.npz", None, "none.npz"),
    ],
)
def test_no_frames_are_an_error(tmp_path, name, content, words):
    path = tmp_path / name
    if isinstance(content, dict):
        np.savez(path, **content)
    elif content is not None:
        path.write_text(content)
    with pytest.raises(BadInput, match=words):
        read(path, (5, 6), None)


def test_a_table_has_its_frequency_and_day_and_no_time_is_no_number(tmp_path, model):
    (tmp_path / "f.csv").write_text("frequency_hz,day,r1c1\n1e4,3,1e-12\n1e4,3,1e-12\n")
    found = read(tmp_path / "f.csv", (5, 6), None)
    assert (found.frequency_hz, found.day) == (1e4, 3.0)
    assert np.isnan(found.time_s).all()
    assert found.siemens[0, 0, 0].imag == pytest.approx(2 * np.pi * 1e4 * 1e-12)
    readout = ArrayReadout()
    untimed = inverted(model, readout, frames_of(model, readout), np.arange(5) < 3, np.full(5, np.nan))
    assert "no time_s: times of the frames are not known" in "\n".join(document.text(untimed.document()))
    assert untimed.table().cells[0][0] is None
    assert static.png(plots.figure(untimed))[:4] == b"\x89PNG"


def test_a_file_at_rest_gives_what_it_marks_and_its_own_frequency(tmp_path):
    path, values = tmp_path / "f.npz", np.arange(3.0)[:, None, None] * np.ones((3, 5, 6))
    np.savez(path, siemens=values, rest=[0, 1, 1], frequency_hz=1e4, Rest=1)
    assert read(path, (5, 6), 1e4).at_rest()[:, 0, 0].tolist() == [1, 2]
    assert read(path, (5, 6), None).unused == ("Rest",)
    with pytest.raises(BadInput, match="frequency_hz is 10 kHz; expected 20 kHz"):
        read(path, (5, 6), 2e4)
    np.savez(path, siemens=values)
    assert len(read(path, (5, 6), 1e4).at_rest()) == 3
