"""Record a run so that it can be read whenever it ends, also by a power cut: files that only grow, row by row.

Each row goes to the system at once, so that a killed process loses none, and to the disk within a second. A run has a
folder beside the log; in it every attempt, the first or one that resumed, has its own files of impedance and rig. A
journal has all that happened, one JSON object per line. Whole attempts are logged; those of a killed run are, too, by
the next run of the same log.
"""

import json
import mmap
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np

from sensorgen.core import files, units
from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.measure.lab.devices import Clock, Readings
from sensorgen.measure.log import BenchRun, Log
from sensorgen.measure.log.bench import log_recording

JOURNAL = "journal.jsonl"
_SYNC_S = 0.5  # so that all that is older than a second is on the disk
_RIG = "stamp_s,set_force_n,set_position_mm,force_n,error\n"


class Appended:
    """A file that only grows; every write is whole rows [bytes].

    Parameters
    ----------
    path : Path
        Made if missing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._faults():
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)

    def write(self, text: str) -> None:
        """Append rows; with the system when this returns."""
        left = text.encode()
        with self._faults():
            while left:
                left = left[os.write(self._file, left) :]

    def sync(self) -> None:
        """Return when all is on the disk, at its path."""
        with self._faults():
            os.fsync(self._file)
        if not self._there():
            raise Unwritable(f"{str(self._path)!r} was removed during the run")

    def close(self) -> None:
        """Sync and close; a file that was removed is written again, and named as an error."""
        try:
            if not self._there():
                with self._faults(), files.replacing(self._path) as copy:
                    for at in range(0, os.fstat(self._file).st_size, 1 << 20):
                        copy.write(os.pread(self._file, 1 << 20, at))
                raise Unwritable(f"{str(self._path)!r} was removed during the run, and is written again")
            self.sync()
        finally:
            os.close(self._file)

    def _there(self) -> bool:
        """True where the path is this file still."""
        with suppress(OSError):
            return os.path.samestat(os.fstat(self._file), self._path.stat())
        return False

    def _faults(self) -> AbstractContextManager[None]:
        """Translate errors of the file system to Unwritable."""
        return files.writing(self._path, advice="; make room on the disk")


class SyncedFiles:
    """Brings files to the disk every half second, beside the run, which does not wait for it."""

    def __init__(self, files: Sequence[Appended]) -> None:
        self._files, self._end, self.error = files, threading.Event(), ""
        self._thread = threading.Thread(target=self._work, name="sync", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not self._end.wait(_SYNC_S):
            try:
                for file in self._files:
                    file.sync()
            except Unwritable as error:
                self.error = str(error)
                return

    def end(self) -> None:
        """Stop; the files stay open."""
        self._end.set()
        self._thread.join()


class Recorder:
    """Files of one attempt.

    Parameters
    ----------
    folder : Path
        Of the run.
    stem : str
        Begin of the files' names.
    tones_hz : (m,) array
        Frequencies of the impedance meter [Hz].
    clock : Clock
        The run's.
    """

    def __init__(self, folder: Path, stem: str, tones_hz: Real, clock: Clock) -> None:
        self._clock = clock
        self.impedance, self.rig = Appended(folder / f"{stem}.csv"), Appended(folder / f"{stem}-rig.csv")
        names = [f"{part}_ohm_{units.frequency_text(float(f))}" for f in tones_hz for part in ("re", "im")]
        self.impedance.write(",".join(["time_s", "stamp_s", *names, "clipped", "valid"]) + "\n")
        self.rig.write(_RIG)
        self.journal = Journal(folder / JOURNAL, clock)
        self._synced = SyncedFiles((self.impedance, self.rig, self.journal.file))

    def readings(self, new: Readings) -> None:
        """Append impedances that came just now."""
        if not len(new.time_s):
            return
        stamp = f"{self._clock.epoch():.6f}"
        valid = [bool(np.isfinite(row).all()) for row in new.impedance_ohm]
        columns: list[list[float]] = np.ascontiguousarray(new.impedance_ohm).view(float).tolist()
        rows = zip(new.time_s.tolist(), columns, new.clipped.tolist(), valid, strict=True)
        self.impedance.write(
            "".join(
                f"{time:.9g},{stamp},{','.join([f'{part:.9g}' for part in values])},{clipped:d},{good:d}\n"
                for time, values, clipped, good in rows
            )
        )

    def state(self, set_force_n: float, place_mm: float, force_n: float, error: str = "") -> None:
        """Append a row of the rig; an unknown force is nan [N], [mm]."""
        if self._synced.error:
            raise Unwritable(self._synced.error)
        words = "".join(c for c in error if c.isalnum() or c in " .-_:")
        self.rig.write(f"{self._clock.epoch():.4f},{set_force_n:.4f},{place_mm:.4f},{force_n:.4f},{words}\n")

    def close(self) -> list[str]:
        """Bring all to the disk; what failed."""
        failed = [self._synced.error] if self._synced.error else []
        self._synced.end()
        for file in (self.impedance, self.rig, self.journal.file):
            try:
                file.close()
            except Unwritable as error:
                failed.append(str(error))
        return failed


class Journal:
    """Events, one JSON object per line with ``event`` and ``at``, in seconds since 1970."""

    def __init__(self, path: Path, clock: Clock) -> None:
        self.file, self._clock = Appended(path), clock

    def note(self, event: str, **facts: Any) -> None:
        """Append an event."""
        line = {"event": event, "at": round(self._clock.epoch(), 3), **facts}
        self.file.write(json.dumps(line, ensure_ascii=False) + "\n")


@dataclass(frozen=True)
class RunFolder:
    """A run as its folder tells.

    Attributes
    ----------
    folder : Path
        Beside the log.
    events : tuple of dict
        Of its journal, in their order; a last line that a crash cut off is left out.
    """

    folder: Path
    events: tuple[dict[str, Any], ...]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read the journal.

        Raises
        ------
        BadInput
            No run's folder, or a journal that is damaged before its last line.
        """
        try:
            lines = (folder / JOURNAL).read_bytes().split(b"\n")[:-1]
        except OSError:
            raise BadInput(f"{str(folder)!r} has no {JOURNAL}; expected the folder of a run") from None
        events = []
        for k, line in enumerate(lines, 1):
            try:
                events.append(dict(json.loads(line)))
            except (ValueError, TypeError):
                if k < len(lines):
                    raise BadInput(f"{folder / JOURNAL}, line {k}: not JSON; the journal is damaged") from None
        return cls(folder, tuple(events))

    def of(self, event: str) -> Iterator[dict[str, Any]]:
        """Events of one kind."""
        return (each for each in self.events if each.get("event") == event)

    @property
    def attempts(self) -> int:
        """Number of starts."""
        return sum(1 for _ in self.of("begun"))

    @property
    def done(self) -> set[int]:
        """Numbers of the steps that are done."""
        return {int(each["step"]) for each in self.of("done")}

    @property
    def finished(self) -> bool:
        """True if all of its plan was done."""
        return any(each["end"] == "done" for each in self.of("ended"))


