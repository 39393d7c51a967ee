"""Calibration over days on published recordings of an insole: ours beside its authors' 164 coefficients an element.

    python bench/published_insole.py [--from FOLDER]

Belli et al., "Modeling and Calibration of Pressure-Sensing Insoles via a New Plenum-Based Chamber", Sensors 2023,
23(9), 4501 (data BSD-3): 280 capacitive elements in an air chamber, seven recordings of the left insole. They are
fetched into the cache, each with its SHA-256, or read from a folder. Writes ``results/published_insole.md``.
"""

import argparse
import hashlib
import os
import urllib.request
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.io
from scipy.signal import lfilter

from sensorgen.prediction.array.elements import ArraySession, LawForm, flickering
from sensorgen.prediction.array.sessions import law_of, median_error, study

HERE = Path(__file__).parent
COMMIT = "34f0241dc1dff39c6d3fb764a9dd182fafea31aa"
SOURCE = f"https://raw.githubusercontent.com/ami-iit/paper_belli_2023_sensors_insole-calibration/{COMMIT}/Data"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "sensorgen" / "published-insole"
MODEL = "results/model_20221108.mat"
RECORDINGS = {
    "calibration": "left_insole/calibration_dataset.mat",
    "validation 1": "left_insole/validation_dataset_1.mat",
    "validation 2": "left_insole/validation_dataset_2.mat",
    "validation 3": "left_insole/validation_dataset_3.mat",
    "15 September, dynamic": "left_insole/experiment_Inf_15September_dynamic_1.mat",
    "15 September, steps": "left_insole/experiment_Inf_15September_steps_1.mat",
    "17 September, dynamic": "left_insole/experiment_Inf_17September_dynamic_2.mat",
}
SHA256 = (
    "408b87b312bf0c66bc7d8c203cb691c05292d3209dc0c3c6fc43ecedfaf0599e",
    "a19f04e8000863c8b31cc981b9c823c5865fba7504731580279ecd7a846c0c46",
    "93b70df0d4dcb9c51bc1f219f2de26053d012f5c51a0ff88ebb09bc36929a189",
    "3084d32e4dfb789c8925e7f6134fb246698cc4290b28bf20674b18fdd3f9d22f",
    "1665791f300362512d32acb11248bc07eafc92b2a83146ab0d026aa02b850d22",
    "6224d2a51629291a3a6a9c49e80df1fdcedeb1ce2ffe7a47634fbb603778876b",
    "6da1ecf9648562e749b7af105aeed5a9d60608cc7884b2dae57ab067cd81f12a",
    "691847a7e3ec3df34f9b43848ea015a26c293da8698330bccf44a7f463fe5b08",
)
GOALS_BAR = ("0.153", "0.160", "0.086", "0.135", "0.117", "-")
BEGIN_UNLOADED = 6  # of the recordings: the last one has no unloaded second before its loads
FORMS = (LawForm(tared=False), LawForm(), LawForm(tau_s=100.0))
KPA_PER_BAR = 100.0
COUNTS = 240  # of an element without load; they fall under it
STEP_S = 0.0204  # of the reference, which has no clock: the one with which all seven correlate best
LEAST, MOST = 100, 250  # counts of an element that is connected
SMOOTH = 0.1  # share of a new sample in the authors' filter of counts; of both here, so that neither lags
RISE_BAR = 0.05  # from a sample of the reference to the next, above which the authors leave both out
UNLOADED_BAR = 0.1
EACH = 25  # frame that is used of the filtered ones: half a second


