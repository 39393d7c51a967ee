"""``sensorgen invert``: force and position back from measured impedances, of a calibrated specimen or of a design."""

import re
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from sensorgen.cli import array_calibrate, body_options, log_words, options, render, show
from sensorgen.cli.designs import DesignGroup
from sensorgen.cli.words import OneOf, Share, Values, one
from sensorgen.core import files as store
from sensorgen.core import plugins as registry
from sensorgen.core import units
from sensorgen.core.errors import BadInput, MissingValue, UnknownName, within
from sensorgen.design import shapes

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.design.design import Design
    from sensorgen.measure.readings import Block, Readings
    from sensorgen.prediction.calibration.baseline import Baseline
    from sensorgen.prediction.calibration.inversion import Inverter
    from sensorgen.prediction.calibration.rest import Rest
    from sensorgen.prediction.inverse import Prior

_NORMAL = re.compile(r"(force|position)=(.+?)(?:\+-|±)(.+)")
_REST, _TIME = "rest", "time_s"

_COMMON: list[click.Parameter] = [
    click.Argument(["measured"], metavar="MEASURED.csv"),
    click.Option(
        ["--rest", "rest_file"], metavar="FILE.csv",
        help="Readings with nothing on the sensor, if MEASURED.csv has no column 'rest' with 1 for them.",
    ),
    click.Option(
        ["--noise"], type=Share(), metavar="SHARE",
        help="Standard deviation of R and of X, each as a share of the impedance's magnitude "
        "[default: what the readings at rest scatter by, else 0.1 %].",
    ),
    click.Option(
        ["--prior"], metavar="WHAT",
        help="Prior: uniform, or force=3+-1, position=50+-20 (N, mm), or both with a comma.",
    ),
    click.Option(
        ["--force-limit", "force_limit_n"], type=Values(units.FORCE_N, zero=False), metavar="N",
        help="Largest force to look for [default: 13 N, or a quarter above the largest that calibrated].",
    ),
    click.Option(
        ["--output", "-o"], metavar="FILE.csv",
        help="Write a row per sample, '-' to the terminal; readings from the standard input go there by themselves.",
    ),
    click.Option(
        ["--newest"], is_flag=True,
        help="In real time: of readings that wait, only those at rest and the newest are used; the others are counted.",
    ),
]  # fmt: skip
OWN: list[click.Parameter] = [
    *_COMMON,
    click.Option(
        ["--perfect"], is_flag=True,
        help="As if the sensor were exactly as predicted, and no reading at rest were needed: what noise alone leaves.",
    ),
    options.of_design_tip(),
    click.Option(
        ["--compression"], type=OneOf(("unconfined", "bonded")),
        help="Compression law of a plate; the best of the cell if not given.",
    ),
    *options.array_frames(), *body_options.body_options(),
    *render.options("json", "markdown", file=False),
]  # fmt: skip


