"""Bind specimens of any name to the design that they were printed of."""

import re
import uuid
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.records import shown
from sensorgen.design import design as designs
from sensorgen.design.design import Design
from sensorgen.measure.log import batches, notes
from sensorgen.measure.log.entries import BenchRun, Entry, Print, Reading
from sensorgen.measure.log.logbook import Log

_NAME = re.compile(r"(?=.*[^\W\d_])[^\W_][\w .,:+#()/-]{0,59}")
_EXPECTED = "at most 60 letters, digits, blanks and . , : + # ( ) / - _, a letter among them, as S1 or plate-2 left"


def bind(
    log: Log, names: Sequence[str], design: str = "", *, printed: str = "", iteration: int | None = None
) -> list[Entry]:
    """Log which design specimens were printed of; those that are bound to it already are passed over.

    Parameters
    ----------
    log : Log
        An open log.
    names : sequence of str
        Names of the specimens, any.
    design : str
        A design file, or identity or name of a design in the log; "" for that of ``printed``.
    printed : str
        Name of one specimen on its print bed; "" if unknown.
    iteration : int or None
        Of the design, to report specimens together; that of ``printed`` if None.

    Returns
    -------
    list of Entry
        The new prints.

    Raises
    ------
    BadInput
        A name that cannot be one, or that has another design; a design or a print that the log does not have.
    """
    if bool(design) == bool(printed):
        raise BadInput(f"{'both' if design else 'neither'} of --design and --printed given; expected one of them")
    if printed and len(names) > 1:
        raise BadInput(f"--printed {shown(printed)} is one specimen; expected one name for it, not {len(names)}")
    on_bed = _on_bed(log, printed) if printed else None
    of = _logged(log, on_bed.design_id) if on_bed else _design(log, design)
    if iteration is None and on_bed:
        iteration = on_bed.iteration
    rows: list[Entry] = [batches.design_row(of.id(), of.name, of.resolved())]
    for written in names:
        name = " ".join(written.split())
        if not _NAME.fullmatch(name):
            raise BadInput(f"{shown(written)} cannot be a specimen's name; expected {_EXPECTED}")
        bound = log.bound(name)
        design_id = on_bed.design_id if on_bed else of.id()
        if bound and bound.design_id == design_id:
            continue
        _check_measured(log, name, design_id, of.name)
        params = of.params
        film_mm = getattr(params, "dielectric_mm", None)
        rows.append(Print(
            uid=uuid.uuid4().hex, specimen=name, iteration=iteration, shape=of.shape,
            axes=str(getattr(params, "along", "")).upper(), film_mm=None if film_mm is None else float(film_mm),
            batch_uid=on_bed.batch_uid if on_bed else "", design_id=design_id, design=of.name,
            printed=on_bed.specimen if on_bed else "",
        ))  # fmt: skip
    return [row for row in log.add(rows) if isinstance(row, Print)] if len(rows) > 1 else []


def _on_bed(log: Log, printed: str) -> Print:
    found = log.bound(" ".join(printed.split())) or log.bound(notes.specimen(printed).specimen)
    if found is None:
        raise BadInput(f"no print {shown(printed)} in the log; sensorgen log import batch.json logs those of a bed")
    return found


def _design(log: Log, design: str) -> Design:
    """A design by its file, or by identity or name of one in the log."""
    if Path(design).is_file() or Path(design).suffix.lower() in (".yaml", ".yml"):
        return designs.load(Path(design))
    named = {key: of for key, of in batches.designs(log).items() if design in (key, of.name)}
    if len(named) == 1:
        return next(iter(named.values()))
    known = ", ".join(sorted({of.name for of in batches.designs(log).values()})) or "none"
    why = f"{len(named)} designs have that name, {', '.join(named)}" if named else f"designs in the log: {known}"
    raise BadInput(f"--design {shown(design)}: expected a design file, as mine.yaml, or the identity of one ({why})")


def _logged(log: Log, design_id: str) -> Design:
    found = batches.designs(log).get(design_id)
    if found is None:
        raise MissingValue(f"the log has design {design_id} by its identity alone; give its file: --design FILE")
    return found


def _check_measured(log: Log, name: str, design_id: str, design: str) -> None:
    """Refuse a name under which another design was measured: its readings would change their design."""
    rows = chain(log.entries(Reading, specimen=name), log.entries(BenchRun, specimen=name))
    other = next((row for row in rows if row.design_id not in ("", design_id)), None)
    if other:
        raise BadInput(
            f"{shown(name)} was measured as {other.design} ({other.design_id}) and cannot become {design} "
            f"({design_id}): take another name, as '{name} own'"
        )
