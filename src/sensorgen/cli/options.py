"""Options that several commands have."""

import click

from sensorgen.cli import render
from sensorgen.cli.words import OneOf, Ratio, Share, Values
from sensorgen.core import units
from sensorgen.core.errors import BadInput


def accuracy(about: str) -> click.Option:
    """``--accuracy``, a number above 0."""
    return click.Option(["--accuracy"], type=Ratio(), default=None, help=about)


def compression(
    *laws: str, about: str = "Compression law of a plate; the best of the cell if not given."
) -> click.Option:
    """``--compression``: a law of plates, or one of ``laws``."""
    return click.Option(["--compression"], type=OneOf(("unconfined", "bonded", *laws)), help=about)


def force() -> click.Option:
    """``--force``, one [N]."""
    return click.Option(
        ["--force", "force_n"], type=Values(units.FORCE_N, zero=False), default="6N", show_default=True,
        help="Force of the press.",
    )  # fmt: skip


def tip(flag: str, name: str, about: str) -> click.Option:
    """Length of a tip, one [mm]."""
    return click.Option(
        [flag, name], type=Values(units.LENGTH_MM, zero=False), metavar="MM", default="10mm", show_default=True,
        help=about,
    )  # fmt: skip


def frequencies() -> click.Option:
    """``--frequencies`` [Hz]."""
    return click.Option(
        ["--frequencies", "frequency_hz"], type=Values(units.FREQUENCY_HZ, zero=False),
        help="Frequencies, as in 1.1kHz,2.3kHz; the thesis's seven if not given.",
    )  # fmt: skip


def noise() -> click.Option:
    """``--noise`` [-]."""
    return click.Option(
        ["--noise"], type=Share(), default="0.1%", show_default=True,
        help="Standard error of R and of X of a reading, relative to |Z|.",
    )  # fmt: skip


def explain() -> click.Option:
    """``--explain``."""
    return click.Option(["--explain"], is_flag=True, help="Print which models were used, and their cost and error.")


def no_cache() -> click.Option:
    """``--no-cache``."""
    return click.Option(["--no-cache"], is_flag=True, help="Solve anew, and keep nothing.")


def refuse_explain(given: bool, *, many: bool) -> None:
    """Raise BadInput for ``--explain`` with a form for programs, or of many designs."""
    if given and (many or render.form() in ("json", "csv")):
        raise BadInput("--explain is for people, and one design; --json holds the plan too")
