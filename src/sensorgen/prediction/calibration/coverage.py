"""Coverage of a calibration's own intervals: presses are held back in turn, and found again from the others."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.prediction.calibration.fitting import Data, calibrated
from sensorgen.prediction.calibration.inversion import InvertedPresses, Inverter
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel

FOLDS = 5
FEWEST = 10  # presses, with which the others still calibrate


@dataclass(frozen=True)
class Coverage:
    """Presses that were found again from the others.

    Attributes
    ----------
    presses : int
        Number of presses.
    force, position : int
        How many lie in their intervals of 90 %.
    force_width_n, position_width_m : float
        Medians of the intervals' widths [N], [m].
    force_error_n, position_error_m : float
        Root mean squares of median less truth [N], [m].
    """

    presses: int
    force: int
    position: int
    force_width_n: float
    position_width_m: float
    force_error_n: float
    position_error_m: float


def inside(found: InvertedPresses, presses: Presses) -> tuple[Mask, Mask]:
    """Masks of the forces and of the positions that lie in their intervals."""
    return tuple(  # type: ignore[return-value]
        (ends[:, 0] <= truth) & (truth <= ends[:, 1])
        for ends, truth in ((found.force_90_n, presses.force_n), (found.position_90_m, presses.position_m))
    )


def coverage_of(found: InvertedPresses, presses: Presses) -> Coverage:
    """Of presses that are known."""
    force, position = inside(found, presses)
    return Coverage(
        len(force), int(force.sum()), int(position.sum()), float(np.median(np.ptp(found.force_90_n, axis=1))),
        float(np.median(np.ptp(found.position_90_m, axis=1))), _rms(found.force_n - presses.force_n),
        _rms(found.position_m - presses.position_m),
    )  # fmt: skip


def _rms(off: Real) -> float:
    return float(np.sqrt(np.mean(off**2)))


def held_out(
    model: SpecimenModel, data: Data, limit_n: float, step: Callable[[str], None] = lambda _: None
) -> tuple[Coverage, InvertedPresses] | None:  # fmt: skip
    """Coverage of presses held back in turn; None of fewer presses than ``FEWEST``.

    Parameters
    ----------
    model, data
        As of :func:`sensorgen.prediction.calibration.fitting.calibrated`.
    limit_n : float
        Largest force to look for [N].
    step : callable
        Called with what is done next.
    """
    count = len(data.presses.force_n)
    if count < FEWEST:
        return None
    fold = np.arange(count) % FOLDS
    parts = []
    for k in range(FOLDS):
        step(f"held back: part {k + 1} of {FOLDS}")
        known = calibrated(model, data.rows(np.flatnonzero(fold != k)))
        known = replace(known, noise=np.median(data.noise, axis=0))
        parts.append(Inverter(model, known, force_limit_n=limit_n).batch(data.ratio[fold == k]))
    order = np.argsort(np.concatenate([np.flatnonzero(fold == k) for k in range(FOLDS)]), kind="stable")
    found = InvertedPresses.joined(parts).rows(order)
    return coverage_of(found, data.presses), found
