"""The public functions, for notebooks and programs: ``import sensorgen as sg``."""

from collections.abc import Iterable, Mapping, Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.analysis import calibration as calibrations
from sensorgen.analysis.calibration import Bench
from sensorgen.analysis.comparison import Comparison, of_iteration
from sensorgen.analysis.fit import fit as fit_values
from sensorgen.analysis.fit.estimates import Fit
from sensorgen.checks.review import Review
from sensorgen.core import files
from sensorgen.core.arrays import Complex
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design import design as designs
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.settings import varied
from sensorgen.measure.log import Log, Reading
from sensorgen.prediction import bodies, compression, evaluate
from sensorgen.prediction import capacitance_answer as at_rest
from sensorgen.prediction.calibration import inversion
from sensorgen.prediction.calibration.calibration import Calibration
from sensorgen.prediction.calibration.inversion import InvertedPresses
from sensorgen.prediction.calibration.rest import Rest
from sensorgen.prediction.inverse.estimator import Estimates, Estimator
from sensorgen.prediction.loaded import Loaded, PredictedPoint, loaded
from sensorgen.prediction.loaded import sweep as predicted_sweep
from sensorgen.prediction.query import DEFAULT, NOISE, TONES_HZ, Query, Tip
from sensorgen.prediction.results import Prediction
from sensorgen.prediction.sensor_model import sensor_model
from sensorgen.prediction.slices import reviewed
from sensorgen.prediction.sweep import Sweep
from sensorgen.solvers.contact.boundary import BoundaryConditions
from sensorgen.workflows import build as builds
from sensorgen.workflows import display as display
from sensorgen.workflows import slice as slicing
from sensorgen.workflows.build import Built
from sensorgen.workflows.slice import SlicedFile

if TYPE_CHECKING:
    from sensorgen.analysis.report import Report
    from sensorgen.workflows.batch import Batch
    from sensorgen.workflows.characterise import Planned
    from sensorgen.workflows.optimise.result import Optimised


_Kind = TypeVar("_Kind")


def load(path: str | Path) -> Design:
    r"""Read a design file.

    Parameters
    ----------
    path : str or Path
        YAML.

    Raises
    ------
    BadInput
        Not readable, not YAML, or not a design; the message names file and key.

    Examples
    --------
    >>> from pathlib import Path
    >>> file = Path("plate.yaml")
    >>> _ = file.write_text("shape: reference\nparameters: {dielectric_mm: 0.5}\n")
    >>> load(file).params.dielectric_mm
    0.5
    >>> file.unlink()
    """
    return designs.load(Path(path))


@overload
def check(design: Design) -> Review: ...
@overload
def check(design: Sequence[Design]) -> list[Review]: ...
def check(design: Design | Sequence[Design]) -> Review | list[Review]:
    """Check a design against nozzle, layers and bed.

    Parameters
    ----------
    design : Design, or sequence of Design
        What to check.

    Returns
    -------
    Review, or list of Review
        Its ``findings``, each with place, limit and advice.

    Examples
    --------
    >>> check(Design(shape="reference")).counts()["error"]
    0
    """
    return reviewed(_named(design)) if isinstance(design, Design) else [check(one) for one in _several(design)]


def predict(
    what: Design | Body | Sequence[Design | Body], *, force_n: ArrayLike = (), position_mm: ArrayLike = (),
    frequency_hz: ArrayLike = TONES_HZ, accuracy: float | None = None, law: str = "", tip: Tip | None = None,
    noise: float = NOISE,
) -> Prediction | Loaded | list[Loaded] | Sweep[PredictedPoint]:  # fmt: skip
    """Prediction of a sensor: of the print, with the drawing beside it.

    Parameters
    ----------
    what : Design or Body, or a sequence of these
        A design is printed: by the G-code in ``out/NAME`` where there is one, else as slicers should print it.
    force_n, position_mm : float or sequence of float
        Rising [N], [mm]; if either is given, impedance over both comes with each prediction.
    frequency_hz : float or sequence of float
        Frequencies [Hz].
    accuracy : float, optional
        Of abs(Z), relative [-]; the default of all commands if not given.
    law : str
        Law of compression: "unconfined", "bonded", "infill" or "solved"; the best within seconds if not given.
    tip : Tip, optional
        What presses; the design's own if not given.
    noise : float
        Standard deviation of Re Z and of Im Z of a reading, relative to abs(Z) [-].

    Returns
    -------
    Prediction or Loaded, or Sweep or list of Loaded
        Each quantity with its range, divided into model, print and material; of a sequence a row or a Loaded for each.

    Examples
    --------
    >>> p = predict(Design(shape="reference"))
    >>> p.status, round(p.drawn.resistance["top"].value)  # ohm
    ('predicted', 1400)
    """
    tones_hz, accuracy = _numbers("frequency_hz", frequency_hz), _above_0("accuracy", accuracy)
    query = Query(tones_hz, law=law, tip=_of_type("tip", tip, Tip) if tip else None, accuracy=accuracy, noise=noise)
    forces, positions = _numbers("force_n", force_n), _numbers("position_mm", position_mm)
    if not isinstance(what, Design | Body):
        if forces or positions:
            return [loaded(body, query, forces, positions) for _, body in _points(what)]
        return predicted_sweep("design", _points(what), query, 1, _silent)
    if not forces and not positions:
        return evaluate.evaluate(_body(what), query)
    return loaded(_body(what), query, forces, positions)


