"""Append-only log of readings, recordings and predictions of printed specimens."""

from sensorgen.measure.log.entries import (
    Anchor,
    Batch,
    BenchRun,
    Calibration,
    DesignRow,
    Entry,
    Prediction,
    Print,
    RawFile,
    Reading,
    Specimen,
    Withdrawal,
)
from sensorgen.measure.log.logbook import PLACE, Log, place

__all__ = [
    "PLACE", "Anchor", "Batch", "BenchRun", "Calibration", "DesignRow", "Entry", "Log", "Prediction", "Print",
    "RawFile", "Reading", "Specimen", "Withdrawal", "place",
]  # fmt: skip
