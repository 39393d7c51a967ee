"""Options that several commands have: each a type, to annotate a parameter with, or a record of several."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click
from click.core import ParameterSource

from sensorgen.cli import render
from sensorgen.cli.commands import NumberRange, pairs
from sensorgen.core import units
from sensorgen.core.errors import BadInput
from sensorgen.core.options import Option

if TYPE_CHECKING:
    from sensorgen.analysis.calibration import Bench
    from sensorgen.design.body import BodyOf
    from sensorgen.design.design import Design
    from sensorgen.measure.log import Log
    from sensorgen.workflows.trial import Advice, Change

Strict = Annotated[bool, Option("Treat warnings as errors.")]
Explain = Annotated[bool, Option("Print which models were used, and their cost and error.")]
NoCache = Annotated[bool, Option("Solve anew, and keep nothing.")]
DryRun = Annotated[bool, Option("Write no file.")]
Out = Annotated[Path, Option(flags=("--out", "-o"), kind="folder", metavar="DIR")]
TimeLimit = Annotated[float, Option("End the slicer after this time.", ("--time-limit",), "seconds", metavar="SECONDS")]
DesignTip = Annotated[
    dict[str, Any] | None,
    Option(
        "What presses: its width, then stiff, even or a block's material with its height, as 5mm,stiff or "
        "ninjaflex,10mm; the design's if not given.", kind="tip",
    ),
]  # fmt: skip
Law = Annotated[
    str,
    Option(
        "Compression law of a plate; the best of the cell if not given.", ("--compression",), ("unconfined", "bonded")
    ),
]
Sides = Annotated[
    str,
    Option(
        "Sides of the sensor: bonded, its solids stick to electrodes and base, and a plate bulges at its edges; free, "
        "it widens as it likes (B.49); symmetric, one of unlimited cells.", kind=("bonded", "free", "symmetric"),
    ),
]  # fmt: skip
Force = Annotated[float, Option("Force of the press.", typed="6N")]
Readout = Annotated[
    str,
    Option(
        "Of an array: guarded, a row is driven and all other tracks are at 0 V; or two-terminal, a meter between two "
        "and the rest open.", kind=("guarded", "two-terminal"),
    ),
]  # fmt: skip
InputResistance = Annotated[
    float, Option("Of an array, guarded: input resistance of a terminal.", kind="ratio", typed="50", metavar="OHM")
]
Jobs = Annotated[
    int | None, Option("Processes at once; one for each core if not given.", kind=click.IntRange(1, 64), metavar="N")
]
Cluster = Annotated[
    str,
    Option(
        "Work on a Dask cluster: its scheduler's address, as tls://10.0.0.5:8786, or its scheduler file.",
        metavar="ADDRESS",
    ),
]


@dataclass(frozen=True)
class ArrayFrames:
    """Frames of an array, and how they are read.

    Attributes
    ----------
    frequency_hz
        Of an array's frames, where their file has none.
    scatter
        Of an array: gain from cell to cell, 5 % before a calibration.
    calibration : FILE.npz
        Of an array: by 'sensorgen calibrate'.
    plot : DIR
        Of an array: write its heaviest map there.
    cells
        Of an array: pressures that cells carry under the cover; else on it, its spread of the load undone.
    """

    readout: Readout = "guarded"
    input_ohm: InputResistance = 50.0
    frequency_hz: float | None = None
    scatter: Annotated[float, Option(kind="share", typed="5%")] = 0.05
    calibration: Path | None = None
    plot: Path | None = None
    cells: bool = False


@dataclass(frozen=True)
class Sweeping:
    """Values of one setting, and where they are worked on.

    Attributes
    ----------
    sweep : KEY=VALUES
        Answer for each value of one setting: dielectric_mm=0.05:0.2:0.05, or eps_x60=3,4,5.
    """

    sweep: str = ""
    jobs: Jobs = None
    cluster: Cluster = ""

    def designs(self, design: "Design") -> "tuple[str, list[tuple[float | str, Design]]]":
        """The setting, and the design for each of its values.

        Raises
        ------
        SensorgenError
            A key or values that mean nothing, or a value that this design cannot have: before any work.
        """
        from sensorgen.design.settings import varied

        ((key, typed),) = pairs((self.sweep,), "--sweep")
        parameter = {field.name: field for field in fields(design.form.Params)}.get(key)
        if parameter is not None and "choices" in parameter.metadata:
            values: list[Any] = typed.split(",")
        else:
            values = list(units.values(typed, units.NUMBER if parameter is None else units.LENGTH_MM))
        return key, [(value, one) for (value,), one in varied(design, {key: values})]

    def over(self, design: "Design", body_of: "BodyOf", solve: Any, question: Any) -> Any:
        """Answers of a solver for each value, with a progress bar."""
        key, designs = self.designs(design)
        points = [(value, body_of(one)) for value, one in designs]
        with render.bar(len(points)) as done:
            return solve(key, points, question, render.at_once(self.jobs), done, self.cluster)


@dataclass(frozen=True)
class BenchTip:
    """Tip and force offset of the bench that pressed.

    Attributes
    ----------
    force_offset : N+-N
        Force above what the rig says, as its piston's weight: 0.9+-0.1 for the thesis's.
    """

    tip: DesignTip = None
    force_offset: str = "0+-0.1"

    def bench(self) -> "Bench":
        """The bench."""
        from sensorgen.analysis.calibration import Bench

        mean, mark, spread = self.force_offset.replace(" ", "").replace("±", "+-").partition("+-")
        if not mark:
            raise BadInput(
                f"--force-offset {self.force_offset!r:.40}: expected mean and standard deviation, as 0.9+-0.1 (N)"
            )
        try:
            block = dict(self.tip or {})
            width = block.pop("width_mm", None)
            offset = units.force_n(mean), units.force_n(spread)
            return Bench(None if width is None else width * units.M_PER_MM, offset, block)
        except BadInput as error:
            raise error.within("--force-offset") from None


@dataclass(frozen=True)
class Advising:
    """Changes of a design that are tried, and written into its file.

    Attributes
    ----------
    budget : SECONDS
        Processor time for prediction and for changes to try; 0 tries none.
    apply : [K]
        Write the first, or the K-th, of these changes into the design's file.
    """

    budget: Annotated[float, Option(kind=NumberRange(0, 3600), more={"envvar": "SENSORGEN_BUDGET"})] = 60.0
    apply: Annotated[int | None, Option(kind=click.IntRange(1, 9), more={"is_flag": False, "flag_value": 1})] = None

    def write(self, design: "Design", advice: "Advice | None") -> None:
        """Write the change that ``--apply`` asks for, and report it.

        Raises
        ------
        BadInput
            There is no such change, or no file to write it into.
        """
        if self.apply is None:
            return
        tried = advice.tried if advice else ()
        if self.apply > len(tried):
            above = f"expected the number of a change above, at most {len(tried)}"
            raise BadInput(f"--apply {self.apply}: {above if tried else 'no change that was tried helps'}")
        change = tried[self.apply - 1]
        word = click.get_current_context().info_name or ""
        if not (word.endswith((".yaml", ".yml")) or "/" in word):
            settings = " ".join(_setting(one) for one in change.changes)
            raise BadInput(f"--apply: {word} is no design file; use these options: {settings}")
        from sensorgen.workflows.trial import apply

        apply(Path(word), design, change)
        changes = ", ".join(one.words() for one in change.changes)
        render.say(f"{word} is changed: {changes}; all above is of the design before: run the command again", err=True)


def _setting(change: "Change") -> str:
    """A change as an option of the command line."""
    after = f"{change.after:g}" if isinstance(change.after, float) else change.after
    return f"--set {change.key}={after}"


def typed(name: str) -> bool:
    """Test whether an option was given on the command line, by the name of its parameter."""
    return click.get_current_context().get_parameter_source(name) is ParameterSource.COMMANDLINE


def refuse_typed(names: Collection[str], why: str) -> None:
    """Raise BadInput for the first option that was given, by the names of their parameters."""
    for option in click.get_current_context().command.params:
        if option.name in names and typed(option.name):
            raise BadInput(f"{option.opts[0]} {why}")


def refuse_explain(given: bool, *, many: bool) -> None:
    """Raise BadInput for ``--explain`` with a form for programs, or of many designs."""
    if given and (many or render.form() in ("json", "csv")):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")


def refuse_input(readout: str) -> None:
    """Refuse ``--input`` of a readout by two terminals."""
    if readout != "guarded" and typed("input_ohm"):
        raise BadInput("--input is of the guarded readout; expected no --input with --readout two-terminal")


@dataclass(frozen=True)
class LogFile:
    """The log that ``--log`` names, or the usual one.

    Attributes
    ----------
    file, --log : FILE
        The log; what SENSORGEN_LOG says, or the one of this user, if not given.
    """

    file: Path | None = None

    def opened(self, *, create: bool = False) -> "Log":
        """Open the log."""
        from sensorgen.measure.log import Log, place

        return Log(self.file or place(), create=create)

    def of_command(self, *, create: bool = False) -> "Log":
        """The log, open until the command has ended."""
        log: Log = click.get_current_context().with_resource(self.opened(create=create))
        return log

    @contextmanager
    def existing(self) -> Iterator["Log | None"]:
        """The log, or None where ``--log`` names none and there is none yet."""
        from sensorgen.measure.log import place

        if self.file is None and not place().exists():
            yield None
            return
        with self.opened() as log:
            yield log


@dataclass(frozen=True)
class ColumnNames:
    """Names of columns in an instrument's CSV, and in a rig's log.

    Attributes
    ----------
    columns, --column : OURS=THEIRS
        Column of the readings' file, if it is CSV and calls it otherwise: time_s, stamp_s, re_ohm_1.1kHz ...
    rig_columns, --rig-column : OURS=THEIRS
        Column of the rig's log: time_s, set_force_n, set_position_mm, force_n, error.
    """

    columns: tuple[str, ...] = ()  # fmt: skip
    rig_columns: tuple[str, ...] = ()  # fmt: skip

    def of_readings(self) -> dict[str, str]:
        """Names in the readings' file to ours."""
        return {theirs: ours for ours, theirs in pairs(self.columns, "--column")}

    def of_rig(self) -> dict[str, str]:
        """Names in the rig's log to ours."""
        return {theirs: ours for ours, theirs in pairs(self.rig_columns, "--rig-column")}