HEAD = """# Calibration over days on published recordings of an insole

Made by `bench/published_insole.py`, which fetches them: Belli et al., Sensors 2023, 23(9), 4501; 280 capacitive
elements, all under one pressure. Median over elements of the rms error in each recording, in bar; 84 elements that
the authors call broken are left out, and in each recording those that are disconnected or frozen. The reference has
no clock, and drifts by up to 5 s against the counts: it is laid on their time by what of both is fast, one step of
20.4 ms for all and an offset for each. Ours err from the reference less what it shows without load; the authors'
coefficients, which contain that, from the reference as it is. Both are smoothed alike.

Elements flicker where more than a hundredth of their samples jump to another value and back within a tenth of a
second, as `calibrate` counts them: the second part is what it gives for files of all samples.

On 15 September, dynamic, readings at rest fall: something lay on the insole before. The tare is that to which they
fall; the time in which they do is weighed by the readings, and by what is known before: 100 s, up to a factor of 3.

A state of 100 s was found on these recordings by leaving one out, and so were the way in which a law's terms are
chosen and the rule for a falling rest: these are not independent of what they are tested on. The law that the others
choose is. The law and its intervals take nothing from the recording that is left out but its first unloaded 20 s; its
clock's offset and the choice of elements, dead, frozen or flickering, are of all of it."""


def fetch(folder):
    """Fetch the files that are missing; refuse those that are others."""
    for name, sha256 in zip((MODEL, *RECORDINGS.values()), SHA256, strict=True):
        path = folder / name
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            with urllib.request.urlopen(f"{SOURCE}/{name}", timeout=60) as answer:
                path.write_bytes(answer.read())
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if digest != sha256:
            raise SystemExit(f"{path}: SHA-256 {digest}; expected {sha256}: delete the file, and fetch it")


def smoothed(values, share=SMOOTH):
    """Exponential mean along time."""
    start = (1 - share) * values[:1]
    return lfilter([share], [1, share - 1], values, axis=0, zi=start)[0]


def high(values, seconds, each_s):
    """Fast part of a signal, of less than some seconds, without delay."""
    share = each_s / seconds
    return values - (smoothed(values, share) + smoothed(values[::-1], share)[::-1]) / 2


def offset_s(time_s, counts, bar):
    """Start of the reference after that of the counts, by what of both is fast: hysteresis is slow [s]."""
    grid = np.arange(0, time_s[-1], 0.05)
    reading = high(np.interp(grid, time_s, smoothed(COUNTS - np.nanmedian(counts, 1), 0.3)), 4.0, 0.05)
    found = []
    for start in np.arange(-1.0, 4.0, 0.1):
        at = start + STEP_S * np.arange(len(bar))
        both = (grid >= at[0]) & (grid <= at[-1])
        there = np.interp(grid, at, bar)
        found.append((np.corrcoef(reading[both], (high(there, 4.0, 0.05) / (0.3 + there))[both])[0, 1], start))
    return max(found)[1]


def recording(path):
    """Seconds, counts (k, 280), nan of elements that are dead, and reference [bar], with one clock."""
    data = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False)["experiment"]
    time_s, counts, bar = data.C[:, 1] - data.C[0, 1], data.C[:, 2:].astype(float), data.P.astype(float)
    lost = (counts < LEAST) | (counts > MOST)
    last = np.maximum.accumulate(np.where(lost, 0, np.arange(len(counts))[:, None]), axis=0)
    held = np.take_along_axis(counts, last, 0)  # a sample that is lost: the last one
    held[:, (counts.std(0) < 0.5) | (lost.mean(0) > 0.05)] = np.nan
    at = offset_s(time_s, held, bar) + STEP_S * np.arange(len(bar))
    both = (time_s >= at[0]) & (time_s <= at[-1])
    return time_s[both], held[both], np.interp(time_s[both], at, bar)


def authors(model, counts):
    """Pressures by the authors' coefficients: a cubic, and powers of the 40 samples before [bar]."""
    coefficients = model["coefficients_all_taxels"].reshape(counts.shape[1], -1)
    terms = [counts**power for power in (3, 2, 1, 0)]
    found, before = sum(c * term for c, term in zip(coefficients.T[:4], terms, strict=True)), counts
    for k in range(int(model["HISTORY_SAMPLES"])):
        before = np.vstack([counts[:1], before[:-1]])
        found += sum(coefficients[:, 4 + 4 * k + power - 1] * before**power for power in (1, 2, 3, 4))
    return found


def smooth(time_s, counts, bar):
    """Counts and reference through one filter, without samples between which the reference jumps; every 25th frame."""
    near = [k for k, (a, b) in enumerate(pairwise(bar)) if abs(b - a) < RISE_BAR]
    return time_s[near][::EACH], smoothed(counts[near])[::EACH], smoothed(bar[near])[::EACH]


