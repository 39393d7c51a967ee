"""NSGA-II: designs of a space that is too large to try all. Nothing is proven beyond those that were tried."""

import importlib.util
from collections.abc import Sequence

from sensorgen.core.errors import NotInstalled
from sensorgen.workflows.optimise.front import HERE, Front, Progress, Workers, worth
from sensorgen.workflows.optimise.space import Space
from sensorgen.workflows.optimise.target import Target
from sensorgen.workflows.search import Candidate

POPULATION = 24  # designs of a generation
SEED = 1
_STEPS = 1 << 20  # of the share of a range: finer than any grid
_IDLE = 5  # generations without a new design, after which the search ends
_WORST = 1e30  # objective of a design that has none


def sample(
    target: Target, space: Space, count: int, workers: Workers = HERE, *, keep: bool = True,
    progress: Progress = lambda *_: None,
) -> Front:  # fmt: skip
    """The front of so many designs, which NSGA-II chooses by the results of those before.

    Each generation is checked, bounded and evaluated as by :func:`sensorgen.workflows.optimise.front.search`, against
    all designs before: what is violated, doubts too, counts before any objective.

    Parameters
    ----------
    target : Target
        What the best design is to be best at.
    space : Space
        Its designs.
    count : int
        Designs to try; fewer where generations bring no new one.
    workers, keep, progress
        As of ``search``.

    Raises
    ------
    NotInstalled
        Optuna is missing.

    Notes
    -----
    Deb et al., IEEE Trans. Evol. Comput. 6 (2002) 182; as in Optuna, with a fixed seed.
    """
    if importlib.util.find_spec("optuna") is None:
        raise NotInstalled("--sample needs Optuna: pip install 'sensorgen[search]'")
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    sampler = optuna.samplers.NSGAIISampler(population_size=POPULATION, seed=SEED)
    study = optuna.create_study(directions=["minimize"] * len(target.objectives), sampler=sampler)
    rows: dict[tuple[object, ...], Candidate] = {}
    idle = 0
    with workers.opened() as opened:
        front = Front(target, opened, keep=keep, progress=progress)
        while len(rows) < count and idle < _IDLE:
            before, asked = len(rows), []
            for trial in [study.ask() for _ in range(POPULATION)]:
                part = trial.suggest_int("part", 0, len(space.parts) - 1)
                shares = {key: trial.suggest_int(key, 0, _STEPS - 1) / _STEPS for key in space.parts[part][1]}
                candidate = space.at(part, shares)
                values = tuple(candidate.values.values())
                if values in rows or len(rows) < count:
                    asked.append((trial, rows.setdefault(values, candidate)))
            front.run(front.made(list(rows.values())[before:]))
            for trial, row in asked:
                trial.set_constraint("violated", sum(row.violated.values()))
                study.tell(trial, _objectives(target, row))
            idle = idle + 1 if len(rows) == before else 0
    front.whole = space.size
    return front


def _objectives(target: Target, row: Candidate) -> Sequence[float]:
    """Objectives of a design, evaluated or on the coarse mesh, the lower the better."""
    if row.trial:
        return [min(worth(target, key, row), _WORST) for key in target.objectives]
    known = row.known
    return [target.worth(key, known[key].lower) if key in known else _WORST for key in target.objectives]
