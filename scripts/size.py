"""Measure the size of the code against `budget.tsv`: `make size`; `--check` fails where a line is not kept.

`--check` also runs the commands whose modules are counted (quarter of a minute). `--lower` writes today's figures into
the lines that are above them. `--seconds USER SYSTEM` compares the processor seconds of a test run with their line.

A code line has a token that is neither a comment nor part of a docstring.
"""

import argparse
import ast
import csv
import io
import os
import re
import subprocess
import sys
import tempfile
import tokenize
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUDGET = ROOT / "budget.tsv"
SLACK = 0.02  # a figure further below its line is a line to lower
SECONDS = "tests: processor seconds"  # measured by .ci/run; differs from run to run, so only the line above counts
PACKAGES = "code lines: all packages"
SILENT = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER,
    tokenize.ENCODING,
}  # fmt: skip
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
HEADLESS = re.compile(r"(What|Whether|How|Who|Which|The same|Its)\b")
READINGS = (
    ["log", "add", "23 triX .1mm", "--y", "0.65k", "--z", "OL"],
    ["log", "add", "23 triX .2mm", "--y", "0.7k", "--z", "OL"],
)
LINE = """rest,re_ohm_1.1kHz,im_ohm_1.1kHz,re_ohm_99.7kHz,im_ohm_99.7kHz
1,9000,-2100000,3000,-23500
0,9000,-2000000,3000,-23000
"""
COMMANDS = {
    "build tri --no-cad": [],
    "predict tri": [],
    "invert tri measured.csv": [],
    "report --iteration 23": READINGS,
}


@dataclass(frozen=True)
class Row:
    """Line of the budget: name of the figure, its limit, the final budget if there is one, and why it rose."""

    name: str
    line: int
    goal: str
    why: str


def budget(text: str) -> dict[str, Row]:
    """Rows of a budget by name."""
    rows = csv.DictReader(io.StringIO(text), delimiter="\t")
    return {row["figure"]: Row(row["figure"], int(row["line"]), row["goal"] or "", row["why"] or "") for row in rows}


def written(rows: dict[str, Row]) -> str:
    """Text of a budget."""
    lines = ("\t".join((row.name, str(row.line), row.goal, row.why)) for row in rows.values())
    return "\n".join(("figure\tline\tgoal\twhy", *lines)) + "\n"


def docstrings(tree: ast.Module) -> Iterator[ast.Expr]:
    """Docstrings of a module, its classes and functions."""
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            yield node.body[0]


def code_lines(text: str) -> int:
    """Number of lines that are neither blank, comment nor docstring."""
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in SILENT:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in docstrings(ast.parse(text)):
        code -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(code)


def package(path: Path) -> str:
    """Package of a file below src: of sensorgen the second level, of another import package the first."""
    top, *below = path.parts
    return top if top != "sensorgen" else below[0] if len(below) > 1 else "(top)"


