"""``--sweep``, ``--jobs`` and ``--cluster``, and progress bars of solvers."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click


def options() -> list[click.Parameter]:
    """``--sweep`` and where it is worked out."""
    return [
        click.Option(
            ["--sweep"], metavar="KEY=VALUES",
            help="Answer for each value of one setting: dielectric_mm=0.05:0.2:0.05, or eps_x60=3,4,5.",
        ),
        *workers(),
    ]  # fmt: skip


def workers(usual: str = "one for each core") -> list[click.Parameter]:
    """``--jobs`` and ``--cluster``."""
    return [
        click.Option(
            ["--jobs"], type=click.IntRange(1, 64), default=None, metavar="N",
            help=f"Processes at once; {usual} if not given.",
        ),
        click.Option(
            ["--cluster"], metavar="ADDRESS", default="",
            help="Work on a Dask cluster: its scheduler's address, as tls://10.0.0.5:8786, or its scheduler file.",
        ),
    ]  # fmt: skip


def at_once(jobs: int | None) -> int:
    """Default number of processes."""
    return jobs or os.cpu_count() or 1


@contextmanager
def bar(length: int) -> Iterator[Callable[[], None]]:
    """A progress bar on the terminal, only for a person."""
    with click.progressbar(length=length, file=sys.stderr, hidden=not sys.stderr.isatty(), label="solving") as shown:
        shown.render_progress()
        yield lambda: shown.update(1)


@contextmanager
def pressing(stress_kpa: Sequence[float]) -> Iterator[Callable[[float], None]]:
    """A progress bar that stands at the highest stress reached so far, only for a person."""
    with click.progressbar(
        length=len(stress_kpa), file=sys.stderr, hidden=not sys.stderr.isatty(), label="pressing"
    ) as shown:
        shown.render_progress()
        yield lambda reached_pa: shown.update(max(sum(1e3 * kpa <= reached_pa for kpa in stress_kpa) - shown.pos, 0))