def sweep(
    design: Design, *, unloaded: bool = False, jobs: int = 1, query: Query = DEFAULT, **values: Sequence[float | str]
) -> Sweep[PredictedPoint] | Sweep[at_rest.CellCapacitance]:  # fmt: skip
    """Predictions of a design along the values of settings, in all their combinations.

    Parameters
    ----------
    design : Design
        That is varied.
    unloaded : bool
        Bounds of the unit cell as of :func:`cell` alone: seconds, where pressing the cells takes minutes.
    jobs : int
        Processes at once.
    query : Query
        What is asked of each.
    **values : sequence
        Values by key: a parameter of the shape as ``dielectric_mm``, a material's value as ``eps_x60``.

    Examples
    --------
    >>> found = sweep(Design(shape="reference"), electrode_mm=[0.3, 0.4], dielectric_mm=[0.4, 0.6])
    >>> [round(point.prediction.drawn.capacitance.value * 1e12) for point in found.results]  # pF
    [104, 69, 104, 69]
    """
    wrong = [f"{key}={some!r:.60}" for key, some in values.items() if np.ndim(some) != 1 or not len(some)]
    if wrong or not values:
        given = (*wrong, "sweep() without values")[0]
        raise BadInput(f"{given}; expected values of a setting, as dielectric_mm=[0.2, 0.3]")
    if not isinstance(jobs, int | np.integer) or jobs < 1:
        raise BadInput(f"jobs={jobs}; expected 1 or more processes")
    _of_type("query", query, Query)
    points = [(chosen, _body(one)) for chosen, one in varied(_named(design), values)]
    if unloaded:
        return at_rest.sweep(tuple(values), points, at_rest.CapacitanceQuestion(query.accuracy), jobs, _silent)
    return predicted_sweep(tuple(values), points, query, jobs, _silent)


def cell(
    what: Design | Body | Sequence[Design | Body], *, accuracy: float | None = None, frequency_hz: float | None = None
) -> at_rest.CellCapacitance | Sweep[at_rest.CellCapacitance]:
    """Certified bounds of the capacitance of the unit cell at rest.

    Parameters
    ----------
    what : Design or Body, or a sequence of these
        As of :func:`predict`.
    accuracy : float, optional
        Relative width of the bounds [-].
    frequency_hz : float, optional
        Of the field, where a dielectric leaks [Hz].

    Examples
    --------
    >>> found = cell(as_printed(Design(shape="reference"), walls="arachne"))
    >>> round(found.lower_f_per_m2 * 1e9, 2)  # nF/m2
    69.06
    """
    frequency_hz = _above_0("frequency_hz", frequency_hz)
    asked = at_rest.CapacitanceQuestion(_above_0("accuracy", accuracy), frequency_hz=frequency_hz)
    if not isinstance(what, Design | Body):
        return at_rest.sweep("design", _points(what), asked, 1, _silent)
    return at_rest.answer(_body(what), asked)


