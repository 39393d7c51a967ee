"""Print the size of the code, package by package: `make size`, or `python scripts/size.py [FOLDER]`.

A code line is one that holds a token which is neither a comment nor part of a docstring. The length of a function
counts its code lines, signature included; a function inside another counts in both.
"""

import ast
import io
import sys
import tokenize
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[1] / "src" / "sensorgen"
GOAL = {"code": 20_000, "per_function": "14 to 16", "longest": 45}
SILENT = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER,
    tokenize.ENCODING,
}  # fmt: skip
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@dataclass(frozen=True)
class Module:
    """One file: its code lines, and name and code lines of each of its functions."""

    path: Path
    code: int
    functions: dict[str, int]

    @property
    def per_function(self) -> float:
        """Code lines of the file over its number of functions."""
        return self.code / len(self.functions)


def _docstring_lines(tree: ast.Module) -> set[int]:
    lines: set[int] = set()
    for node in ast.walk(tree):
        if (
            isinstance(node, (ast.Module, ast.ClassDef, *FUNCTIONS))
            and ast.get_docstring(node, clean=False) is not None
        ):
            first = node.body[0]
            lines.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return lines


def module(path: Path) -> Module:
    """Measure one file."""
    text = path.read_text("utf-8")
    tree = ast.parse(text)
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in SILENT:
            code.update(range(token.start[0], token.end[0] + 1))
    code -= _docstring_lines(tree)
    functions = {}
    for node in ast.walk(tree):
        if isinstance(node, FUNCTIONS):
            lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
            functions[f"{path.stem}.{node.name}:{node.lineno}"] = len(code & set(lines))
    return Module(path, len(code), functions)


def packages(root: Path) -> dict[str, list[Module]]:
    """Measured files of every package below a folder; files of the folder itself under its name."""
    found: dict[str, list[Module]] = defaultdict(list)
    for path in sorted(root.rglob("*.py")):
        parts = path.relative_to(root).parts
        found[parts[0] if len(parts) > 1 else "(top)"].append(module(path))
    return dict(found)


def row(name: str, modules: list[Module]) -> str:
    """One line of the table."""
    functions = {name: lines for one in modules for name, lines in one.functions.items()}
    usual = [one.per_function for one in modules if one.functions]
    longest = max(functions, key=functions.__getitem__, default="")
    return (
        f"| {name} | {len(modules)} | {sum(one.code for one in modules)} | {len(functions)} "
        f"| {median(usual) if usual else 0:.1f} | {functions.get(longest, 0)} {longest.split(':')[0]} |"
    )


def table(root: Path) -> str:
    """Markdown table: packages by size, then the sum."""
    measured = packages(root)
    by_size = sorted(measured, key=lambda name: -sum(one.code for one in measured[name]))
    everything = [one for modules in measured.values() for one in modules]
    head = "| package | files | code lines | functions | code lines per function, median of files | longest function |"
    rows = [row(name, measured[name]) for name in by_size]
    goal = f"| goal | | {GOAL['code']} | | {GOAL['per_function']} | {GOAL['longest']} |"
    return "\n".join([head, "|---|---|---|---|---|---|", *rows, row("**all**", everything), goal])


if __name__ == "__main__":
    print(table(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT))
