"""Intervals of material values, force and position hold random virtual truths; bench/lab_truths.py has 1000 of them."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

sys.path.insert(0, str(Path(__file__).parent))

import truths

from sensorgen.core.errors import BadInput
from sensorgen.design.design import make
from sensorgen.prediction.calibration.fitting import Data, calibrated, prior
from sensorgen.prediction.calibration.materials import estimate, source_text
from sensorgen.prediction.calibration.specimen import unknown

MATERIALS = ("resistivity_ohm_m", "relative_permittivity", "youngs_modulus_pa")


@pytest.fixture(scope="module")
def outcomes():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return [truths.outcome(seed) for seed in range(10_000, 10_060)]


@pytest.mark.nightly
@pytest.mark.parametrize("level", truths.LEVELS)
@pytest.mark.parametrize("name", MATERIALS)
def test_intervals_of_materials_hold_as_often_as_they_say(outcomes, name, level):
    held = sum(one.held[name, level][0] for one in outcomes)
    low, high = binom.ppf([1e-4, 1 - 1e-4], len(outcomes), level)
    assert low <= held <= high


@pytest.mark.nightly
@pytest.mark.parametrize("level", truths.LEVELS)
@pytest.mark.parametrize("name", ["F", "x"])
def test_intervals_of_presses_hold_as_often_as_they_say(outcomes, name, level):
    """Presses of one specimen are not independent: the limits are those of its shares."""
    shares = np.array([np.mean(one.held[name, level]) for one in outcomes])
    assert shares.mean() == pytest.approx(level, abs=4 * shares.std() / len(shares) ** 0.5)


@pytest.mark.nightly
def test_they_tell_more_than_was_known(outcomes):
    widths = [np.median([one.width[name, 0.95] for one in outcomes]) for name in MATERIALS]
    before = 2 * 1.96 * np.array([0.5, 0.1, 0.25])
    assert (np.array(widths) < before * [0.1, 0.5, 0.4]).all()


@pytest.fixture(scope="module")
def one():
    """A sensor as expected, and its calibration by presses that read so."""
    expected, links = truths.model()
    nothing, rng = np.zeros(len(expected.names)), np.random.default_rng(5)
    presses = unknown(np.linspace(0.5, 6.0, 30), rng.permutation(np.linspace(0.01, 0.09, 30)))
    ratio, rest = expected.ratio(nothing, presses), expected.rest(nothing)
    noise = np.broadcast_to(truths.NOISE * 2**0.5, ratio.shape)
    return expected, links, calibrated(expected, Data(presses, ratio, noise, rest, np.full(len(rest), 3e-4)))


def test_without_a_reading_the_estimate_is_what_was_known(one):
    expected, links, _ = one
    nothing = prior(expected, truths.NOISE)
    for link in links:
        found = estimate(expected, nothing, link)
        assert (found.lower, found.upper) == pytest.approx((found.before_lower, found.before_upper), rel=1e-3)
        assert not found.told
    with pytest.raises(BadInput, match="known presses tell them"):
        source_text("nothing", [estimate(expected, nothing, link) for link in links])


def test_errors_of_the_model_are_in_the_interval(one):
    """A planted error of sizes and models ten times as large is one in the interval."""
    from dataclasses import replace

    expected, links, posterior = one
    for link in links:
        wide = estimate(expected, posterior, replace(link, error=10 * link.error))
        usual = estimate(expected, posterior, link)
        assert np.log(wide.upper / wide.lower) > 1.3 * np.log(usual.upper / usual.lower), link.parameter


def test_a_source_of_the_values_can_be_named_by_a_design(one, tmp_path, monkeypatch):
    expected, links, posterior = one
    monkeypatch.setenv("SENSORGEN_MATERIALS", str(tmp_path))
    found = [estimate(expected, posterior, link) for link in links]
    (tmp_path / "s1.yaml").write_text(source_text('calibration of "S1"', found), "utf-8")
    design = make({**truths.DESIGN, "materials": {
        "top_electrode": "etpu@s1", "bottom_electrode": "etpu@s1", "dielectric": "x60@s1",
    }})  # fmt: skip
    value = design.material("x60").value("youngs_modulus_pa", "s1")
    assert value.value == pytest.approx(found[2].value, rel=1e-5)
    assert (value.low, value.high) == pytest.approx((found[2].lower, found[2].upper), rel=1e-5)
