"""Run a slicer and say in its own words what it did not like."""

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from sensorgen.errors import SlicerFailed

TIMEOUT_S = 1800.0
KEPT_LINES = 12


def find(program: str, package: str) -> str:
    """Path of a program.

    Raises
    ------
    SlicerFailed
        It is not installed; the message names the package that has it.
    """
    path = shutil.which(program)
    if path is None:
        raise SlicerFailed(f"{program} is not installed or not on PATH; on Debian: apt install {package}")
    return path


def run(command: Sequence[str], gcode: Path, environment: Mapping[str, str] | None = None) -> None:
    """Run a slicer that is to write ``gcode``; what an earlier run left there is removed first.

    Raises
    ------
    SlicerFailed
        Exit code other than 0, no G-code in spite of 0, or more than ``TIMEOUT_S`` [s].
    """
    gcode.unlink(missing_ok=True)
    name = Path(command[0]).name
    try:
        done = subprocess.run(  # noqa: S603 - a slicer found by name, with our own arguments
            list(command),
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=TIMEOUT_S,
            env={**os.environ, **(environment or {})},
        )
    except subprocess.TimeoutExpired:
        raise SlicerFailed(f"{name} took more than {TIMEOUT_S:g} s: slice fewer pieces at once") from None
    except OSError as error:
        raise SlicerFailed(f"cannot run {command[0]}: {error.strerror or error}") from None
    if done.returncode != 0:
        raise SlicerFailed(f"{name} failed with exit code {done.returncode}: {_last_words(done)}")
    if not gcode.is_file() or gcode.stat().st_size == 0:
        raise SlicerFailed(f"{name} ended well but wrote no {gcode}: {_last_words(done)}")


def _last_words(done: subprocess.CompletedProcess[str]) -> str:
    """What the slicer calls an error, or else the end of what it said; the rest is licence and progress."""
    lines = [line.strip() for line in f"{done.stderr}\n{done.stdout}".splitlines()]
    errors = [line for line in lines if "error" in line.lower()]
    said = [line for line in lines if line and not any(word in line for word in ("[trace]", "[debug]", "[WARNING]"))]
    return " | ".join((errors or said)[-KEPT_LINES:]) or "it said nothing"
