"""Progress, for a person at a terminal."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click

from sensorgen.cli import harmless


@contextmanager
def progress(steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """A bar that moves with the named steps and is gone afterwards; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda _: None
        return
    started, done = time.monotonic(), 0

    def step(name: str) -> None:
        nonlocal done
        done = steps.index(name) if name in steps else done  # a part of a step moves the clock alone
        bar = "#" * (20 * done // max(1, len(steps) - 1))
        seconds = time.monotonic() - started
        click.echo(f"\r[{bar:20}] {seconds:4.1f} s  {harmless(name):24.24}", nl=False, err=True)

    try:
        yield step
    finally:
        clear()


def clear() -> None:
    """Clear the bar, for what is printed in its place."""
    if sys.stderr is not None and sys.stderr.isatty():
        click.echo("\r" + " " * 60 + "\r", nl=False, err=True)