def _work(
    design: "Design", *, measured: str, output: str | None, perfect: bool, rest_file: str | None,
    compression: str | None, **how: Any,
) -> int:  # fmt: skip
    of_array = {key: how.pop(key) for key in ("readout", "input_ohm", "frequency", "scatter", "plot", "calibration")}
    if design.layout:
        from sensorgen.cli import array_frames

        others = {"perfect": perfect, "compression": compression, **how}
        noise = others.pop("noise")
        return array_frames.invert(design, measured, output, noise, rest_file, **of_array, **others)
    if of_array["calibration"]:
        raise BadInput(f"--calibration is of an array; {design.name} is {design.shape}: invert its specimen by name")
    from sensorgen.prediction.query import Query

    query = Query(law=compression or "")
    body = body_options.body_of()(design)
    if perfect:
        if rest_file:
            raise BadInput("--perfect needs no reading at rest; expected one of --perfect and --rest")
        return _perfect(body, query, measured, output, **how)
    from sensorgen.analysis.calibration import Bench, spread_of
    from sensorgen.prediction.calibration import fitting
    from sensorgen.prediction.calibration.specimen import SpecimenModel
    from sensorgen.prediction.planning import sensor_model

    def inverter(rest: "Rest", tones_hz: Any, noise: Any, limit_n: float | None) -> "tuple[Inverter, float, int, Any]":
        from sensorgen.prediction.calibration.inversion import Inverter
        from sensorgen.prediction.inverse import FORCE_LIMIT_N

        found, _ = sensor_model(body, query)
        model = SpecimenModel(found.sensor, tones_hz, spread_of(found, Bench()))
        limit, (mean, count) = limit_n or FORCE_LIMIT_N, rest.mean()
        if not np.isfinite(mean).all():
            raise BadInput(f"{measured}: a frequency without a reading at rest; expected one at each")
        known = fitting.by_rest(model, np.log(mean), noise / count**0.5, noise)
        return Inverter(model, known, _prior(how["prior"]), limit), limit, 0, found.doubts

    return _by_ratio(
        design.name, inverter, measured, output, rest_file, None, how["noise"], how["force_limit_n"], None,
        newest=how["newest"],
    )  # fmt: skip


def _specimen(
    name: str, measured: str, output: str | None, rest_file: str | None, noise: float | None, prior: str | None,
    force_limit_n: tuple[float, ...] | None, file: str | None, *, newest: bool,
) -> int:  # fmt: skip
    """Force and position of a specimen that 'sensorgen calibrate' has calibrated."""
    from sensorgen.analysis.calibration import design_of, stored

    with log_words.existing(file) as log:
        names = [s.specimen for s in log.specimens()] if log else []
        try:
            of, design = design_of(log, name) if log else ("", None)
        except MissingValue:
            if name in names:
                raise
            design = None
        if log is None or design is None:
            raise UnknownName("shape or specimen", name, [*registry.names(shapes), *names])
        known = stored(log, of)
    if known is None:
        raise BadInput(
            f"{of} was never calibrated: sensorgen calibrate {of!r}, or sensorgen invert DESIGN for what its design "
            f"({design.name}) alone allows"
        )

    def inverter(rest: "Rest", tones_hz: Any, noise: Any, limit_n: float | None) -> "tuple[Inverter, float, int, Any]":  # noqa: ARG001
        limit = limit_n or known.limit_n
        made = known.inverter(noise, _prior(prior), limit)
        beyond = (f"forces above {known.force_n:.3g} N were not calibrated",) if limit > known.limit_n else ()
        return made, limit, known.posterior.presses, (*beyond, *known.allowance)

    return _by_ratio(
        of, inverter, measured, output, rest_file, known.model.frequency_hz, noise, force_limit_n, known.baseline,
        newest=newest,
    )  # fmt: skip


