"""From a target's file to its answer: table, page, and the files of the designs to print."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sensorgen.core import document
from sensorgen.core import files as store
from sensorgen.core.errors import within
from sensorgen.workflows.optimise.front import HERE, Progress, Workers, search
from sensorgen.workflows.optimise.page import page
from sensorgen.workflows.optimise.recommend import recommended
from sensorgen.workflows.optimise.result import Optimised, Recommended, result
from sensorgen.workflows.optimise.sample import sample
from sensorgen.workflows.optimise.space import Space, candidates, space
from sensorgen.workflows.optimise.target import load


def optimise(
    word: str | Path, out: Path, workers: Workers = HERE, *, count: int = 0, keep: bool = True, built: bool = True,
    sliced: bool = True, tip: Mapping[str, Any] | None = None, progress: Progress = lambda *_: None,
) -> Optimised:  # fmt: skip
    """The best printable designs for a target; page, JSON and CSV are written into ``out``.

    Parameters
    ----------
    word : str or Path
        The target, as of :func:`sensorgen.workflows.optimise.target.load`.
    out : Path
        Folder of all files.
    count : int
        Designs to try, chosen by :func:`sensorgen.workflows.optimise.sample.sample`; 0 for all of the space.
    workers, keep, progress
        As of :func:`sensorgen.workflows.optimise.front.search`.
    built, sliced : bool
        Build the recommended designs, and slice them.
    tip : mapping, optional
        Keys of the tip, in place of the design's.

    Raises
    ------
    SensorgenError
        A target that is none, or an empty or too large space; a cluster that goes away.
    """
    path = Path(word)
    target, name = load(word, tip), path.stem
    chosen: tuple[Recommended, ...] = ()
    with within(str(path)):
        designs = space(target, path.parent) if count else candidates(target, path.parent)
    with workers.opened() as opened:
        if isinstance(designs, Space):
            found = sample(target, designs, count, opened, keep=keep, progress=progress)
        else:
            found = search(target, designs, opened, keep=keep, progress=progress)
        if built and found.front:
            chosen = recommended(
                name, found, out, opened, keep=keep, sliced=sliced, step=lambda role: progress(role, 0, 1)
            )  # fmt: skip
    answer = result(name, found, chosen)
    store.replace(out / f"{name}.html", page(answer).encode())
    store.replace(out / f"{name}.json", document.to_json(answer).encode())
    store.replace(out / f"{name}.csv", "".join(answer.csv()).encode())
    return answer
