"""The best printed sensor of triangles, and how fast a space is searched.

``python bench/optimise.py engine`` (7 minutes on two quiet cores) compares one process, two, and Dask with two workers
on equal works, and writes the section Engine of bench/results/optimise.md; ``front`` searches the space of
bench/best-tri.yaml, ``full`` that of bench/tri-1500.yaml with two processes (half an hour).

Wall times need a machine that does nothing else. Works that only wait do not: they show what sending, starting and
collecting works costs, and how long workers are idle.
"""

import os
import sys
import tempfile
import textwrap
import time
from pathlib import Path
from statistics import mean, median

from sensorgen.core import cache
from sensorgen.core.parallel import in_parallel, open_lanes
from sensorgen.workflows.optimise import ladder
from sensorgen.workflows.optimise.front import Workers, search
from sensorgen.workflows.optimise.target import candidates, load

HERE = Path(__file__).parent
RESULTS = HERE / "results" / "optimise.md"
WORKS, ROUNDS, EVALUATED = 16, 3, 2
ENGINES = (("one process", "–"), ("two processes", 1.8), ("Dask, two workers", 1.6), ("`--jobs 1`", "–"))


def cpu_s():
    """Of this process and its finished workers [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def whole(file, jobs=2):
    """A space searched."""
    target = load(HERE / file)
    begun, wall = cpu_s(), time.perf_counter()
    found = search(target, candidates(target), Workers(jobs))
    yield f"{len(found.rows)} designs, {len(found.evaluated)} evaluated: {cpu_s() - begun:.0f} s of CPU, "
    yield f"{time.perf_counter() - wall:.0f} s of wall"
    yield from (f"{r.count} {r.why} ({'certified' if r.certified else 'by the models'})" for r in found.reasons())
    for row in found.front:
        numbers = row.trial.printed
        yield f"{row.values}: {numbers.force_resolution.words()}, {numbers.position_resolution.words()}"


def work(step, *given):
    """One step for a design, without a cache; the process, the CPU that it took, and that of the process so far [s]."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        os.environ[cache.PLACE] = folder
        step(*given)
    return os.getpid(), time.process_time() - begun, time.process_time()


def each_of(works, lanes):
    """Process, CPU, and CPU so far of each work."""
    return [one for _, one in in_parallel(work, works, 2 if lanes else 1, lanes=lanes)]


def spent(works, lanes):
    """Wall time of works, and mean CPU of one [s]."""
    wall = time.perf_counter()
    found = [cpu for _, cpu, _ in each_of(works, lanes)]
    return time.perf_counter() - wall, mean(found)


def waiting(lanes):
    """Gain of works that only wait."""
    wall = time.perf_counter()
    list(in_parallel(time.sleep, [(0.5,)] * WORKS, 2, lanes=lanes))
    return 0.5 * WORKS / (time.perf_counter() - wall)


def engine():
    """The section of the results' page."""
    from distributed import LocalCluster

    begun, target = time.perf_counter(), load(HERE / "best-tri.yaml")
    space = [one.design for one in candidates(target) if one.design]
    passed = [d for d in space if all(severity != "error" for _, severity in ladder.rules(d))]
    works = [(ladder.known, design, target.query(), True) for design in passed[:WORKS]]
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        open_lanes(2, cluster.scheduler_address) as dask, open_lanes(1) as one, open_lanes(2) as two,
    ):  # fmt: skip
        work(*works[0])  # all import the solvers before time is taken
        begin_s = max(so_far - each for _, each, so_far in each_of(works[:2], two))
        for lanes in (one, dask):
            each_of(works[:4], lanes)
        taken = [[spent(works, lanes) for lanes in (one, two, dask, ())] for _ in range(ROUNDS)]
        waited = [1.0, *(median(waiting(lanes) for _ in range(ROUNDS)) for lanes in (two, dask))]
        cost_s = {"design rules": [(ladder.rules, design) for design in space]}
        cost_s["evaluation"] = [(ladder.everything, d, target.query(), "") for d in passed[-EVALUATED:]]
        cost_s = {name: mean(cpu for _, cpu, _ in each_of(some, two)) for name, some in cost_s.items()}
    cost_s["coarse mesh"] = median(r[1][1] for r in taken)
    gains = [median(r[0][0] / r[k][0] for r in taken) for k in range(4)]
    waited.append(1.0)
    yield f"## Engine\n\n{len(works)} designs pressed on the coarse mesh, and {WORKS} works of 0.5 s that only wait; "
    yield f"medians of {ROUNDS} rounds; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.\n\n"
    yield "| | wall | CPU of one design | gain | gain of waiting works | goal |\n|---|---|---|---|---|---|\n"
    for k, (name, goal) in enumerate(ENGINES):
        wall_s, cpu_s_ = (median(r[k][n] for r in taken) for n in (0, 1))
        yield f"| {name} | {wall_s:.1f} s | {cpu_s_:.2f} s | {gains[k]:.2f} | {waited[k]:.2f} | {goal} |\n"
    costs = ", ".join(f"{name} {s:.2g} s" for name, s in cost_s.items())
    words = (
        "The gain of waiting works does not depend on the load: it is what sending works and collecting results leave. "
        f"A process begins with {begin_s:.1f} s of CPU, once for a search, and has one thread of BLAS; `--jobs 1` "
        "works in the program's own process, whose BLAS has a thread for each core.\n"
        f"One design of triX costs, of CPU: {costs}.\n"
        f"`python bench/optimise.py engine` writes this section, in {(time.perf_counter() - begun) / 60:.1f} minutes."
    )
    yield "".join(f"\n{textwrap.fill(each, 130, break_on_hyphens=False)}\n" for each in words.splitlines())


if __name__ == "__main__":
    if "engine" in sys.argv:
        before = RESULTS.read_text().partition("## Engine")[0]
        RESULTS.write_text(before + "".join(engine()))
        print(RESULTS.read_text().removeprefix(before))
    else:
        for line in whole("tri-1500.yaml" if "full" in sys.argv else "best-tri.yaml"):
            print(line, flush=True)