def _by_ratio(
    of: str, inverter: "Callable[[Rest, Any, Any, float | None], tuple[Inverter, float, int, Any]]", measured: str,
    output: str | None, rest_file: str | None, tones_hz: Any, noise: float | None,
    force_limit_n: tuple[float, ...] | None, baseline: "Baseline | None", *, newest: bool,
) -> int:  # fmt: skip
    """Ratios to the latest reading at rest, row by row; the inverter is made when the first of them is there."""
    from sensorgen.measure.readings import readings
    from sensorgen.prediction.calibration import answers
    from sensorgen.prediction.calibration.inversion import doubt_rest, nothing
    from sensorgen.prediction.calibration.rest import Rest, checked

    limit_n = one("--force-limit", force_limit_n) if force_limit_n else None
    if noise is not None and not 0 < noise <= 1:
        raise BadInput(f"a noise of {noise:g}; expected a share above 0, up to 100 %")
    with readings(measured, beside=(_REST, _TIME), newest=newest) as source, ExitStack() as stack:
        tones_hz = source.frequency_hz if tones_hz is None else tones_hz
        with within(measured):
            order = checked(source.frequency_hz, tones_hz)
        if rest_file is None and _REST not in source.numbers:
            raise BadInput(
                f"{measured}: no reading at rest; expected a column 'rest' with 1 where nothing was on the sensor, or "
                "--rest FILE.csv: what counts is the ratio to it (or --perfect, as if the sensor were as predicted)"
            )
        apart, at_s = _taken_apart(rest_file, tones_hz) if rest_file else (None, np.nan)
        rest = Rest(apart, at_s, baseline)
        summary, made, told, doubted = answers.Summary(), None, False, 0
        write, terminal = _writer(stack, measured, output)
        step = stack.enter_context(show.progress(["reading"]))
        kept = [_TIME] * (_TIME in source.numbers) + source.kept
        write(answers.header(kept))
        for block in source.blocks():
            at_rest, time_s = _beside(source, block)
            ratio, age_s, changed = rest.ratios(block.impedance_ohm[:, order], at_rest, time_s)
            if rest and not at_rest.all() and (made is None or (rest.tells_noise and not told and noise is None)):
                told, single = rest.tells_noise, np.sqrt(1 + 1 / rest.mean()[1]) * (noise or rest.noise())
                made = inverter(rest, tones_hz, np.broadcast_to(single, order.shape), limit_n)
            found = made[0].batch(ratio, age_s, changed) if made else nothing(len(ratio))
            doubted = doubt_rest(found, at_rest, doubted)
            summary.add(found, at_rest)
            step(f"{summary.samples} samples")
            own = [[repr(t) if np.isfinite(t) else ""] if _TIME in source.numbers else [] for t in time_s.tolist()]
            write(answers.rows([[*a, *b] for a, b in zip(own, block.kept, strict=True)], found, at_rest))
        if made is None and summary.samples:
            raise BadInput(f"{measured}: nothing at rest before readings under load; expected 1 in column 'rest' first")
    sigma = noise or float(np.nanmedian(rest.noise()))
    notes = (*([rest.change.words] if rest.change else []), *(made[3] if made else ()))
    by, limit, length_m = (made[2], made[1], float(made[0].position_m[-1])) if made else (0, 0.0, 0.0)
    result = summary.result(of, by, limit, length_m, sigma, notes)
    _said(result, terminal, output, source.dropped)
    return 0


def _beside(source: "Readings", block: "Block") -> tuple[Any, Any]:
    """Mask of the rows at rest, and the time of each [s]."""
    columns = dict(zip(source.numbers, block.numbers.T, strict=True))
    nothing = np.full(len(block.rows), np.nan)
    return np.nan_to_num(columns.get(_REST, nothing)) != 0, columns.get(_TIME, nothing)


def _taken_apart(path: str, tones_hz: Any) -> tuple[Any, float]:
    """Readings at rest of a file, and the time of the last of them [s]."""
    from sensorgen.measure.readings import readings
    from sensorgen.prediction.calibration.rest import checked

    with readings(path, beside=(_TIME,)) as source:
        with within(path):
            order = checked(source.frequency_hz, tones_hz)
        blocks = list(source.blocks())
        if not blocks:
            raise BadInput(f"{path}: no readings; expected some with nothing on the sensor")
        times = blocks[-1].numbers[-1] if source.numbers else np.array([np.nan])
        return np.concatenate([block.impedance_ohm for block in blocks])[:, order], float(times[0])


def _writer(stack: ExitStack, measured: str, output: str | None) -> tuple[Callable[[str], None], bool]:
    """Writer of rows: the terminal, at once, or a file that is there when it is whole; and whether it is the first."""
    terminal = output == "-" or (measured == "-" and output is None)
    file = stack.enter_context(store.replacing(Path(output))) if output and not terminal else None

    def write(text: str) -> None:
        if terminal:
            print(text, end="", flush=True)
        elif file:
            file.write(text.encode())

    return write, terminal


