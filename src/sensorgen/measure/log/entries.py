"""Kinds of rows of the log, one dataclass for each.

Rows are never changed or deleted. A correction is a new row that names the old one in ``supersedes``; a withdrawal
does so for a row of any kind.
"""

from dataclasses import dataclass, fields

from sensorgen.core.errors import BadInput
from sensorgen.measure.immittance import QUANTITIES

DEFECTS = ("misprint", "zits", "hole", "clog", "under-extrusion", "adhesion", "torn")


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Row of any kind.

    Attributes
    ----------
    uid : str
        Identity, the same in every copy of the log: a hash of an imported row's content, else random.
    logged_at : str
        Time of logging in this log, UTC, ISO 8601; "" before.
    claimed_at : str
        For a row out of an export: the time of logging that the export states, which nothing proves; else "".
    number : int
        Number among the rows of its kind in this log, from 1; 0 before.
    """

    uid: str
    logged_at: str = ""
    claimed_at: str = ""
    number: int = 0


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A printed sensor, by its name.

    Attributes
    ----------
    specimen : str
        Any name that is bound to a design, or one that stands for a design, in normal form.
    iteration : int or None
        Iteration of the design.
    shape, axes : str
        As in designs; "" if the name has none.
    film_mm : float or None
        Thickness of the film [mm], 0 for none; None if unknown.
    size_mm : float or None
        Size in the name that is no film [mm].
    replicate : int or None
        Number of the copy.
    slicing, place : str
        Slicing as written; place on the plate, as far as the name has it.
    """

    specimen: str
    iteration: int | None = None
    shape: str = ""
    axes: str = ""
    film_mm: float | None = None
    size_mm: float | None = None
    replicate: int | None = None
    slicing: str = ""
    place: str = ""


SPECIMEN_COLUMNS = tuple(field.name for field in fields(Specimen))


@dataclass(frozen=True, kw_only=True)
class _OfSpecimen(Specimen, Entry):
    """A row about a specimen.

    Attributes
    ----------
    written : str
        Name of the specimen as written.
    design_id, design : str
        Identity and name of its design; "" if unknown.
    batch : str
        Name of the batch in which it was printed; "" if unknown.
    remark : str
        Any text.
    source : str
        Origin: ``typed``, ``thesis Table D.1``, name of a file, address of an instrument.
    supersedes : str
        ``uid`` of the row that this one corrects; "" if it corrects none.
    """

    written: str
    design_id: str = ""
    design: str = ""
    batch: str = ""
    remark: str = ""
    source: str = "typed"
    supersedes: str = ""


@dataclass(frozen=True, kw_only=True)
class Reading(_OfSpecimen):
    """Readings of a specimen by meters, measured together.

    Version 1 had the fields up to ``source_row``.

    Attributes
    ----------
    y_words, z_words : str
        DC resistance along an electrode and between the electrodes, as written.
    y_ohm, z_ohm : tuple of float
        Readings [ohm]; infinite for an overload, empty if not measured.
    baked : bool or None
        Whether the specimen had been baked; None if unknown.
    doubts : tuple of str
        Assumptions and doubts about name and readings.
    measured_at : str
        Time of the measurement as written; "" if unknown.
    instrument : str
        Identification of the instrument; "" for typed readings.
    source_row : int or None
        Row of the imported table, from 1 below its header.
    quantity : tuple of str
        Quantity of each AC reading between the electrodes, as in :data:`sensorgen.measure.immittance.QUANTITIES`;
        a quantity stands once for each repeat.
    value, frequency_hz : tuple of float
        Each reading in SI units (phase in rad), and its frequency [Hz].
    uncertainty : tuple of float
        Standard uncertainty of each as stated by who measured, 0 where none is; empty if none is stated at all.
    wires : int or None
        Leads of the meter, 2 or 4; None if unknown.
    temperature_c, humidity_percent : float or None
        Of the air [°C], relative [%].
    photo, file : str
        SHA-256 of a photo of the specimen, and of the instrument's export; "" for none.
    defects : tuple of str
        Visible defects, as in :data:`DEFECTS`.
    """

    y_words: str = ""
    z_words: str = ""
    y_ohm: tuple[float, ...] = ()
    z_ohm: tuple[float, ...] = ()
    baked: bool | None = None
    doubts: tuple[str, ...] = ()
    measured_at: str = ""
    instrument: str = ""
    source_row: int | None = None
    quantity: tuple[str, ...] = ()
    value: tuple[float, ...] = ()
    frequency_hz: tuple[float, ...] = ()
    uncertainty: tuple[float, ...] = ()
    wires: int | None = None
    temperature_c: float | None = None
    humidity_percent: float | None = None
    photo: str = ""
    file: str = ""
    defects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        ac = len(self.quantity)
        if (len(self.value), len(self.frequency_hz)) != (ac, ac) or len(self.uncertainty) not in (0, ac):
            raise BadInput(
                f"a reading of {ac} AC quantities with {len(self.value)} values, {len(self.frequency_hz)} "
                f"frequencies and {len(self.uncertainty)} uncertainties; expected as many of each"
            )
        if not QUANTITIES.issuperset(self.quantity):
            raise BadInput(f"AC quantities {self.quantity!r:.80}; expected some of {', '.join(sorted(QUANTITIES))}")


