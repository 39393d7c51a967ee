"""Recordings of the bench: instrument files, their clocks and marks, and the rig's log joined with them."""

from sensorgen.measure.recording.files import parts, read, read_all
from sensorgen.measure.recording.rig import Joined, RigLog, joined, joined_all, rig
from sensorgen.measure.recording.samples import MARKS, Recording, RecordingClock, Source

__all__ = [
    "MARKS",
    "Joined",
    "Recording",
    "RecordingClock",
    "RigLog",
    "Source",
    "joined",
    "joined_all",
    "parts",
    "read",
    "read_all",
    "rig",
]  # fmt: skip
