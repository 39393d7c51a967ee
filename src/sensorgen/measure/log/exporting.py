"""The log out of its file: readings as one table, or everything as a folder of tables with the raw files."""

import os
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from sensorgen.core import files as store
from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.measure.log import exchange, files
from sensorgen.measure.log.entries import Entry, RawFile, Reading
from sensorgen.measure.log.leftovers import part_of
from sensorgen.measure.log.logbook import Log


def export(log: Log, place: Path) -> int:
    """Write readings to a ``.csv`` or ``.parquet`` file, or the whole log to a folder that is not there yet.

    Parameters
    ----------
    log : Log
        An open one.
    place : Path
        Where to.

    Returns
    -------
    int
        How many rows were written.

    Raises
    ------
    BadInput
        The folder is there; or a raw file of the log is missing.
    Unwritable
        The place cannot be written to.
    """
    form = place.suffix.lower().removeprefix(".")
    if form in exchange.FORMATS:
        return _table(log, Reading, place, form)
    if place.suffix or os.path.lexists(place):
        raise BadInput(
            f"cannot export to {str(place)!r}; expected a .csv or .parquet file, or a folder that is not there"
        )
    return _folder(log, place)


def _folder(log: Log, folder: Path) -> int:
    part = part_of(folder)
    try:
        (part / "files").mkdir(parents=True)
        rows = sum(_table(log, kind, part / f"{name}.csv", "csv") for kind, name in exchange.FILES.items())
        for file in log.entries(RawFile):
            shutil.copyfile(files.place(log.files, file), part / "files" / file.uid)
        part.rename(folder)
        return rows
    except OSError as error:
        raise Unwritable(f"cannot export to {str(folder)!r}: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            shutil.rmtree(part)


def _table(log: Log, kind: type[Entry], path: Path, form: str) -> int:
    count = 0

    def counted() -> Iterator[Entry]:
        nonlocal count
        for entry in log.entries(kind, superseded=True):
            count += 1
            yield entry

    if form == "parquet":
        store.replace(path, exchange.parquet(kind, counted()))
    else:
        with store.replacing(path) as file:
            for piece in exchange.csv_pieces(kind, counted()):
                file.write(piece.encode())
    return count