def compress(
    what: Design | Body | Sequence[Design | Body], pressure_kpa: ArrayLike, *, accuracy: float | None = None
) -> compression.CompressionResult | Sweep[compression.CompressionResult]:
    """Displacement and capacitance of a unit cell under pressure.

    Parameters
    ----------
    what : Design or Body, or a sequence of these
        As of :func:`predict`.
    pressure_kpa : float or sequence of float
        Rising [kPa].
    accuracy : float, optional
        Largest relative error of the rise of the capacitance at any pressure [-].

    Raises
    ------
    SensorgenError
        A pressure that the models cannot take, or a material value that no source gives.

    Examples
    --------
    >>> found = compress(as_printed(Design(shape="reference"), walls="arachne"), [10.0])
    >>> found.stress_kpa
    (0.0, 10.0)
    """
    wanted, pressures = _above_0("accuracy", accuracy) or inf, _numbers("pressure_kpa", pressure_kpa)
    if not any(pressures):
        raise BadInput(f"pressure_kpa={pressure_kpa!r:.60}; expected a pressure above 0")
    pressures = compression.stresses_kpa(pressures)
    asked = compression.PressQuestion(pressures, BoundaryConditions(), accuracy=wanted)
    if not isinstance(what, Design | Body):
        return compression.sweep("design", _points(what), asked, 1, _silent)
    return compression.answer(_body(what), asked)


def as_printed(design: Design, gcode: str | Path | None = None, *, walls: str = "") -> Body:
    """The body that is printed of a design.

    Parameters
    ----------
    design : Design
        What is printed.
    gcode : str or Path, optional
        A file that somebody has sliced from this design, anywhere on the bed; estimated if not given.
    walls : str
        For an estimate: "arachne", "classic", "cura" or "cura-gaps" alone; all of them if not given.

    Raises
    ------
    BadInput
        The file is no G-code, prints no piece of the design's size with its tools, or one that is higher.

    Examples
    --------
    >>> as_printed(Design(shape="reference"), walls="classic").kind
    'estimated'
    """
    design = _named(design)
    if gcode is None:
        return bodies.estimated(design, walls)
    return bodies.from_gcode(design, gcode)


def build(design: Design, out: str | Path = "out", *, cad: bool = True, force: bool = False) -> Built:
    """Write all files of a design into ``out/NAME``.

    Parameters and errors as of :func:`sensorgen.workflows.build.build`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     build(Design(shape="reference"), folder, cad=False).verdict
    'PRINT'
    """
    return builds.build(_named(design), Path(out), cad=cad, force=force)


def slice_design(design: Design, out: str | Path = "out", *, slicer: str = "prusa", force: bool = False) -> SlicedFile:
    """Write printer-ready G-code into ``out/NAME``, by a real slicer.

    Parameters and errors as of :func:`sensorgen.workflows.slice.slice_design`.

    Examples
    --------
    >>> slice_design(Design(shape="reference"), slicer="slic3r")
    Traceback (most recent call last):
    sensorgen.core.errors.UnknownName: unknown slicer 'slic3r'. Known: cura, prusa
    """
    return slicing.slice_design(_named(design), Path(out), slicer, force=force)


def export_design(design: Design, path: str | Path, gcode: str | Path | None = None) -> list[Path]:
    """Write the body as printed for other programs: ``.3mf``, ``.step``, ``.stl`` or ``.vtu``.

    Parameters of the design and its G-code as of :func:`as_printed`, errors as of
    :func:`sensorgen.workflows.export.export`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in export_design(Design(shape="reference"), Path(folder) / "plate.3mf")]
    ['plate.3mf']
    """
    from sensorgen.workflows import export as exports

    design = _named(design)
    printed = reviewed(design).printed(design) if gcode is None else bodies.registered(design, Path(gcode))
    return exports.export(printed, Path(path))


def show(design: Design, path: str | Path = "") -> Path:
    """Write a design as one offline page, as ``sensorgen show`` does, and give its name: ``NAME.html`` if not given."""
    from sensorgen.workflows import decision

    design = _named(design)
    file = Path(path or f"{design.name}.html")
    files.replace(file, decision.page_of(design).encode())
    return file


def batch(plan: str | Path, out: str | Path = "out", *, gcode: bool = True, force: bool = False) -> "Batch":
    """Write all files of a plan's plate into ``out/NAME``; as :func:`sensorgen.workflows.batch.make`."""
    from sensorgen.workflows.batch import make

    return make(Path(plan), Path(out), gcode=gcode, force=force)


