"""The size of the code is counted as budget.tsv means it, and a line that is not kept is found."""

import runpy
import subprocess
from pathlib import Path

import pytest

size = runpy.run_path(str(Path(__file__).parents[1] / "scripts" / "size.py"))
Row = size["Row"]
TEXT = '''"""Module."""

# a comment
import os  # counted once


class A:
    """A class."""

    def f(self, x):
        """A method,

        explained.
        """
        text = """two
        lines"""

        def inner():
            return text

        return (
            x,  # three lines
        )
'''
COMPLEX = "\n\ndef f(x):\n    return [" + " or ".join(f"x == {k}" for k in range(11)) + "]\n"
COMPREHENDED = (
    "\n\ndef f(x):\n    return " + " + ".join(f"[{k} for k in x]" for k in range(11)) + "\n"
)  # not of ruff's C901


def _source(folder, **planted):
    for name, text in {"a": "", "b": "", **planted}.items():
        path = folder / "sensorgen" / name / "file.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(TEXT + text, "utf-8")
    return size["of_sources"](folder)


def test_what_is_counted(tmp_path):
    assert size["code_lines"](TEXT) == 10  # import, class, def, text (2), inner (2), return (3)
    figures = _source(tmp_path)
    assert (figures["code lines: a"], figures["code lines: all packages"]) == (10, 20)
    assert figures["class names used twice"] == 1


def test_packages_of_several_import_packages():
    assert [size["package"](Path(p)) for p in ("sensorgen/core/a.py", "sensorgen/a.py", "other/sub/a.py")] == [
        "core", "(top)", "other",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "figure"),
    [
        ("\nfirst = 1\n", "code lines: a"),
        (COMPLEX, "functions of complexity above 10"),
        (COMPREHENDED, "functions of complexity above 10"),
        ('\n\ndef f():\n    """What is said."""\n', "docstrings without a noun or verb at their head"),
        ('\n\nclass B:\n    """The same as A."""\n', "docstrings without a noun or verb at their head"),
    ],
)
def test_what_is_planted_in_one_package_is_found(tmp_path, text, figure):
    before = _source(tmp_path)
    rows = {name: Row(name, line, "", "") for name, line in before.items()}
    assert not list(size["faults"](rows, before))
    wrong = list(size["faults"](rows, _source(tmp_path, a=text)))
    assert any(one.startswith(f"{figure}: ") for one in wrong)


def test_figures_within_two_percent_of_their_line_pass():
    faults = size["faults"]
    rows = {"lines": Row("lines", 100, "", "")}
    assert [len(list(faults(rows, {"lines": figure}))) for figure in (97, 98, 100, 101)] == [1, 0, 0, 1]
    assert "no line" in next(faults(rows, {"lines": 100, "new": 1}))
    assert "remove the line" in next(faults(rows, {}))
    seconds = {size["SECONDS"]: Row(size["SECONDS"], 100, "", "")}
    assert [len(list(faults(seconds, {size["SECONDS"]: figure}))) for figure in (50, 100, 101)] == [0, 0, 1]


@pytest.mark.parametrize(
    ("line", "why", "refused"),
    [(100, "", False), (90, "", False), (103, "", True), (103, "old reason", True), (103, "a new model", False)],
)
def test_a_line_rises_for_a_new_reason_only(line, why, refused):
    earlier = [{"lines": Row("lines", 100, "", "old reason")}, {"lines": Row("lines", 110, "", "")}]
    assert bool(list(size["raises"]({"lines": Row("lines", line, "", why)}, earlier))) == refused


def test_earlier_budgets_come_from_the_commits(tmp_path, monkeypatch):
    for name, value in {"ROOT": tmp_path, "BUDGET": tmp_path / "budget.tsv"}.items():
        monkeypatch.setitem(size["versions"].__globals__, name, value)
    assert size["versions"]() == []  # no repository: as from an archive of the sources
    git = ["git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a"]
    subprocess.run([*git, "init", "-q"], check=True)
    for line in (3, 2):
        rows = {"lines": Row("lines", line, "", "")}
        (tmp_path / "budget.tsv").write_text(size["written"](rows), "utf-8")
        subprocess.run([*git, "add", "."], check=True)
        subprocess.run([*git, "commit", "-qm", "a"], check=True)
    assert [rows["lines"].line for rows in size["versions"]()] == [2, 3]


def test_modules_that_import_each_other_are_found(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "circular").mkdir()
    (tmp_path / "circular" / "__init__.py").write_text("")
    (tmp_path / "circular" / "a.py").write_text("def f():\n    from circular import b\n    return b\n")
    (tmp_path / "circular" / "b.py").write_text("from circular import a\n")
    (tmp_path / "circular" / "c.py").write_text("from circular import a\n")
    assert size["circles"](tmp_path) == [["circular.a", "circular.b"]]
