"""Run a slicer, with bodies as STL where it reads no 3MF, and say in its own words what it did not like."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from sensorgen.core.errors import SlicerFailed
from sensorgen.core.leash import NOT_RUN, on_leash
from sensorgen.export.slicers import TIME_LIMIT_S

if TYPE_CHECKING:  # with NumPy and Shapely, which running a slicer does without
    from sensorgen.core.arrays import Real
    from sensorgen.scene.geometry.meshes import Mesh

KEPT_LINES = 12
_TICK_S = 0.1
_KILLED_S = 2.0  # for which a killed process is waited for
_KEPT_BYTES = 1 << 16
_SIGNALS = {number.value: number.name for number in signal.Signals}  # SIGXFSZ where files may not be larger


@dataclass(frozen=True)
class Runner:
    """Way to run a slicer: program, time allowed, and a callback while time passes.

    Attributes
    ----------
    program : str
        Path of the program; "" for the one on PATH.
    time_limit_s : float
        How long it may take [s].
    tick : callable
        Called some times a second.
    """

    program: str = ""
    time_limit_s: float = TIME_LIMIT_S
    tick: Callable[[], None] = lambda: None


USUAL = Runner()


def find(program: str, package: str, given: str = "") -> str:
    """Path of a program, or of the one that the user names.

    Raises
    ------
    SlicerFailed
        It is not installed; the message names the package that has it.
    """
    path = shutil.which(given or program)
    if path is None and given:
        raise SlicerFailed(f"there is no program {given!r}; name the file of {program}, or leave it out")
    if path is None:
        raise SlicerFailed(f"{program} is not installed or not on PATH; on Debian: apt install {package}")
    return path


def run(
    command: Sequence[str], gcode: Path, environment: Mapping[str, str] | None = None, runner: Runner = USUAL
) -> None:
    """Run a slicer that is to write ``gcode``; what an earlier run left there is removed first.

    Raises
    ------
    SlicerFailed
        Exit code other than 0, no G-code in spite of 0, or more time than it was given.
    """
    gcode.unlink(missing_ok=True)
    name = Path(command[0]).name
    with tempfile.TemporaryFile() as output:
        try:
            code = _wait(command, output, {**os.environ, **(environment or {})}, runner)
        except subprocess.TimeoutExpired:
            raise SlicerFailed(
                f"{name} took more than {runner.time_limit_s:g} s and was ended: slice fewer pieces at once, or give "
                f"it more time; it last said: {_last_words(output)}"
            ) from None
        except OSError as error:
            raise SlicerFailed(f"cannot run {command[0]}: {error.strerror or error}") from None
        if code == NOT_RUN:
            raise SlicerFailed(f"cannot run {command[0]}: {_last_words(output)}")
        if code != 0:
            signalled = f"was ended by {_SIGNALS.get(-code, f'signal {-code}')}"
            how = f"failed with exit code {code}" if code > 0 else signalled
            raise SlicerFailed(f"{name} {how}: {_last_words(output)}")
        if not gcode.is_file() or gcode.stat().st_size == 0:
            raise SlicerFailed(f"{name} ended well but wrote no {gcode}: {_last_words(output)}")


def _wait(command: Sequence[str], output: BinaryIO, environment: Mapping[str, str], runner: Runner) -> int:
    """Exit code of a process, which always ends here, together with whatever it started itself."""
    end = time.monotonic() + runner.time_limit_s
    process = subprocess.Popen(  # noqa: S603 - a slicer found by name, with our own arguments
        on_leash(list(command)), stdin=subprocess.PIPE, stdout=output, stderr=output, env=environment,
        start_new_session=True,
    )  # fmt: skip
    try:
        while True:
            runner.tick()
            left = end - time.monotonic()
            try:
                return process.wait(timeout=max(0.0, min(_TICK_S, left)))
            except subprocess.TimeoutExpired:
                if left <= 0:
                    raise
    finally:
        if process.poll() is None:
            with suppress(ProcessLookupError):
                if hasattr(os, "killpg"):
                    os.killpg(process.pid, signal.SIGKILL)
                else:  # Windows
                    process.kill()
            # A signal between two steps of Popen's own wait leaves its lock taken: without a limit this would hang.
            with suppress(subprocess.TimeoutExpired):
                process.wait(timeout=_KILLED_S)
        if process.stdin:
            process.stdin.close()


def _last_words(output: BinaryIO) -> str:
    """Errors named by the slicer, or else the end of its output; the rest is licence and progress."""
    output.seek(max(0, output.seek(0, os.SEEK_END) - _KEPT_BYTES))
    text = output.read().decode(errors="replace").replace("\t", " ")
    lines = ["".join(filter(str.isprintable, line)).strip() for line in text.splitlines()]
    errors = [line for line in lines if "error" in line.lower()]
    shown = [line for line in lines if line and not any(word in line for word in ("[trace]", "[debug]", "[WARNING]"))]
    return " | ".join((errors or shown)[-KEPT_LINES:]) or "it said nothing"


_FACET = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]


def content(mesh: "Mesh", shift_mm: "Real") -> bytes:
    """The file of a mesh.

    Parameters
    ----------
    mesh : Mesh
        The body [mm].
    shift_mm : (3,) float64 array
        Added to every corner [mm].
    """
    import numpy as np

    facets = np.zeros(len(mesh.triangles), dtype=_FACET)
    facets["corners"] = (mesh.vertices_mm + shift_mm)[mesh.triangles]
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