def characterise(
    printer: str, conductor: str, dielectric: str, out: str | Path = "out", *, quality: str = "fine",
    tools: Mapping[str, int] | None = None, **limits: Any,
) -> "Planned":  # fmt: skip
    """Choose coupons that measure two materials on a printer, and write the files of their plate.

    As :func:`sensorgen.workflows.characterise.plan`, which takes ``name``, ``count`` and ``hours``; ``tools`` are
    those of materials that the printer's file does not name. ``sensorgen characterise`` reads the filled form.
    """
    from sensorgen.workflows.characterise import Study, plan

    return plan(Study.of(printer, (conductor, dielectric), quality=quality, tools=tools), Path(out), **limits)


def optimise(target: str | Path, out: str | Path = "out") -> "Optimised":
    """Find the best printable designs for a target's file; as :func:`sensorgen.workflows.optimise.run.optimise`."""
    from sensorgen.workflows.optimise.run import optimise

    return optimise(Path(target), Path(out))


def report(log: Log, iteration: int | None = None, *specimens: str, path: str | Path = "report.html") -> "Report":
    """Write predictions beside measurements of an iteration, or of specimens, as a page; ``.md``, ``.csv``, ``.json``.

    Errors as of :func:`sensorgen.analysis.report.report`.
    """
    from sensorgen.analysis import report as reports

    file = Path(path)
    how = file.suffix.lstrip(".") or "html"
    if how not in reports.FORMATS:
        raise UnknownName("format of a report", how, reports.FORMATS)
    compared = reports.report(log, iteration, specimens=specimens)
    with files.replacing(file) as target:
        target.writelines(piece.encode() for piece in reports.pieces(compared, how))
    return compared


def invert(
    what: Design | Body, frequency_hz: Sequence[float], impedance_ohm: ArrayLike, *, rest_ohm: ArrayLike = (),
    noise: float | None = None, perfect: bool = False,
) -> InvertedPresses | Estimates:  # fmt: skip
    """Force and position from measured impedances, by what the design alone allows.

    The intervals hold all that a specimen of the design may differ in; known presses make them several times narrower
    (:func:`calibrate`).

    Parameters
    ----------
    what : Design or Body
        As of :func:`predict`.
    frequency_hz : (m,) sequence of float
        Frequencies [Hz].
    impedance_ohm : (n, m) complex array
        Readings under load [ohm].
    rest_ohm : (m,) or (k, m) complex array
        Readings with nothing on the sensor, just before [ohm]: what counts is the ratio to the mean of the last 64.
    noise : float, optional
        Standard deviation of Re Z and of Im Z of a reading, relative to abs(Z) [-]; by the scatter of nine or more
        readings at rest, else 0.1 %, if not given.
    perfect : bool
        As if the sensor were exactly as predicted, and no reading at rest were needed: a real one is not.

    Returns
    -------
    InvertedPresses, or Estimates of a perfect sensor
        Force [N] and position [m] of each reading with their 90 % intervals and a verdict.

    Raises
    ------
    BadInput
        No readings at rest; arrays of other shapes.

    Examples
    --------
    >>> plate = Design(shape="reference")
    >>> points = predict(plate, force_n=[0.0, 9.0], position_mm=[30.0]).impedance.impedance_ohm  # tone, force, position
    >>> found = invert(plate, TONES_HZ, points[:, 1].T, rest_ohm=points[:, 0].T, noise=1e-4)
    >>> bool(found.force_90_n[0, 0] < 9.0 < found.force_90_n[0, 1])
    True
    """
    if isinstance(what, Design) and what.layout:
        raise BadInput(
            "an array has many presses at once; expected its frames in a file, by the command sensorgen invert"
        )
    f, z = np.atleast_1d(np.asarray(frequency_hz, float)), np.asarray(impedance_ohm, complex)
    at_rest = np.atleast_2d(np.asarray(rest_ohm, complex))
    _check_readings(z, at_rest, len(f), noise, perfect=perfect)
    model, _ = sensor_model(_body(what))
    if perfect:
        return Estimator(model.sensor, tuple(f.tolist()), NOISE if noise is None else noise).batch(z).identified()
    rest = Rest(at_rest)
    mean, count = rest.mean()
    one = rest.noise() if noise is None else noise
    by = inversion.of_design(model, f, rest, one * np.sqrt(1 + 1 / count))
    presses = by.batch(np.log(np.where(z == 0, np.nan, z) / mean))
    inversion.doubt_rest(presses, np.zeros(len(z), bool), 0)
    return presses


