"""The whole chain of an array, virtual: outline, design, check, print, calibration, a step, and a report; twice."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import yaml

from sensorgen.core import files as store
from sensorgen.core import yamlfile
from sensorgen.core.arrays import Real
from sensorgen.core.document import Column, Part, Table

if TYPE_CHECKING:
    from sensorgen.design.design import Design
    from sensorgen.measure.virtual.array import VirtualArray, WalkedStep
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.model import ArrayModel
    from sensorgen.prediction.array.readout import ArrayReadout

PRESSES, LEVELS_KPA = 40, 400.0  # known presses, and the bladder's largest pressure
_FINE = 5  # points along a side of a crossing's square, of the true load
_STEP_DAY = 4.0  # two days after the last recording of the calibration
_REST = 100  # frames without load at the begin of each recording
_SCATTER, _PLAY, _CREEP, _DRIFT = 0.05, 0.02, 0.02, -0.002  # of the virtual print
_DESIGN: Mapping[str, Any] = yaml.safe_load(yamlfile.text(Path(__file__).parent / "virtual" / "insole.yaml"))
# What may be changed: parameters of the array, of its cell, and why
_Change = tuple[dict[str, Any], dict[str, Any], str]
_CHANGES: tuple[_Change, ...] = (
    ({"between": "air", "isolation_mm": 0.0}, {}, "air between the columns, no cover: cells carry all of the load"),
    ({}, {"space_mm": 0.7}, "a sparser dielectric: cells are softer"),
)


@dataclass(frozen=True)
class InsoleRun:
    """One design, printed, calibrated and walked on."""

    design: Annotated[str, Column("design")]
    verdict: Annotated[str, Column("check")]
    determined: Annotated[int, Column("crossings determined")]
    dead: Annotated[int, Column("dead")]
    before_kpa: Annotated[float, Column("error before calibration", "kPa", digits=3)]
    error_kpa: Annotated[float, Column("error", "kPa", about="rms of all determined crossings and frames", digits=3)]
    noise_kpa: Annotated[float, Column("noise predicted", "kPa", digits=3)]
    coverage: Annotated[float, Column("in the interval", about="of 90 %", digits=3)]
    force: Annotated[float, Column("force error", "%", about="rms over its largest, dead crossings filled", digits=2)]
    lost: Annotated[float, Column("force on dead ones", "%", digits=2)]
    centre_mm: Annotated[
        float,
        Column(
            "centre error",
            "mm",
            about="rms of frames above a tenth of the largest force, dead crossings filled",
            digits=2,
        ),
    ]


@dataclass(frozen=True)
class InsoleDemo:
    """Results of the chain.

    Attributes
    ----------
    folder, page : str
        Where the files are, and the page with the maps.
    runs : tuple of InsoleRun
        The first design, and that which its report changed.
    advice : str
        The change, and why.
    """

    folder: str
    page: str
    runs: tuple[InsoleRun, ...]
    advice: str

    def document(self) -> Iterator[Part]:
        """Both runs, and what was changed between them."""
        yield f"Two faults each; calibrated by a bladder to {LEVELS_KPA:g} kPa on two days and {PRESSES} presses"
        yield Table.of("runs", "one step of 60 frames, two days later", self.runs)
        yield f"changed: {self.advice}"
        yield f"files in {self.folder}; maps: {self.page}"


def demo(folder: Path, *, seed: int = 1, step: Callable[[str], None] = lambda _: None) -> InsoleDemo:
    """Run the chain into a folder of its own.

    Parameters
    ----------
    folder : Path
        New or empty.
    seed : int
        Of print, presses and noise.
    step : callable
        Called with what is done next.

    Raises
    ------
    BadInput
        The folder has files.
    """
    from sensorgen.analysis.plots import array as plots
    from sensorgen.analysis.plots import pages

    store.new_folder(folder)
    first, found, true = _run(folder, "insole", _DESIGN, seed, step)
    step("change")
    change = min(_CHANGES, key=_noise_after)
    second, again, true_again = _run(folder, "insole-changed", _with(change), seed, step)
    advice = f"{change[2]}; noise of {first.noise_kpa:.2g} kPa was predicted, the error was {first.error_kpa:.2g} kPa"
    runs, page = (first, second), folder / "maps.html"
    shown = InsoleDemo(str(folder), str(page), runs, advice)
    figures = tuple(
        draw(maps, load.pressure_kpa, f"{kind}-{k}", f"{run.design}: {kind}")
        for k, (run, maps, load) in enumerate(zip(runs, (found, again), (true, true_again), strict=True))
        for kind, draw in (("heaviest frame", plots.figure), ("course", plots.course))
    )  # fmt: skip
    words = [
        f"{run.design}: {run.error_kpa:.3g} kPa, {100 * run.coverage:.0f} % in their intervals of 90 %, force "
        f"{run.force:.2g} %, centre {run.centre_mm:.2g} mm; {run.dead} dead crossings are left white"
        for run in runs
    ]
    sections = [pages.PageSection(figures=figures)]
    store.replace(page, pages.page("A step on two virtual insoles", [*words, shown.advice], sections).encode())
    return shown


def _with(change: _Change) -> dict[str, Any]:
    """The first design with a change."""
    cell = {**_DESIGN["cell"], "parameters": {**_DESIGN["cell"]["parameters"], **change[1]}}
    return {**_DESIGN, "parameters": {**_DESIGN["parameters"], **change[0]}, "cell": cell}


def _noise_after(change: _Change) -> float:
    """Standard error by noise after a change, as predicted [kPa]."""
    from sensorgen.design.design import make
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import study

    resolution = study(array_model(make(_with(change))), ArrayReadout())
    return float(np.median(resolution.sigma_kpa[resolution.determined]))


def designed(k: int) -> dict[str, Any]:
    """Design file of the first insole, 0, or of that with air between its columns, 1."""
    return _with(_CHANGES[0]) if k else dict(_DESIGN)


def _run(
    folder: Path, name: str, data: Mapping[str, Any], seed: int, step: Callable[[str], None]
) -> "tuple[InsoleRun, PressureMaps, WalkedStep]":  # fmt: skip
    """One design through the whole chain."""
    from sensorgen.checks.review import review
    from sensorgen.design.design import load

    path = folder / f"{name}.yaml"
    store.replace(path, yaml.safe_dump(dict(data), sort_keys=False).encode())
    design = load(path)
    step(f"{name}: check")
    verdict = review(design).verdict
    step(f"{name}: print, calibration, step")
    return walk(folder, design, name, seed, verdict)


def walk(
    folder: Path, design: "Design", name: str, seed: int, verdict: str = ""
) -> "tuple[InsoleRun, PressureMaps, WalkedStep]":  # fmt: skip
    """Print a design virtually, calibrate it, and walk a step on it.

    Parameters
    ----------
    folder : Path
        Recordings, calibration and maps are written there.
    design : Design
        An array.
    name : str
        Of the files.
    seed : int
        Of print, faults, presses and noise.
    verdict : str
        Of the design's check, for the result.

    Returns
    -------
    InsoleRun, PressureMaps, WalkedStep
        Figures, maps by the calibration, and the true load.
    """
    from sensorgen.measure.array_frames import of_frames, read
    from sensorgen.measure.virtual.array import printed, walked
    from sensorgen.prediction.array.frames import inverted
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.sessions import calibrated

    model, readout = array_model(design), ArrayReadout()
    draw = np.random.default_rng(seed)
    print_ = printed(
        model, seed, _SCATTER, faults(model, draw), stiffness=float(np.exp(0.25 * draw.normal())), own_law=True,
        play=_PLAY, creep=_CREEP, drift=_DRIFT,
    )  # fmt: skip
    recordings = [folder / f"{name}-{what}.npz" for what in ("bladder", "presses", "bladder-again")]
    for day, target in enumerate(recordings):
        store.replace(target, _recorded(print_, model, readout, draw, day))
    true = walked(model.layout, _FINE)
    target = folder / f"{name}-step.npz"
    store.replace(target, _stepped(print_, true, readout, draw))
    known = calibrated(of_frames(recordings, model))
    store.replace(folder / f"{name}-calibration.npz", known.npz())
    frames = read(target, (model.here.shape[0], model.here.shape[1]), None)
    by_design, found = (
        inverted(model, readout, frames.siemens, frames.rest, frames.time_s, calibration=calibration, day=frames.day)
        for calibration in (None, known)
    )
    store.replace(folder / f"{name}-maps.npz", found.npz())
    return _compared(name, verdict, by_design, found, true), found, true


def faults(model: "ArrayModel", draw: np.random.Generator) -> list[str]:
    """A row broken near its far end, and a shorted crossing, of another row."""
    rows = draw.permutation([int(track.name[1:]) for track in model.layout.rows])
    broken = next(track for track in model.layout.rows if track.name == f"r{rows[0]}")
    columns = np.flatnonzero(model.here[rows[1] - 1])
    return [f"{broken.name}:{max(1, broken.last - 2)}", f"r{rows[1]}c{draw.choice(columns) + 1}"]


def _recorded(
    print_: "VirtualArray", model: "ArrayModel", readout: "ArrayReadout", draw: np.random.Generator, day: int
) -> bytes:  # fmt: skip
    """A bladder that rises and falls in steps, slowly and fast, or on the second day presses on one crossing each.

    Slow cycles alone would not tell a lag of unloading from creep, which a step has no time for.
    """
    from sensorgen.measure.virtual.array import packed

    shape = model.here.shape
    if day == 1:
        elements = draw.choice(np.flatnonzero(model.here), PRESSES)
        forces = draw.uniform(5, 35, PRESSES)
        load = np.zeros((2 * PRESSES, *shape))
        load.reshape(2 * PRESSES, -1)[1::2][np.arange(PRESSES), elements] = forces / (model.pitch_area_m2 * 1e3)
        reference = {"element": np.stack([0 * elements, elements + 1], 1).ravel(),
                     "force_n": np.stack([0 * forces, forces], 1).ravel()}  # fmt: skip
    else:
        rising = np.append([0.0, 10.0, 20.0], np.arange(40.0, LEVELS_KPA + 1, 40.0))
        levels = np.tile(np.repeat(np.append(rising, rising[-2::-1]), 3), 2)
        load, reference = levels[:, None, None] * model.here, {"pressure_kpa": levels}
    rest = np.arange(_REST + len(load)) < _REST
    load = np.concatenate([np.zeros((_REST, *shape)), load])
    reference = {key: np.concatenate([np.zeros(_REST), values]) for key, values in reference.items()}
    fast = (day != 1) & (np.arange(len(load)) >= (len(load) + _REST) // 2)
    time_s = np.cumsum(np.where(rest, 0.01, np.where(fast, 0.05, 2.0)))
    siemens = print_.frames(load, time_s, readout, draw, float(day))
    return packed(siemens=siemens, time_s=time_s, rest=rest, day=day, frequency_hz=readout.frequency_hz[0], **reference)


def _stepped(print_: "VirtualArray", true: "WalkedStep", readout: "ArrayReadout", draw: np.random.Generator) -> bytes:
    from sensorgen.measure.virtual.array import RATE_HZ, packed

    load = np.concatenate([np.zeros((_REST, *true.pressure_kpa.shape[1:])), true.pressure_kpa])
    time_s = np.arange(len(load)) / RATE_HZ
    return packed(
        siemens=print_.frames(load, time_s, readout, draw, _STEP_DAY), pressure_kpa=load, time_s=time_s,
        rest=np.arange(len(load)) < _REST, day=_STEP_DAY, frequency_hz=readout.frequency_hz[0],
    )  # fmt: skip


def _compared(name: str, verdict: str, before: "PressureMaps", found: "PressureMaps", true: "WalkedStep") -> InsoleRun:
    """Maps against the true load."""
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import study

    kpa, known = true.pressure_kpa, np.isfinite(found.pressure_kpa)
    low, high = found.interval_kpa
    newtons = kpa * 1e3 * found.model.pitch_area_m2
    force, lost = newtons.sum((1, 2)), newtons[:, ~known.any(0)].sum()
    of_noise = study(found.model, ArrayReadout(), float(np.sqrt(np.mean(kpa[known] ** 2))))
    centre = np.stack(found.centre_mm[:2], 1) - true.centre_mm
    heavy = force > 0.1 * force.max()
    return InsoleRun(
        name, verdict, int(known.any(0).sum()), int((found.model.here & ~known.any(0)).sum()),
        _rms(before.pressure_kpa - kpa), _rms(found.pressure_kpa - kpa),
        float(np.median(of_noise.sigma_kpa[of_noise.determined])), float(((low < kpa) & (kpa < high))[known].mean()),
        100 * _rms(found.force_n[0] - force) / float(force.max()), 100 * float(lost / newtons.sum()),
        _rms(np.hypot(*centre[heavy].T)),
    )  # fmt: skip


def _rms(values: Real) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))
