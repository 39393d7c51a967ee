"""The next-best press: its expected covariance by another way, and what it chooses."""

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.prediction.calibration.fitting import Data, covariances, prior
from sensorgen.prediction.calibration.next_press import VALUES, NextPress, PossiblePresses
from sensorgen.prediction.calibration.specimen import Presses
from virtual_specimen import LENGTH_M
from virtual_specimen.adapter import specimen_model

NOISE = np.full(7, 1e-3)
EVERYWHERE = PossiblePresses((0.1, 6.0), (2.5e-3, LENGTH_M - 2.5e-3), (0.3, 30.0))


@pytest.fixture(scope="module")
def model():
    return specimen_model()


def spread(model, posterior):
    which = [model.names.index(name) for name in VALUES]
    return np.linalg.slogdet(posterior.covariance[np.ix_(which, which)])[1]


def test_the_expected_covariance_is_that_of_the_information(model):
    """C' by Woodbury's identity against the inverse of the sum of both informations."""
    known = prior(model, NOISE)
    presses = Presses(np.array([3.0]), np.array([0.02]), np.array([0.4]), np.array([1.0]))
    nothing = np.zeros((1, 7))
    one = Data(presses, nothing.astype(complex), NOISE[None], nothing[0].astype(complex), NOISE)
    slopes = model.slopes(known.at, presses)[0]
    weight = np.linalg.inv(covariances(model, known.at, one, known.components)[0])
    after = np.linalg.inv(np.linalg.inv(known.covariance) + slopes.T @ weight @ slopes)
    which = [model.names.index(name) for name in VALUES]
    expected = np.linalg.slogdet(after[np.ix_(which, which)])[1]
    assert NextPress(model, EVERYWHERE, NOISE).left(known, presses)[0] == pytest.approx(expected, rel=1e-9)


def test_the_first_press_is_the_hardest_one(model):
    """The signal rises with the force, and the noise does not."""
    press = NextPress(model, EVERYWHERE, NOISE).best(prior(model, NOISE))
    assert press.force_n == pytest.approx(6.0)


def test_a_press_after_a_higher_one_ends_where_the_range_ends(model):
    tried = NextPress(model, EVERYWHERE, NOISE).tried
    peak = tried.force_n / (1 - tried.unloading)
    assert peak.max() == pytest.approx(6.0)
    assert set(np.round(peak[tried.unloading > 0], 9)) == {6.0}
    assert tried.force_n.min() == pytest.approx(0.1)
    assert [tried.position_m.min(), tried.position_m.max()] == pytest.approx(EVERYWHERE.position_m)


@pytest.mark.parametrize("wrong", [
    lambda model: NextPress(model, EVERYWHERE, NOISE, "everything"),
    lambda _: PossiblePresses((0.0, 6.0), (0, 1), (1, 2)), lambda _: PossiblePresses((1.0, 2.0), (0, np.inf), (1, 2)),
])  # fmt: skip
def test_wrong_input_is_refused(model, wrong):
    with pytest.raises(BadInput, match="expected"):
        wrong(model)
