"""The best printed sensor of triangles, and how fast a space is searched: writes bench/results/optimise.md.

CPU time counts, of this process and its workers: the machine may be busy. ``python bench/optimise.py front`` searches
the space of bench/best-tri.yaml; ``engine`` compares one process, two, and Dask with two workers on equal works.
"""

import os
import sys
import time
from pathlib import Path

from sensorgen.workflows.optimise.search import Workers, search
from sensorgen.workflows.optimise.space import candidates
from sensorgen.workflows.optimise.target import load

TARGET = Path(__file__).parent / "best-tri.yaml"


def cpu_s():
    """Of this process and its finished workers [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def front(jobs):
    target = load(TARGET)
    begun, wall = cpu_s(), time.perf_counter()
    found = search(target, candidates(target), Workers(jobs))
    yield f"{len(found.rows)} designs, {len(found.evaluated)} evaluated: {cpu_s() - begun:.0f} s of CPU, "
    yield f"{time.perf_counter() - wall:.0f} s of wall"
    yield from (f"{count} {why} ({'certified' if proof else 'by the models'})" for why, proof, count in found.reasons())
    for row in found.front:
        numbers = row.trial.printed
        yield f"{row.candidate.values}: {numbers.force_resolution.words()}, {numbers.position_resolution.words()}"


def work(count):
    """A second or so of arithmetic."""
    total = 0.0
    for k in range(count):
        total += k**0.5
    return total


def engine():
    """Wall times of the same works by one process, by two, and by a Dask cluster of two workers."""
    from distributed import LocalCluster

    from sensorgen.core.parallel import in_parallel

    works = [(3_000_000,)] * 24

    def spent(jobs, cluster=""):
        wall, cpu = time.perf_counter(), cpu_s()
        list(in_parallel(work, works, jobs, cluster=cluster))
        return time.perf_counter() - wall, cpu_s() - cpu

    yield "one process: {:.1f} s of wall, {:.1f} s of CPU".format(*spent(1))
    yield "two processes: {:.1f} s of wall, {:.1f} s of CPU".format(*spent(2))
    cpu = cpu_s()
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        yield f"Dask, two workers: {spent(2, cluster.scheduler_address)[0]:.1f} s of wall"
    yield f"with starting and ending them {cpu_s() - cpu:.1f} s of CPU; load {os.getloadavg()[0]:.1f}"


if __name__ == "__main__":
    for line in engine() if "engine" in sys.argv else front(2):
        print(line, flush=True)