def session(name, time_s, counts, bar):
    """Session for the calibration; its reference is what the chamber's shows above that without load."""
    free = bar < max(UNLOADED_BAR, bar.min() + 0.02)
    one = ArraySession(name, 0.0, time_s, COUNTS - counts, free, np.zeros(counts.shape), np.full(len(bar), np.nan))
    above = bar - bar[one.unloaded].mean()
    return replace(one, pressure_kpa=np.repeat(KPA_PER_BAR * above[:, None], counts.shape[1], 1))


def by_one(sessions, peers):
    """Rows of each recording by a calibration of the first one, in bar: the authors', and three laws of ours."""
    laws = [law_of(sessions[:1], form) for form in FORMS]
    for one, peer, goal in zip(sessions[1:], peers[1:], GOALS_BAR, strict=True):
        errors = [peer, *(median_error(law.pressures(one)[0], one) / KPA_PER_BAR for law in laws)]
        live = int(np.isfinite(one.reading).all(0).sum())
        yield f"| {one.name} | {live} | {' | '.join(f'{e:.3f}' for e in errors)} | {goal} |"


def by_others(sessions):
    """Rows of each recording by a calibration of all others, which choose the law, in bar."""
    found = study(sessions).errors
    for e in found:
        errors = " | ".join(f"{each / KPA_PER_BAR:.3f}" for each in (e.static_kpa, e.tared_kpa, e.error_kpa))
        yield f"| {e.session} | {errors} | {e.form} | {100 * e.coverage:.0f} |"
    means = (np.mean([getattr(e, key) for e in found]) for key in ("static_kpa", "tared_kpa", "error_kpa"))
    means = " | ".join(f"{each / KPA_PER_BAR:.3f}" for each in means)
    yield f"| mean | {means} | | {100 * np.mean([e.coverage for e in found]):.0f} |"


def tables(folder):
    """The page, line by line."""
    model = scipy.io.loadmat(folder / MODEL, squeeze_me=True)
    whole = np.setdiff1d(np.arange(280), model["broken_index_calib"] - 1)
    raw = {name: recording(folder / file) for name, file in RECORDINGS.items()}
    jumps = {name: flickering(time_s, counts) for name, (time_s, counts, _) in raw.items()}
    yield HEAD
    for about, leaves_out in (("All 196 elements that their authors use", False), ("Those that do not flicker", True)):
        sessions, peers = [], []
        for name, (time_s, counts, bar) in raw.items():
            used = whole[~jumps[name][whole]] if leaves_out else whole
            near = smooth(time_s, counts, bar)
            near[1][:, np.setdiff1d(np.arange(280), used)] = np.nan
            steps = [k for k, (a, b) in enumerate(pairwise(bar)) if abs(b - a) < RISE_BAR]
            off = authors(model, smoothed(counts[steps]))[::EACH] - near[2][:, None]
            peers.append(np.nanmedian(np.sqrt((off**2).mean(0))[used]))
            sessions.append(session(name, near[0], near[1][:, whole], near[2]))
        yield f"\n## {about}\n\nCalibrated by the calibration recording alone:\n"
        yield " | ".join(["| recording | live | authors", *(form.words() for form in FORMS), "goal, with a tare |"])
        yield "|---|---|---|---|---|---|---|"
        yield from by_one(sessions, peers)
        yield "\nEach of the six that begin without load, by the five others, which choose the law:\n"
        yield "| recording | cubic | cubic, tare | chosen | law that is chosen | in the interval of 90 % [%] |"
        yield "|---|---|---|---|---|---|"
        yield from by_others(sessions[:BEGIN_UNLOADED])


def main():
    """Write the page."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--from", dest="folder", type=Path, default=CACHE, help="folder Data of the repository")
    folder = options.parse_args().folder
    fetch(folder)
    (HERE / "results" / "published_insole.md").write_text("\n".join(tables(folder)) + "\n")


if __name__ == "__main__":
    main()