def home(log: Path) -> Path:
    """Folder of the runs of a log, beside it."""
    return log.with_name(f"{log.name}.runs")


def new_folder(log: Path) -> Path:
    """A new folder for a run, named by the time.

    Raises
    ------
    Unwritable
        It cannot be made.
    """
    name, k = datetime.now(UTC).strftime("%Y%m%d-%H%M%S"), 1
    while True:
        folder = home(log) / (f"{name}-{k}" if k > 1 else name)
        with files.writing(folder, "cannot make"), suppress(FileExistsError):
            folder.mkdir(parents=True)
            return folder
        k += 1


def alone(folder: Path) -> AbstractContextManager[bool]:
    """Hold the run's lock inside, which the system lets go with the process; False where another process has it."""
    return files.alone(folder / ".lock", wait=False)


def log_attempts(log: Log, folder: Path, clock: Clock) -> list[BenchRun]:
    """Log the attempts of a run that the log does not have yet; hold the run's lock.

    What cannot be logged, as of a run that was killed before its first reading, is noted in the journal.
    """
    run = RunFolder.read(folder)
    logged = {each["attempt"] for each in run.of("logged")}
    rows: list[BenchRun] = []
    waiting = [each for each in run.of("begun") if each["attempt"] not in logged]
    if not waiting:
        return rows
    trim(folder / JOURNAL)
    journal = Journal(folder / JOURNAL, clock)
    try:
        for attempt in waiting:
            new, problem = _logged(log, folder, attempt)
            rows += new
            journal.note("logged", attempt=attempt["attempt"], rows=[row.number for row in new], problem=problem)
    finally:
        journal.file.close()
    return rows


def _logged(log: Log, folder: Path, attempt: dict[str, Any]) -> tuple[list[BenchRun], str]:
    recording, rig = folder / f"{attempt['stem']}.csv", folder / f"{attempt['stem']}-rig.csv"
    for path in (recording, rig):
        trim(path)
    problem = ""
    for beside in (rig, None):
        try:
            rows = log_recording(log, attempt["specimen"], recording, beside, remark=attempt["remark"])
        except BadInput as error:
            problem = str(error)
        else:
            return [row for row in rows if isinstance(row, BenchRun)], problem
    return [], problem


def trim(path: Path) -> None:
    """Cut off a last row that is not whole."""
    with suppress(FileNotFoundError, ValueError), path.open("rb+") as file:  # ValueError of an empty one
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            end = content.rfind(b"\n") + 1
        if end:
            file.truncate(end)


def recover(log: Log, clock: Clock) -> list[BenchRun]:
    """Log what killed runs of a log have left; runs that go on in other processes are passed over."""
    rows: list[BenchRun] = []
    for folder in sorted(home(log.path).glob("*/")) if home(log.path).is_dir() else ():
        if (folder / JOURNAL).is_file():
            with alone(folder) as ours:
                rows += log_attempts(log, folder, clock) if ours else []
    return rows
