"""Append-only log of readings, recordings and predictions of printed specimens."""

from sensorgen.measure.log.entries import Batch, BenchRun, Entry, Prediction, Print, RawFile, Reading, Specimen
from sensorgen.measure.log.logbook import PLACE, TABLES, Log, place

__all__ = [
    "PLACE", "TABLES", "Batch", "BenchRun", "Entry", "Log", "Prediction", "Print", "RawFile", "Reading", "Specimen",
    "place",
]  # fmt: skip