def _check_readings(z: Complex, at_rest: Complex, tones: int, noise: float | None, *, perfect: bool) -> None:
    """Refuse readings of other shapes, and a noise that is none."""
    if z.ndim != 2 or z.shape[1] != tones:
        raise BadInput(f"impedance_ohm of shape {z.shape}; expected (n, {tones}), a column for each frequency")
    if (_above_0("noise", noise) or 1.0) > 1:
        raise BadInput(f"noise={noise!r:.20}; expected a number above 0, up to 1")
    if perfect and at_rest.size:
        raise BadInput("rest_ohm beside perfect=True, which needs no reading at rest; expected one of them")
    if not perfect and (at_rest.shape[1:] != (tones,) or not len(at_rest)):
        raise BadInput(
            f"rest_ohm of shape {at_rest.shape}; expected readings with nothing on the sensor, a column for each of "
            f"the {tones} frequencies (or perfect=True, as if the sensor were as predicted)"
        )


def calibrate(log: Log, *specimens: str, bench: Bench | None = None) -> list[Calibration]:
    """Calibrate specimens that were measured in one go, by their recordings in a log; nothing is logged.

    ``Calibration.inverter()`` then finds force and position. Parameters and errors as of
    :func:`sensorgen.analysis.calibration.calibrate`.
    """
    if not specimens:
        raise BadInput("calibrate() without specimens; expected their names, as '23 triX .2mm 1'")
    return [work.calibration for work in calibrations.calibrate(log, specimens, bench)]


def compare(log: Log, iteration: int) -> Comparison:
    """Readings of an iteration beside the predictions of their designs; as :func:`of_iteration`."""
    if not any(True for _ in log.about(Reading, iteration)):
        raise BadInput(f"no readings of iteration {iteration} in the log; expected another, as Log.readings() shows")
    return of_iteration(log, iteration)


def fit(log: Log, *specimens: str, iteration: int | None = None) -> Fit:
    """Material values by what was measured of specimens or of an iteration; as :func:`sensorgen.analysis.fit.fit`."""
    return fit_values(log, iteration, specimens=specimens)


def _named(design: Design) -> Design:
    """A design as :func:`sensorgen.design.design.make` completes it, also where it was constructed by hand."""
    if not isinstance(design, Design):
        raise BadInput(f"{design!r:.60}: expected a Design or a Body, as Design(shape='tri') or load('mine.yaml')")
    if design.name and (design.border or design.geometry):  # whose files were read
        return design
    made = designs.make(design.model_dump(exclude_defaults=True, mode="json"))
    return design if made == design else made


def _numbers(name: str, values: ArrayLike) -> tuple[float, ...]:
    """Rising numbers from 0 on."""
    try:
        numbers = np.atleast_1d(np.asarray(values, float))
    except (TypeError, ValueError):  # words
        numbers = np.array([np.nan])
    if numbers.ndim > 1 or not (np.isfinite(numbers).all() and (numbers >= 0).all() and (np.diff(numbers) > 0).all()):
        raise BadInput(f"{name}={values!r:.60}; expected a number, or rising numbers, from 0 on")
    return tuple(numbers.tolist())


def _above_0(name: str, value: float | None) -> float | None:
    """A number above 0, or None where none is given."""
    numbers = () if value is None else _numbers(name, value)
    if value is not None and (len(numbers) != 1 or not numbers[0]):
        raise BadInput(f"{name}={value!r:.60}; expected a number above 0")
    return numbers[0] if numbers else None


def _of_type(name: str, value: _Kind, kind: type[_Kind]) -> _Kind:
    """A value of its type."""
    if not isinstance(value, kind):
        raise BadInput(f"{name}={value!r:.60}; expected a sensorgen.{kind.__name__}")
    return value


def _several(what: object) -> list[Any]:
    """Designs of a sequence that is none of characters, and not empty."""
    several = list(what) if isinstance(what, Iterable) and not isinstance(what, str | Mapping) else []
    if not several:
        raise BadInput(f"{what!r:.60}: expected a Design, as Design(shape='tri') or load('mine.yaml'), or some of them")
    return several


def _points(many: Sequence[Design | Body]) -> list[tuple[str, Body]]:
    bodies_of = [_body(what) for what in _several(many)]
    return [(body.design.name, body) for body in bodies_of]


def _silent() -> None:
    """Progress of a notebook, which shows none."""


def _body(what: Design | Body) -> Body:
    if isinstance(what, Body):
        return what
    design = _named(what)
    return bodies.default_body(design)