@dataclass(frozen=True, kw_only=True)
class BenchRun(_OfSpecimen):
    """A recording of the bench.

    Attributes
    ----------
    file, rig_file : str
        SHA-256 of the impedance analyser's file and of the rig's; "" without a rig.
    facts : str
        Summary as JSON, see :mod:`sensorgen.measure.log.facts`.
    """

    file: str
    rig_file: str = ""
    facts: str = "{}"

    @property
    def simulated(self) -> bool:
        """True if ``bench run --simulate`` made it, or its remark begins with that word."""
        return self.remark.partition(";")[0].strip() == "simulated"


@dataclass(frozen=True, kw_only=True)
class Prediction(Entry):
    """Prediction of a design's readings.

    Attributes
    ----------
    design_id, design : str
        Identity and name of the design.
    version : str
        Version of sensorgen.
    data : str
        The prediction as JSON.
    """

    design_id: str
    design: str
    version: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Calibration(_OfSpecimen):
    """Calibration of a specimen.

    Attributes
    ----------
    version : str
        Version of sensorgen.
    data : str
        The calibration as JSON.
    """

    version: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Batch(Entry):
    """A print bed.

    Attributes
    ----------
    batch : str
        Name.
    file : str
        SHA-256 of ``batch.json``.
    """

    batch: str
    file: str


@dataclass(frozen=True, kw_only=True)
class Print(Specimen, Entry):
    """A specimen bound to its design, and to a place on a print bed where that is known.

    Later rows of the specimen get its design and batch. Version 1 had no prints without a batch, and none of another
    name than on the bed.

    Attributes
    ----------
    batch_uid : str
        ``uid`` of the batch; "" if unknown.
    design_id, design : str
        Identity and name of the design.
    printed : str
        Its name on the print bed, if that is another.
    """

    batch_uid: str
    design_id: str
    design: str
    printed: str = ""


@dataclass(frozen=True, kw_only=True)
class RawFile(Entry):
    """A file of an instrument, kept beside the log.

    Attributes
    ----------
    uid : str
        SHA-256.
    name : str
        Original name.
    size : int
        Size [bytes].
    """

    name: str
    size: int


@dataclass(frozen=True, kw_only=True)
class DesignRow(Entry):
    """A design, so that the log explains itself.

    Attributes
    ----------
    uid : str
        Identity of the design.
    design : str
        Its name.
    data : str
        Everything that decides it, as JSON.
    """

    design: str
    data: str


@dataclass(frozen=True, kw_only=True)
class Withdrawal(Entry):
    """Takes a row of any kind out of use, without removing it.

    Attributes
    ----------
    of : str
        Kind of the row, as in :data:`KINDS`.
    supersedes : str
        Its ``uid``.
    reason : str
        Why.
    """

    of: str
    supersedes: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class Anchor(Entry):
    """The head of the log was written to a file outside.

    Attributes
    ----------
    head : str
        Identity of the last record then.
    file : str
        Name of the file.
    """

    head: str
    file: str


@dataclass(frozen=True, kw_only=True)
class Merge(Entry):
    """Records of other machines have joined those of this one."""


@dataclass(frozen=True, kw_only=True)
class Migration(Entry):
    """The log was kept by an older sensorgen: only clocks state the order of its rows.

    Attributes
    ----------
    version : int
        Of the old file.
    rows : int
        Number of its rows, which are the records before this one.
    """

    version: int
    rows: int


KINDS: dict[str, type[Entry]] = {
    "raw_file": RawFile, "batch": Batch, "print": Print, "reading": Reading, "bench_run": BenchRun,
    "prediction": Prediction, "calibration": Calibration, "design": DesignRow, "withdrawal": Withdrawal,
    "anchor": Anchor, "merge": Merge, "migration": Migration,
}  # fmt: skip
VERSIONS = {"reading": 2, "print": 2}  # of the schemas of kinds that have changed; 1 of every other
NAMES = {kind: name for name, kind in KINDS.items()}
ROWS = tuple(kind for kind in KINDS.values() if kind not in (Anchor, Merge, Migration))  # not about the log itself
REFERENCES: dict[type[Entry], dict[str, type[Entry]]] = {
    Batch: {"file": RawFile}, Print: {"batch_uid": Batch}, BenchRun: {"file": RawFile, "rig_file": RawFile},
    Reading: {"photo": RawFile, "file": RawFile},
}  # fmt: skip
