"""Answers of an inversion, as rows of a CSV file, and its summary with advice."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Mask
from sensorgen.core.document import Part
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.calibration.inversion import WIDE, InvertedPresses, Verdict
from sensorgen.prediction.calibration.rest import STALE_S
from sensorgen.prediction.inverse import verdict

COLUMNS = (
    "force_n", "force_low_n", "force_high_n", "position_mm", "position_low_mm", "position_high_mm", "chi2", "tones",
    "status",
)  # fmt: skip
REST = "rest"


def rows(given: Sequence[Sequence[str]], presses: InvertedPresses, rest: Mask) -> str:
    """Rows of a CSV file, blank where nothing was found.

    Parameters
    ----------
    given : sequence of sequence of str
        The input's other cells, row by row.
    presses : InvertedPresses
        The results.
    rest : (n,) array of bool
        Readings at rest.
    """
    force, place = presses.force_90_n, presses.position_90_m / M_PER_MM
    numbers = np.column_stack([presses.force_n, force, presses.position_m / M_PER_MM, place, presses.chi2])
    words = np.where(rest, REST, np.array([v.words for v in Verdict])[presses.verdict])
    return verdict.rows(given, numbers, presses.tones, words)


@dataclass(frozen=True)
class CalibratedInversion:
    """Counts over all readings under load, and medians of the medians of their blocks.

    Attributes
    ----------
    of : str
        The specimen or design.
    calibrated_by : int
        Known presses that the calibration rests on; 0 without one.
    samples, at_rest : int
        Readings under load, and at rest.
    statuses : dict of str to int
        How many have which status.
    force_limit_n : float
        Largest force that was looked for [N].
    length_mm : float
        Of the sensor; 0 where nothing was read [mm].
    median_force_width_n, median_position_width_mm : float or None
        Of the 90 % intervals [N], [mm].
    noise : float
        Median standard deviation of a ratio's parts over the tones [-].
    notes : tuple of str
        What to doubt.
    """

    of: str
    calibrated_by: int
    samples: int
    at_rest: int
    statuses: dict[str, int]
    force_limit_n: float
    length_mm: float
    median_force_width_n: float | None
    median_position_width_mm: float | None
    noise: float | None
    notes: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """Counts, widths, and advice."""
        counts = ", ".join(f"{count} {words}" for words, count in self.statuses.items()) or "none"
        yield f"{self.of}: {self.samples} readings under load ({self.at_rest} at rest): {counts}"
        if self.median_force_width_n is not None:
            yield (
                f"median widths of the 90 % intervals: {self.median_force_width_n:.3g} N, "
                f"{self.median_position_width_mm:.3g} mm (noise {self.noise:.2g} of |Z|)"
            )
            if (self.median_position_width_mm or 0.0) > WIDE * self.length_mm:
                yield f"this sensor of {self.length_mm:g} mm does not locate such presses: force alone"
        yield from self._advice()

    def _advice(self) -> Iterator[str]:
        if not self.calibrated_by:
            yield (
                "not calibrated: the intervals hold all that a specimen of this design may differ in; some 30 known "
                "presses make them several times narrower (sensorgen calibrate)"
            )
        most = self.samples / 2
        if self.statuses.get(Verdict.STALE_REST.words, 0) > most:
            yield f"most readings at rest are older than {STALE_S:g} s: take one before each press"
        if self.statuses.get(Verdict.LOADED_REST.words, 0):
            yield (
                "readings lie below their reading at rest: something lay on the sensor when that was taken, or it has "
                "drifted since; lift everything off for it"
            )
        unfit = sum(self.statuses.get(v.words, 0) for v in (Verdict.NO_FIT, Verdict.MORE, Verdict.CHANGED))
        if unfit > most:
            yield (
                "most readings are of no single press on the calibrated sensor: another specimen or tip, a hand, or a "
                "change; recheck it with 3 to 5 known presses (sensorgen calibrate --recheck)"
            )
        yield from (f"note: {note}" for note in self.notes)


class CalibratedSummary(verdict.Tally):
    """Counts of results and medians of their widths, block by block."""

    def __init__(self) -> None:
        super().__init__(Verdict, COLUMNS)
        self.at_rest = 0

    def add(self, presses: InvertedPresses, rest: Mask) -> None:
        """Count a block."""
        self.at_rest += int(rest.sum())
        good = ~rest & np.isfinite(presses.force_n)
        force, place = (np.ptp(ends[good], axis=1) for ends in (presses.force_90_n, presses.position_90_m))
        self.count(presses.verdict[~rest], force=force, position=place / M_PER_MM)

    def result(
        self, of: str, by: int, limit_n: float, length_m: float, noise: float | None, notes: Sequence[str]
    ) -> CalibratedInversion:  # fmt: skip
        """The summary so far."""
        return CalibratedInversion(
            of, by, self.samples, self.at_rest, self.by_words(), limit_n, length_m / M_PER_MM, self.median("force"),
            self.median("position"), noise, tuple(notes),
        )  # fmt: skip
