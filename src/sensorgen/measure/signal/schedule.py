"""Plan a run of random presses, reproducible by its seed, that any rig can follow.

Forces and positions are independent and uniform, so that neither drift nor creep correlates with them. Repeated presses
come at random times of the run, not one after the other, so that they show repeatability and not relaxation.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Annotated

import numpy as np

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import OutOfRange

MOST_PRESSES = 100_000
_STEP_N, _STEP_MM = 0.001, 0.001  # resolution: the file has all digits


@dataclass(frozen=True)
class Step:
    """One press.

    Attributes
    ----------
    press : int
        Number in the run, from 1.
    point : int
        Number of the point, from 1; the same in a repeat.
    start_s : float
        Begin of the press, since the begin of the run [s].
    force_n, position_mm : float
        Force, and position of the tip's centre along the sensor [N], [mm].
    dwell_s, rest_s : float
        Length of the press, and of the rest after it [s].
    """

    press: Annotated[int, Column("press")]
    point: Annotated[int, Column("point")]
    start_s: Annotated[float, Column("start", "s")]
    force_n: Annotated[float, Column("force", "N")]
    position_mm: Annotated[float, Column("position", "mm", digits=5)]
    dwell_s: Annotated[float, Column("dwell", "s")]
    rest_s: Annotated[float, Column("rest", "s")]


@dataclass(frozen=True)
class RunPlan:
    """Parameters of a run.

    Attributes
    ----------
    seed : int
        Seed of the random numbers.
    presses : int
        Number of points; each is pressed ``1 + repeats`` times.
    force_n, position_mm : (float, float)
        Least and largest [N], [mm].
    dwell_s, rest_s : float
        Length of each press and of each rest [s].
    repeats : int
        Number of repeats of each point.
    """

    seed: int
    presses: int
    force_n: tuple[float, float]
    position_mm: tuple[float, float]
    dwell_s: float
    rest_s: float
    repeats: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        total = self.presses * (1 + self.repeats)
        if self.presses < 1 or self.repeats < 0 or total > MOST_PRESSES:
            raise OutOfRange(f"{self.presses} presses, each {self.repeats} times more; expected up to {MOST_PRESSES}")
        for name, (low, high) in {"forces": self.force_n, "positions": self.position_mm}.items():
            if not 0 <= low <= high < np.inf:
                raise OutOfRange(f"{name} from {low:g} to {high:g}; expected two numbers that rise, from 0 on")
        if not (0 < self.dwell_s < np.inf and 0 <= self.rest_s < np.inf):
            raise OutOfRange(f"dwell {self.dwell_s:g} s and rest {self.rest_s:g} s; expected a dwell above 0")

    def steps(self) -> list[Step]:
        """Presses in the order of the run, after a rest."""
        rng = np.random.default_rng(self.seed)
        force = np.round(rng.uniform(*self.force_n, self.presses) / _STEP_N) * _STEP_N
        position = np.round(rng.uniform(*self.position_mm, self.presses) / _STEP_MM) * _STEP_MM
        order = list(range(self.presses))
        for _ in range(self.repeats):
            order += rng.permutation(self.presses).tolist()
        each = self.dwell_s + self.rest_s
        starts = [round(self.rest_s + k * each, 6) for k in range(len(order))]
        return [
            Step(k, p + 1, start, round(float(force[p]), 6), round(float(position[p]), 6), self.dwell_s, self.rest_s)
            for k, (p, start) in enumerate(zip(order, starts, strict=True), 1)
        ]

    def seconds(self) -> float:
        """Length of the run [s]."""
        return self.rest_s + self.presses * (1 + self.repeats) * (self.dwell_s + self.rest_s)


@dataclass(frozen=True)
class Schedule:
    """A plan with its presses.

    Attributes
    ----------
    plan : RunPlan
        Its parameters.
    design : str
        Name of the design.
    seconds : float
        Length of the run [s].
    steps : tuple of Step
        In the order of the run.
    """

    plan: RunPlan
    design: str
    seconds: float
    steps: tuple[Step, ...]

    def to_json(self) -> str:
        """Parameters and presses."""
        rest = {"seconds": self.seconds, "steps": [asdict(step) for step in self.steps], "design": self.design}
        return json.dumps(asdict(self.plan) | rest, indent=2, ensure_ascii=False) + "\n"

    def document(self) -> Iterator[Part]:
        """The presses, then their number and the length of the run."""
        yield Table.of("presses", "", self.steps)
        minutes, rest = divmod(round(self.seconds), 60)
        hours, minutes = divmod(minutes, 60)
        yield f"{len(self.steps)} presses, {f'{hours} h {minutes} min' if hours else f'{minutes} min {rest} s'}"


def schedule(plan: RunPlan, design: str) -> Schedule:
    """The presses of a plan for a design."""
    return Schedule(plan, design, plan.seconds(), tuple(plan.steps()))
