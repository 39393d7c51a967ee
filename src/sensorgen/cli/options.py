"""Options that several commands have."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sensorgen.cli import render
from sensorgen.cli.words import OneOf, Ratio, Share, TipWords, Values
from sensorgen.core import units
from sensorgen.core.errors import BadInput

if TYPE_CHECKING:
    from sensorgen.analysis.calibration import Bench


def option(
    flags: str, kind: "click.ParamType[Any] | None", about: str, *, default: str | None = None,
    metavar: str | None = None, multiple: bool = False,
) -> click.Option:  # fmt: skip
    """An option; its flags with the parameter's name where that is another one: ``--tip tip_mm``."""
    return click.Option(
        flags.split(), type=kind, default=default, show_default=default is not None, metavar=metavar, multiple=multiple,
        help=about,
    )  # fmt: skip


def flag(name: str, about: str) -> click.Option:
    """An option without a value."""
    return click.Option([name], is_flag=True, help=about)


def accuracy(about: str) -> click.Option:
    """``--accuracy``, a number above 0."""
    return option("--accuracy", Ratio(), about)


def compression(
    *laws: str, about: str = "Compression law of a plate; the best of the cell if not given."
) -> click.Option:
    """``--compression``: a law of plates, or one of ``laws``."""
    return option("--compression", OneOf(("unconfined", "bonded", *laws)), about)


def sides() -> click.Option:
    """``--sides``, one of the boundary conditions."""
    about = (
        "Sides of the sensor: bonded, its solids stick to electrodes and base, and a plate bulges at its edges; free, "
        "it widens as it likes (B.49); symmetric, one of unlimited cells."
    )
    return option("--sides", OneOf(("bonded", "free", "symmetric")), about, default="bonded")


def force() -> click.Option:
    """``--force``, one [N]."""
    return option("--force force_n", Values(units.FORCE_N, zero=False), "Force of the press.", default="6N")


def of_design_tip() -> click.Option:
    """``--tip`` of the design: :class:`sensorgen.cli.designs.DesignGroup` sets it."""
    about = (
        "What presses: its width, then stiff, even or a block's material with its height, as 5mm,stiff or "
        "ninjaflex,10mm; the design's if not given."
    )
    return option("--tip", TipWords(), about)


def tip(flags: str, about: str) -> click.Option:
    """Length of a tip, one [mm]."""
    return option(flags, Values(units.LENGTH_MM, zero=False), about, default="10mm", metavar="MM")


def bench() -> list[click.Parameter]:
    """``--tip`` and ``--force-offset`` of the bench that pressed; :func:`bench_of` reads them."""
    return [
        of_design_tip(),
        option(
            "--force-offset", None, "Force above what the rig says, as its piston's weight: 0.9+-0.1 for the thesis's.",
            default="0+-0.1", metavar="N+-N",
        ),
    ]  # fmt: skip


def bench_of(tip: dict[str, Any] | None, force_offset: str) -> "Bench":
    """The bench that the options say."""
    from sensorgen.analysis.calibration import Bench

    mean, mark, spread = force_offset.replace(" ", "").replace("±", "+-").partition("+-")
    if not mark:
        raise BadInput(f"--force-offset {force_offset!r:.40}: expected mean and standard deviation, as 0.9+-0.1 (N)")
    try:
        block = dict(tip or {})
        width = block.pop("width_mm", None)
        offset = units.force_n(mean), units.force_n(spread)
        return Bench(None if width is None else width * units.M_PER_MM, offset, block)
    except BadInput as error:
        raise error.within("--force-offset") from None


def frequencies() -> click.Option:
    """``--frequencies`` [Hz]."""
    about = "Frequencies, as in 1.1kHz,2.3kHz; the thesis's seven if not given."
    return option("--frequencies frequency_hz", Values(units.FREQUENCY_HZ, zero=False), about)


def noise() -> click.Option:
    """``--noise`` [-]."""
    return option("--noise", Share(), "Standard error of R and of X of a reading, relative to |Z|.", default="0.1%")


def array_readout() -> list[click.Parameter]:
    """``--readout`` and ``--input`` of an array."""
    return [
        option(
            "--readout", OneOf(("guarded", "two-terminal")),
            "Of an array: guarded, a row is driven and all other tracks are at 0 V; or two-terminal, a meter between "
            "two and the rest open.", default="guarded",
        ),
        option("--input input_ohm", Ratio(), "Of an array, guarded: input resistance of a terminal.", default="50",
               metavar="OHM"),
    ]  # fmt: skip


def array_frames() -> list[click.Parameter]:
    """Options of the frames of an array."""
    return [
        *array_readout(),
        option(
            "--frequency", Values(units.FREQUENCY_HZ, zero=False), "Of an array's frames, where their file has none.",
            metavar="HZ",
        ),
        option("--scatter", Share(), "Of an array: gain from cell to cell, 5 % before a calibration.", default="5%"),
        option(
            "--calibration", click.Path(path_type=Path, dir_okay=False), "Of an array: by 'sensorgen calibrate'.",
            metavar="FILE.npz",
        ),
        option("--plot", click.Path(path_type=Path), "Of an array: write its heaviest map there.", metavar="DIR"),
    ]  # fmt: skip


def explain() -> click.Option:
    """``--explain``."""
    return flag("--explain", "Print which models were used, and their cost and error.")


def no_cache() -> click.Option:
    """``--no-cache``."""
    return flag("--no-cache", "Solve anew, and keep nothing.")


def refuse_explain(given: bool, *, many: bool) -> None:
    """Raise BadInput for ``--explain`` with a form for programs, or of many designs."""
    if given and (many or render.form() in ("json", "csv")):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")
