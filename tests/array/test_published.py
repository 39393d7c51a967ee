"""Reading of the published recordings: planted clocks, lost samples and files."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import scipy.io

SPEC = importlib.util.spec_from_file_location("published", Path(__file__).parents[2] / "bench" / "published_insole.py")
published = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(published)


def test_a_reference_without_a_clock_is_laid_on_the_counts(tmp_path):
    """An offset of 1.7 s and a step of 20.4 ms beside one of 20.6 are found; lost samples keep the last value."""
    rng, time_s = np.random.default_rng(0), 0.0206 * np.arange(6000)
    knots = np.arange(0, 130, 4.0)
    bar = np.interp(np.arange(0, 124, 1e-3), knots, np.abs(rng.normal(size=len(knots))))
    at = 1.7 + published.STEP_S * np.arange(5900)
    pressure = np.interp(time_s, np.arange(0, 124, 1e-3), bar)
    counts = 240 - 12 * pressure[:, None] * np.ones(6) + rng.normal(size=(6000, 6)) * 0.3
    counts[100, 0], counts[:, 5] = 0, 255
    data = {
        "C": np.column_stack([np.arange(6000), 500 + time_s, counts]),
        "P": np.interp(at, np.arange(0, 124, 1e-3), bar),
    }
    scipy.io.savemat(tmp_path / "one.mat", {"experiment": data})
    seconds, held, there = published.recording(tmp_path / "one.mat")
    assert there == pytest.approx(np.interp(seconds, time_s, pressure), abs=0.08)  # 0.2 s of 0.4 bar/s
    assert np.isnan(held[:, 5]).all()
    assert held[:, :5].min() > 200


def test_another_file_is_refused(tmp_path):
    for name in (published.MODEL, *published.RECORDINGS.values()):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    with pytest.raises(SystemExit, match=r"SHA-256 e3b0c442.*; expected 408b87b3"):
        published.fetch(tmp_path)
