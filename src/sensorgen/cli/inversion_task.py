"""Readings that ``sensorgen invert`` takes, of a line or an array, and what becomes of them."""

import re
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sensorgen.cli import render
from sensorgen.core import files as store
from sensorgen.core import units
from sensorgen.core.errors import BadInput, within
from sensorgen.core.options import Argument, Option

if TYPE_CHECKING:
    from sensorgen.core.document import Documented
    from sensorgen.measure.readings import Readings
    from sensorgen.prediction.inverse.estimator import Prior

_NORMAL = re.compile(r"(force|position)=(.+?)(?:\+-|±)(.+)")


@dataclass(frozen=True)
class Task:
    """Readings to invert, their noise and prior.

    Attributes
    ----------
    measured : MEASURED.csv
    rest_file, --rest : FILE.csv
        Readings with nothing on the sensor, if MEASURED.csv has no column 'rest' with 1 for them.
    noise : SHARE
        Standard deviation of R and of X, each as a share of the impedance's magnitude [default: what the readings at
        rest scatter by, else 0.1 %].
    prior : WHAT
        Prior: uniform, or force=3+-1, position=50+-20 (N, mm), or both with a comma.
    force_limit_n : N
        Largest force to look for [default: 13 N, or a quarter above the largest that calibrated].
    output, --output, -o : FILE.csv
        Write a row per sample, '-' to the terminal; readings from the standard input go there by themselves.
    newest
        In real time: of readings that wait, only those at rest and the newest are used; the others are counted.
    """

    measured: Annotated[str, Argument()]
    rest_file: str = ""  # fmt: skip
    noise: Annotated[float | None, Option(kind="share")] = None  # fmt: skip
    prior: str | None = None
    force_limit_n: float | None = None  # fmt: skip
    output: str = ""  # fmt: skip
    newest: bool = False

    def __post_init__(self) -> None:
        """Refuse a noise that none can be."""
        if self.noise is not None and not 0 < self.noise <= 1:
            raise BadInput(f"a noise of {self.noise:g}; expected a share above 0, up to 100 %")

    @property
    def terminal(self) -> bool:
        """True where rows go to the terminal, at once."""
        return self.output == "-" or (self.measured == "-" and not self.output)

    @cached_property
    def distribution(self) -> "Prior | None":
        """The prior as typed."""
        from sensorgen.prediction.inverse.estimator import Prior

        if self.prior is None or self.prior.strip() == "uniform":
            return None if self.prior is None else Prior()
        normal: dict[str, tuple[float, float]] = {}
        for word in self.prior.split(","):
            match = _NORMAL.fullmatch(word.strip().replace(" ", ""))
            if match is None or match[1] in normal:
                raise BadInput(f"--prior {self.prior!r}: expected uniform, or force=3+-1,position=50+-20 (N, mm)")
            read, scale = (units.force_n, 1.0) if match[1] == "force" else (units.length_mm, units.M_PER_MM)
            with within("--prior"):
                normal[match[1]] = read(match[2]) * scale, read(match[3]) * scale
        return Prior(normal.get("force"), normal.get("position"))

    def run(self, beside: tuple[str, ...], method: "Callable[[Readings], Any]") -> int:
        """Invert block by block, and write a row for each reading; then the summary."""
        from sensorgen.measure.readings import readings

        with readings(self.measured, beside=beside, newest=self.newest) as source, ExitStack() as stack:
            inversion = method(source)
            to_file = self.output and not self.terminal
            file = stack.enter_context(store.replacing(Path(self.output))) if to_file else None
            step = stack.enter_context(render.progress(["reading"]))

            def write(text: str) -> None:
                if file:
                    file.write(text.encode())
                elif self.terminal:
                    print(text, end="", flush=True)

            write(inversion.header())
            for block in source.blocks():
                write(inversion.rows(block))
                step(f"{inversion.summary.samples} samples")
        self._deliver(inversion.result(), source.dropped)
        return 0

    def _deliver(self, result: "Documented", dropped: int) -> None:
        if dropped:
            render.say(f"{dropped} readings were dropped for newer ones", err=True)
        for piece in render.pieces(result, render.form()):
            render.say(piece, nl=False, err=self.terminal)
        if not render.form() and not self.terminal:
            render.say(self.output or "--output FILE.csv writes force and position of every sample")
