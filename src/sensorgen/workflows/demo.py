"""The whole loop with a virtual laboratory: design, as printed, print, run, calibration, inversion, report."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.core import files as store
from sensorgen.core import yamlfile
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput
from sensorgen.core.parallel import in_parallel

if TYPE_CHECKING:
    from sensorgen.analysis.calibration import CalibrationWork
    from sensorgen.measure.log import Log

LOG = "lab.db"
KNOWN, UNKNOWN = 30, 10  # presses that calibrate, and those that are found again
_PLAN, _EXPERIMENT = (
    yamlfile.text(Path(__file__).parent / "virtual" / name) for name in ("column.txt", "experiment.txt")
)


@dataclass(frozen=True)
class DemoValues:
    """Values found of a specimen, beside the true ones."""

    specimen: Annotated[str, Column("specimen")]
    material: Annotated[str, Column("material")]
    quantity: Annotated[str, Column("quantity")]
    truth: Annotated[float, Column("truth")]
    lower: Annotated[float, Column("from")]
    upper: Annotated[float, Column("to", about="95 % interval")]
    holds: Annotated[str, Column("holds it")]


@dataclass(frozen=True)
class Inverted:
    """Presses that were found again by a specimen's calibration."""

    specimen: Annotated[str, Column("specimen")]
    presses: Annotated[int, Column("presses")]
    force_error_n: Annotated[float, Column("force: rms error", "N", digits=2)]
    force_held: Annotated[int, Column("in its interval", about="of 90 %")]
    position_error_mm: Annotated[float, Column("position: rms error", "mm", digits=2)]
    position_held: Annotated[int, Column("in its interval", about="of 90 %")]


@dataclass(frozen=True)
class Demo:
    """Results of the demonstration.

    Attributes
    ----------
    folder, page : str
        Where its files are, and the report.
    found : tuple of DemoValues
        Material values of each specimen.
    inverted : tuple of Inverted
        Presses of each specimen that were found again.
    """

    folder: str
    page: str
    found: tuple[DemoValues, ...]
    inverted: tuple[Inverted, ...]

    def document(self) -> Iterator[Part]:
        """Values and presses, found beside true."""
        right = sum(one.holds == "yes" for one in self.found)
        yield f"Material values of {len(self.inverted)} virtual prints, by {KNOWN} known presses each"
        yield Table.of("values", "", self.found)
        yield f"{right} of {len(self.found)} intervals hold the truth"
        yield ""
        yield f"{UNKNOWN} further presses of each, found by its calibration"
        yield Table.of("presses", "", self.inverted)
        yield f"files in {self.folder}; report: {self.page}"


def demo(folder: Path, *, count: int = 5, seed: int = 1, step: Callable[[str], None] = lambda _: None) -> Demo:
    """Run the whole loop into a folder of its own.

    Parameters
    ----------
    folder : Path
        New or empty.
    count : int
        Specimens in the column.
    seed : int
        Of the first virtual specimen and its plan; each further one has the next.
    step : callable
        Called with what is done next.

    Raises
    ------
    BadInput
        The folder has files.
    """
    from sensorgen.measure.log import Log, exchange
    from sensorgen.workflows import batch

    store.new_folder(folder)
    plan = folder / "column.yaml"
    store.replace(plan, _PLAN.format(count=count).encode())
    step("print: batch column.yaml")
    printed = batch.make(plan, folder, gcode=False, force=True)
    with Log(folder / LOG, create=True) as log:
        exchange.import_file(log, printed.folder / "batch.json", {})
        names = sorted(printed.record.specimens)
        works = [(folder, name, seed + k) for k, name in enumerate(names)]
        truths: dict[str, Mapping[str, float]] = {}
        step(f"run: {count} prints, {KNOWN} and {UNKNOWN} presses each")
        for k, truth in in_parallel(_pressed, works, min(count, os.cpu_count() or 1)):
            truths[names[k]] = truth
            step(f"run: {len(truths)} of {count} prints")
        return _evaluated(log, folder, {name: truths[name] for name in names}, step)


def _experiment(folder: Path, specimen: str, seed: int, presses: int, what: str) -> Path:
    path = folder / f"{specimen.replace(' ', '-')}-{what}.yaml"
    text = _EXPERIMENT.format(
        specimen=specimen, seed=seed, plan=seed + 100 * (what == "unknown"), presses=presses,
        remark=f"demonstration; {what} presses",
    )  # fmt: skip
    store.replace(path, text.encode())
    return path


def _pressed(folder: Path, specimen: str, seed: int) -> Mapping[str, float]:
    """Both runs of a virtual print; the true values of its materials, by quantity."""
    from sensorgen.measure.lab import sessions
    from sensorgen.measure.log import Log

    truth: Mapping[str, float] = {}
    with Log(folder / LOG) as log:
        for what, presses in (("known", KNOWN), ("unknown", UNKNOWN)):
            experiment = _experiment(folder, specimen, seed, presses, what)
            with sessions.Session(sessions.new(experiment, simulate=True), log, text=False) as session:
                result = session.run()
                if result.end != "done" or session.mechanism is None:
                    raise BadInput(f"{experiment}: {result.end}, {result.reason}; sensorgen bench run --simulate tells")
                truth = session.mechanism.specimen.values()
    return truth


def _evaluated(
    log: "Log", folder: Path, truths: Mapping[str, Mapping[str, float]], step: Callable[[str], None]
) -> Demo:
    """Calibrate by the first run of each specimen, find the presses of the second, and write the report."""
    from sensorgen.analysis import calibration
    from sensorgen.analysis.report import pieces, report

    names = list(truths)
    runs = {name: sorted(run.number for run in log.recordings(specimen=name)) for name in names}
    step("calibrate")
    first = [numbers[0] for numbers in runs.values()]
    works = calibration.calibrate(log, names, calibration.Bench(5e-3), first, step=step)
    log.add(calibration.rows(log, [one.calibration for one in works]))
    step("invert")
    inverted = tuple(_inverted(log, one, runs[one.calibration.specimen][1]) for one in works)
    step("report")
    page = folder / "report.html"
    with store.replacing(page) as target:
        target.writelines(piece.encode() for piece in pieces(report(log, None, specimens=names), "html"))
    values = tuple(each for one in works for each in _found(one, truths[one.calibration.specimen]))
    return Demo(str(folder), str(page), values, inverted)


def _found(work: "CalibrationWork", truth: Mapping[str, float]) -> Iterator[DemoValues]:
    """Values of a specimen's materials beside the true ones."""
    for value in work.calibration.materials():
        true = truth[value.quantity]
        holds = "yes" if value.lower <= true <= value.upper else "no"
        yield DemoValues(
            work.calibration.specimen, value.material, value.quantity, true, value.lower, value.upper, holds
        )


def _inverted(log: "Log", work: "CalibrationWork", number: int) -> Inverted:
    """Presses of a recording by a calibration that did not know them."""
    from sensorgen.analysis.calibration.readings import known_presses
    from sensorgen.prediction.calibration.calibration import coverage_of

    name = work.calibration.specimen
    rows = [run for run in log.recordings(specimen=name) if run.number == number]
    data, _, _ = known_presses(log, name, rows)
    of = coverage_of(work.calibration.inverter().batch(data.ratio), data.presses)
    return Inverted(name, of.presses, of.force_error_n, of.force, 1e3 * of.position_error_m, of.position)
