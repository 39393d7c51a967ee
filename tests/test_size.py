"""Code lines are what is neither blank, comment nor docstring."""

import runpy
from pathlib import Path

size = runpy.run_path(str(Path(__file__).parents[1] / "scripts" / "size.py"))
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


def test_lines_and_functions_are_counted(tmp_path):
    path = tmp_path / "package" / "a.py"
    path.parent.mkdir()
    path.write_text(TEXT, "utf-8")
    (found,) = size["packages"](tmp_path)["package"]
    assert found.code == 10  # import, class, def, text (2), inner (2), return (3)
    assert sorted(found.functions.values()) == [2, 8]
    assert "| package | 1 | 10 | 2 | 5.0 | 8 a.f |" in size["table"](tmp_path)
