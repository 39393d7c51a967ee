"""Plant the faults of tests/mutants.yaml one at a time, and run the tests that guard against each: `make mutants`.

Usage: ``python scripts/mutants.py [PACKAGE or FILE ...]``, as ``checks`` or ``models/columns.py``; all without a name.

cosmic-ray and mutmut are not used, and were not tried: they make thousands of faults by syntax and run one set of tests
for all, where each of these is a slip that a refactoring could make, with its own test of a few seconds.
"""

import compileall
import os
import py_compile
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
LIST, PAGE = ROOT / "tests" / "mutants.yaml", ROOT / "bench" / "results" / "mutants.md"
GOAL = 57  # of 60
LIMIT_S = 300
LEFT_OUT = (".venv", ".git", "out", "dist", "__pycache__", ".*_cache", ".hypothesis")
FAILED = re.compile(r"^(?:FAILED|ERROR) ([^\s\[]+)", re.MULTILINE)
PYTEST = (sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not nightly")


@dataclass(frozen=True)
class Fault:
    """A text that occurs once in a file of src/sensorgen, one in its place, and tests as pytest's arguments.

    ``missed`` says why no test finds it, where none does.
    """

    file: str
    old: str
    new: str
    fault: str
    tests: str
    missed: str = ""

    @property
    def package(self) -> str:
        """Package of sensorgen."""
        return self.file.partition("/")[0]

    def planted(self, text: str) -> str:
        """Text of the file with the fault."""
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file}: {self.old!r} occurs {text.count(self.old)} times; expected once")
        return text.replace(self.old, self.new)


@dataclass(frozen=True)
class Result:
    """Outcome of a fault, "found", "missed", "tests broken" or "no end", the test that found it, and time [s]."""

    fault: Fault
    outcome: str
    by: str
    seconds: float


def listed() -> tuple[list[Fault], list[str]]:
    """Faults and remarks of the list."""
    data: dict[str, Any] = yaml.safe_load(LIST.read_text("utf-8"))
    return [Fault(**each) for each in data["faults"]], data["notes"]


def run(tests: str, tree: Path) -> tuple[str, str, float]:
    """Outcome of some tests in a tree, "passed", "failed" or "no end", the test that failed, and their time [s]."""
    start = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
    try:
        done = subprocess.run(
            [*PYTEST, *shlex.split(tests)], cwd=tree, env=environment, timeout=LIMIT_S, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        return "no end", "", time.monotonic() - start
    by = FAILED.search(done.stdout)
    return "failed" if done.returncode else "passed", by[1] if by else "", time.monotonic() - start


def tried(fault: Fault, tree: Path, sound: dict[str, str]) -> Result:
    """Plant a fault and run its tests; ``sound`` keeps outcomes of tests without a fault."""
    if fault.tests not in sound:
        sound[fault.tests] = run(fault.tests, tree)[0]
    if sound[fault.tests] != "passed":
        return Result(fault, "tests broken", "", 0.0)
    path = tree / "src" / "sensorgen" / fault.file
    text = path.read_text("utf-8")
    try:
        path.write_text(fault.planted(text), "utf-8")
        outcome, by, seconds = run(fault.tests, tree)
    finally:
        path.write_text(text, "utf-8")
    return Result(fault, {"failed": "found", "passed": "missed"}.get(outcome, outcome), by, seconds)


def page(results: list[Result], notes: list[str], seconds: float) -> str:
    """The results as Markdown."""
    found = sum(r.outcome == "found" for r in results)
    lines = ["# Planted faults", "", *(__doc__ or "").strip().splitlines()[4:], ""]
    lines += [f"{found} of {len(results)} found (goal {GOAL}), in {seconds / 60:.0f} min.", ""]
    lines += [*(f"- {note}" for note in notes), ""]
    lines += ["| package | file | fault | tests | outcome | s |", "|---|---|---|---|---|---|"]
    for r in results:
        cells = (
            r.fault.package,
            r.fault.file.partition("/")[2],
            r.fault.fault,
            f"`{r.by or r.fault.tests}`",
            r.outcome,
        )
        lines.append(f"| {' | '.join(cells)} | {r.seconds:.0f} |")
    missed = [f"- {r.fault.file}, {r.fault.fault}: {r.fault.missed}" for r in results if r.outcome != "found"]
    return "\n".join([*lines, *(["", "Not found:", "", *missed] if missed else [])]) + "\n"


def main(names: list[str]) -> int:
    """Plant the faults of some packages or files, or all; exit code 1 if too many are missed, 2 at an unknown name."""
    faults, notes = listed()
    packages, files = {f.package for f in faults}, {f.file for f in faults}
    if unknown := set(names) - packages - files:
        print(
            f"no fault in {', '.join(sorted(unknown))}; expected a file named in {LIST.relative_to(ROOT)},",
            file=sys.stderr,
        )
        print(f"or one of the packages {', '.join(sorted(packages))}", file=sys.stderr)
        return 2
    chosen = [f for f in faults if not names or {f.package, f.file} & set(names)]
    sound, results, start = dict[str, str](), list[Result](), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(*LEFT_OUT))
        # By content: a fault is planted within the second that file systems tell apart
        compileall.compile_dir(tree / "src", quiet=1, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)
        for number, fault in enumerate(chosen, 1):
            result = tried(fault, tree, sound)
            results.append(result)
            line = f"{number}/{len(chosen)} {result.outcome:12} {result.seconds:4.0f} s  {fault.file}: {fault.fault}"
            print(f"{line}  {result.by}".rstrip(), flush=True)
    if not names:
        PAGE.write_text(page(results, notes, time.monotonic() - start), "utf-8")
    found = sum(r.outcome == "found" for r in results)
    print(f"{found} of {len(chosen)} found")
    return int(found < (len(chosen) if names else GOAL))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
