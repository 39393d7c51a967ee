"""Estimates as rows of a CSV file, and their summary with advice."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sensorgen.core.document import Part
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.inverse import verdict
from sensorgen.prediction.inverse.estimator import Estimates, Estimator
from sensorgen.prediction.inverse.verdict import Status

COLUMNS = (
    "force_n", "position_mm", "force_error_n", "position_error_mm", "covariance_n_mm", "force_low_n", "force_high_n",
    "position_low_mm", "position_high_mm", "other_force_n", "other_position_mm", "chi2", "tones", "status",
)  # fmt: skip
_MM = 1 / M_PER_MM
_DIAGONAL = np.arange(2)


def rows(given: Sequence[Sequence[str]], estimates: Estimates, *, prior: bool = False) -> str:
    """Rows of a CSV file, blank where a quantity is not identifiable.

    Parameters
    ----------
    given : sequence of sequence of str
        The input's other cells, row by row.
    estimates : Estimates
        The results.
    prior : bool
        A prior was stated: results then count even where the reading has little information.
    """
    words = np.array([status.words for status in Status])[estimates.status]
    return verdict.rows(given, _numbers(estimates, prior), estimates.tones, words)


def _numbers(batch: Estimates, prior: bool) -> np.ndarray[Any, np.dtype[np.float64]]:
    """All columns but the last two; nan is a blank."""
    batch = batch.identified(prior=prior)
    error, error_m = np.sqrt(batch.covariance[:, _DIAGONAL, _DIAGONAL]).T
    columns = [
        batch.force_n, batch.position_m * _MM, error, error_m * _MM,
        batch.covariance[:, 0, 1] * _MM, *batch.force_90_n.T, *batch.position_90_m.T * _MM,
        batch.other_force_n, batch.other_position_m * _MM, batch.chi2,
    ]  # fmt: skip
    numbers = np.stack(columns, -1)
    numbers[batch.tones == 0] = np.nan
    return numbers


@dataclass(frozen=True)
class InversionSummary:
    """Counts and medians over all samples.

    Attributes
    ----------
    samples : int
        Number of samples.
    statuses : dict of str to int
        How many have which status.
    frequency_hz : tuple of float
        Frequencies of the readings [Hz].
    force_limit_n : float
        Largest force that was searched [N].
    median_force_error_n, median_position_error_mm : float or None
        Medians of standard errors [N], [mm]; None where none is finite.
    median_residual_over_noise : float or None
        Median of residuals relative to the noise [-].
    doubts, advice : tuple of str
        Why the estimates are uncertain, and what to do about it.
    """

    samples: int
    statuses: dict[str, int]
    frequency_hz: tuple[float, ...]
    force_limit_n: float
    median_force_error_n: float | None
    median_position_error_mm: float | None
    median_residual_over_noise: float | None
    doubts: tuple[str, ...]
    advice: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """Counts, standard errors, doubts and advice."""

        def said(value: float | None, unit: str) -> str:
            return "unknown" if value is None else f"{value:.3g} {unit}"

        counts = ", ".join(f"{count} {words}" for words, count in self.statuses.items())
        yield f"{self.samples} sample{'s' * (self.samples != 1)}: {counts}"
        force, position = said(self.median_force_error_n, "N"), said(self.median_position_error_mm, "mm")
        yield f"median standard errors: force {force}, position {position}"
        yield from (f"note: {doubt}" for doubt in self.doubts)
        yield from self.advice


class Summary(verdict.Tally):
    """Counts of estimates and medians of their errors, block by block.

    Parameters
    ----------
    estimator : Estimator
        That makes the estimates.
    doubts : sequence of str
        Why its sensor is uncertain.
    """

    def __init__(self, estimator: Estimator, doubts: Sequence[str] = ()) -> None:
        super().__init__(Status, COLUMNS)
        self._estimator, self._doubts = estimator, (*doubts, *estimator.doubts)

    def add(self, estimates: Estimates) -> None:
        """Count a block."""
        free = estimates.tones > 1
        force, position = np.sqrt(estimates.covariance[estimates.tones > 0][:, _DIAGONAL, _DIAGONAL]).T
        excess = np.sqrt(estimates.chi2[free] / (2 * estimates.tones[free] - 2))
        self.count(estimates.status, force=force, position=position * _MM, excess=excess)

    def result(self) -> InversionSummary:
        """The summary so far."""
        return InversionSummary(
            samples=self.samples, statuses=self.by_words(), frequency_hz=tuple(self._estimator.frequency_hz.tolist()),
            force_limit_n=float(self._estimator.scale[0]), median_force_error_n=self.median("force"),
            median_position_error_mm=self.median("position"), median_residual_over_noise=self.median("excess"),
            doubts=self._doubts, advice=tuple(self._advice()),
        )  # fmt: skip

    def _advice(self) -> Iterator[str]:
        """Advice where most samples have the same problem."""
        excess = self.median("excess")
        if self.most(Status.NO_FIT) and excess is not None:
            yield (
                f"most readings fit no press: residuals are {excess:.3g} times the noise; set a larger --noise if it "
                "is noise, or another design or material source if it is not"
            )
        if self.most(Status.NOT_IDENTIFIABLE, Status.FORCE_ONLY):
            yield (
                "most readings have too little information: average them, choose frequencies nearer to the "
                "corner frequency, more resistive electrodes or a softer cell (see sensorgen predict), or set --prior"
            )
        if self.most(Status.AT_THE_END):
            yield "most presses lie at the limits of the search: check --force-limit, and which end is connected"