def _said(result: "Documented", terminal: bool, output: str | None, dropped: int) -> None:
    if dropped:
        render.say(f"{dropped} readings were dropped for newer ones", err=True)
    for piece in render.pieces(result, render.form()):
        render.say(piece, nl=False, err=terminal)
    if not render.form() and not terminal:
        render.say(output or "--output FILE.csv writes force and position of every sample")


def _perfect(
    body: Any, query: Any, measured: str, output: str | None, *, noise: float | None, prior: str | None,
    force_limit_n: tuple[float, ...] | None, newest: bool,
) -> int:  # fmt: skip
    from sensorgen.measure.readings import readings
    from sensorgen.prediction.inverse import FORCE_LIMIT_N, Estimator, answers
    from sensorgen.prediction.planning import sensor_model
    from sensorgen.prediction.query import NOISE

    with readings(measured, beside=(_REST,), newest=newest) as source, ExitStack() as stack:
        model = sensor_model(body, query)[0]
        limit = one("--force-limit", force_limit_n) if force_limit_n else FORCE_LIMIT_N
        estimator = Estimator(
            model.sensor, source.frequency_hz, NOISE if noise is None else noise, _prior(prior), limit
        )
        summary = answers.Summary(estimator, model.doubts)
        write, terminal = _writer(stack, measured, output)
        step = stack.enter_context(show.progress(["reading"]))
        write(answers.header(source.kept))
        for block in source.blocks():
            under_load = np.flatnonzero(~_beside(source, block)[0])
            found = estimator.batch(block.impedance_ohm[under_load])
            summary.add(found)
            step(f"{summary.samples} samples")
            write(answers.rows([block.kept[k] for k in under_load], found, prior=estimator.prior is not None))
    _said(summary.result(), terminal, output, source.dropped)
    return 0


def _prior(text: str | None) -> "Prior | None":
    if text is None:
        return None
    from sensorgen.prediction.inverse import Prior

    if text.strip() == "uniform":
        return Prior()
    found: dict[str, tuple[float, float]] = {}
    for word in text.split(","):
        match = _NORMAL.fullmatch(word.strip().replace(" ", ""))
        if match is None or match[1] in found:
            raise BadInput(f"--prior {text!r}: expected uniform, or force=3+-1,position=50+-20 (N, mm)")
        read, scale = (units.force_n, 1.0) if match[1] == "force" else (units.length_mm, units.M_PER_MM)
        try:
            found[match[1]] = read(match[2]) * scale, read(match[3]) * scale
        except BadInput as error:
            raise error.within("--prior") from None
    return Prior(found.get("force"), found.get("position"))


class _Specimens(DesignGroup):
    """A word that is neither a shape nor a file is a specimen of the log."""

    def get_command(self, ctx: click.Context, name: str) -> click.Command:
        """The command for a shape, a design file, a calibration of an array, or a specimen."""
        if name.endswith(".npz"):
            return click.Command(
                name, params=_COMMON, help=array_calibrate.invert.__doc__,
                callback=lambda measured, output, **_: array_calibrate.invert(name, measured, output),
            )  # fmt: skip
        try:
            return super().get_command(ctx, name)
        except UnknownName:
            params = [*_COMMON, log_words.where(), *render.options("json", "markdown", file=False)]
            return click.Command(
                name, params=params, help=_specimen.__doc__, callback=lambda **given: _specimen(name, **given)
            )


command = _Specimens(
    _work, OWN, name="invert",
    help="Force and position behind the impedances in MEASURED.csv ('-' reads the standard input): one row per sample, "
    "columns re_ohm_1.1kHz and im_ohm_1.1kHz for every tone, 'rest' with 1 where nothing was on the sensor, and time_s "
    "if known. The first word is a specimen that was calibrated, or a design. Of an array: pressure maps of frames, "
    "CSV with columns r1c1, r1c2 ... [F], NPZ or HDF5. A calibration of an array, FILE.npz, in place of the design: "
    "pressures of any array's elements.",
)  # fmt: skip