def of_sources(source: Path) -> Counter[str]:
    """Figures that are counted in the files below a folder."""
    from radon.complexity import cc_visit

    figures: Counter[str] = Counter()
    classes: Counter[str] = Counter()
    for path in sorted(source.rglob("*.py")):
        text = path.read_text("utf-8")
        tree = ast.parse(text)
        lines = code_lines(text)
        figures[f"code lines: {package(path.relative_to(source))}"] += lines
        figures[PACKAGES] += lines
        complexities = [block.complexity for block in cc_visit(text) if block.letter in "FM"]  # functions and methods
        figures["functions of complexity above 10"] += sum(one > 10 for one in complexities)
        figures["functions of complexity above 20"] += sum(one > 20 for one in complexities)
        figures["docstrings without a noun or verb at their head"] += sum(
            bool(HEADLESS.match(node.value.value.lstrip())) for node in docstrings(tree)
        )
        classes.update(node.name for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    figures["class names used twice"] = sum(count > 1 for count in classes.values())
    return figures


def circles(source: Path) -> list[list[str]]:
    """Groups of modules that import each other, imports in functions and for type checking included."""
    import grimp
    import numpy as np
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    graph = grimp.build_graph(*(path.parent.name for path in sorted(source.glob("*/__init__.py"))), cache_dir=None)
    modules = sorted(graph.modules)
    number = {name: k for k, name in enumerate(modules)}
    arrows = [(number[a], number[b]) for a in modules for b in graph.find_modules_directly_imported_by(a)]
    matrix = csr_array((np.ones(len(arrows)), np.transpose(arrows)), shape=(len(modules), len(modules)))
    group = connected_components(matrix, connection="strong")[1]
    members = ([modules[k] for k in np.flatnonzero(group == g)] for g in range(group.max() + 1))
    return [names for names in members if len(names) > 1]


def words(root: Path) -> int:
    """Words of README, CONTRIBUTING and all pages of the documentation."""
    pages = [root / "README.md", root / "CONTRIBUTING.md", *(root / "docs").rglob("*.md")]
    return sum(len(page.read_text("utf-8").split()) for page in pages)


def loaded(command: str) -> int:
    """Modules of this project that a command loads, its processes included, from an empty cache and log.

    Raises
    ------
    RuntimeError
        The command ends with an error.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        kept = {f"SENSORGEN_{name.upper()}": str(place / name) for name in ("cache", "log", "materials", "packs")}
        environment = {**os.environ, **kept, "SENSORGEN_BUDGET": "0", "SENSORGEN_SLICER": "none", "BROWSER": "true"}
        (place / "measured.csv").write_text(LINE, "utf-8")
        run = [sys.executable, "-m", "sensorgen"]
        for before in COMMANDS[command]:
            subprocess.run([*run, *before], cwd=place, env=environment, check=True, stdout=subprocess.DEVNULL)
        with (place / "imports").open("a+") as imports:  # appended to by every process of the command
            environment["PYTHONPROFILEIMPORTTIME"] = "1"
            ended = subprocess.run(
                [*run, *command.split()],
                cwd=place,
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=imports,
                check=False,
            )
        text = (place / "imports").read_text("utf-8")
        if ended.returncode not in (0, 1):  # 1: findings
            raise RuntimeError(f"sensorgen {command}: exit code {ended.returncode}: {text[-300:]}")
        return len(set(re.findall(r"\| +((?:sensorgen|fieldbounds|sensorlab)[\w.]*)$", text, re.MULTILINE)))


def of_runs() -> dict[str, int]:
    """Modules that each command loads."""
    with ThreadPoolExecutor(2) as pool:
        return {
            f"modules loaded: {name}": count for name, count in zip(COMMANDS, pool.map(loaded, COMMANDS), strict=True)
        }


def faults(rows: dict[str, Row], figures: dict[str, int]) -> Iterator[str]:
    """Lines that are not kept."""
    for name in sorted(figures.keys() - rows.keys()):
        yield f"{name}: {figures[name]}, no line in budget.tsv: add one, with a reason under `why`"
    for name in sorted(rows.keys() - figures.keys() - {SECONDS}):
        yield f"{name}: line {rows[name].line}, but there is no such figure any more: remove the line"
    for name in sorted(rows.keys() & figures.keys()):
        line, figure = rows[name].line, figures[name]
        if figure > line:
            yield f"{name}: {figure}, line {line}: take out {figure - line}, or raise it with a reason under `why`"
        elif name != SECONDS and figure < line * (1 - SLACK):
            yield f"{name}: {figure}, line {line}: lower the line (make size ARGS=--lower)"


def raises(rows: dict[str, Row], earlier: list[dict[str, Row]]) -> Iterator[str]:
    """Lines above an earlier version of the budget whose reason is missing, or was there already."""
    for name, row in rows.items():
        for before in earlier:
            was = before.get(name, Row(name, 0, "", ""))
            if row.line > was.line and row.why in ("", was.why):
                yield f"{name}: raised from {was.line} to {row.line} without a reason of its own under `why`"
                break


def versions() -> list[dict[str, Row]]:
    """Budgets of the commits so far."""
    git = ["git", "-C", str(ROOT)]
    log = subprocess.run([*git, "log", "--format=%H", "--", BUDGET.name], capture_output=True, text=True, check=False)
    shown = (
        subprocess.run([*git, "show", f"{commit}:{BUDGET.name}"], capture_output=True, text=True, check=False).stdout
        for commit in log.stdout.split()
    )
    return [budget(text) for text in shown if text]


def table(rows: dict[str, Row], figures: dict[str, int]) -> str:
    """Figure, line and final budget of each."""
    width = max(map(len, [*rows, *figures]))
    lines = [f"{'':{width}}  figure    line    goal"]
    for name in [*rows, *sorted(figures.keys() - rows.keys())]:
        row = rows.get(name, Row(name, 0, "", ""))
        lines.append(f"{name:{width}}  {figures.get(name, '-'):>6}  {row.line:>6}  {row.goal:>6}  {row.why}".rstrip())
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Print the table, check the lines, lower them, or hold the seconds of a test run against their line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="exit code 1 where a line is not kept")
    parser.add_argument("--lower", action="store_true", help="write today's figures into the lines above them")
    parser.add_argument(
        "--seconds", type=float, nargs="+", help="processor seconds of a test run, in parts: they alone"
    )
    chosen = parser.parse_args(arguments)
    sys.path.insert(0, str(ROOT / "src"))
    rows = budget(BUDGET.read_text("utf-8"))
    if chosen.seconds is not None:
        rows = {SECONDS: rows[SECONDS]}
        figures = {SECONDS: round(sum(chosen.seconds))}
    else:
        figures = {
            **of_sources(ROOT / "src"),
            "import circles": len(circles(ROOT / "src")),
            "words of the docs": words(ROOT),
        }
        figures |= of_runs()
    if chosen.lower:
        rows = {name: replace(row, line=min(row.line, figures.get(name, row.line))) for name, row in rows.items()}
        BUDGET.write_text(written(rows), "utf-8")
    wrong = [*faults(rows, figures), *raises(rows, [] if chosen.seconds else versions())]
    if not chosen.check or wrong:
        print(table(rows, figures))
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return int(bool(wrong) and (chosen.check or chosen.seconds is not None))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
