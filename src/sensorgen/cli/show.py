"""Progress, for a person at a terminal."""

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import click

from sensorgen.core.terminal import harmless
from sensorgen.core.units import si


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


def at_once(jobs: int | None) -> int:
    """Default number of processes."""
    return jobs or os.cpu_count() or 1


@contextmanager
def bar(length: int, label: str = "solving") -> Iterator[Callable[..., None]]:
    """A progress bar on the terminal, only for a person; each call moves it by one, or up to the number given."""
    with click.progressbar(length=length, file=sys.stderr, hidden=not sys.stderr.isatty(), label=label) as shown:
        shown.render_progress()
        yield lambda upto=None: shown.update(1 if upto is None else max(upto - shown.pos, 0))


@contextmanager
def pressing(stress_kpa: Sequence[float]) -> Iterator[Callable[[float], None]]:
    """A progress bar that stands at the highest stress reached so far, only for a person."""
    with bar(len(stress_kpa), "pressing") as step:
        yield lambda reached_pa: step(sum(1e3 * kpa <= reached_pa for kpa in stress_kpa))


@contextmanager
def counted() -> Iterator[Callable[[str, int, int], None]]:
    """A line with the step, how far it is, and the time left; only for a person."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda *_: None
        return
    begun: dict[str, tuple[float, int]] = {}

    def step(name: str, done: int, count: int) -> None:
        now = time.monotonic()
        if done <= 1:  # of each round anew
            begun[name] = now, done
        start, first = begun.get(name, (now, done))
        left = (now - start) / (done - first) * (count - done) if done > first else 0.0
        words = f"{name} {done} of {count}" + (f", {si(left, 's', 2)} left" if left else "")
        click.echo(f"\r{words:50.50}", nl=False, err=True)

    try:
        yield step
    finally:
        clear()
