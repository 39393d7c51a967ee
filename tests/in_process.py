"""Run a command in this process."""

import contextlib
import io
import json
import sys
from dataclasses import dataclass

import pytest

from sensorgen.cli import main


@dataclass(frozen=True)
class Said:
    """Exit code of a command, and its output and errors."""

    code: int
    out: str
    err: str

    @property
    def words(self):
        """The output without its line breaks and columns."""
        return " ".join(self.out.split())

    @property
    def json(self):
        """The output as data."""
        return json.loads(self.out)

    @property
    def ok(self):
        """The command has ended well."""
        assert self.code == 0, self.err
        return self

    @property
    def clean(self):
        """It has ended well, and told nothing on stderr."""
        assert (self.code, self.err) == (0, "")
        return self

    @property
    def refusal(self) -> str:
        """The line of wrong input."""
        assert self.code == 2, self.out
        return self.line

    @property
    def line(self) -> str:
        """The one line on stderr; anything else there is a fault."""
        assert self.err.count("\n") == 1, self.err
        assert self.err.startswith("sensorgen: "), self.err
        assert "Traceback" not in self.out + self.err
        return self.err.strip()


def captured(capfd, monkeypatch, *words) -> Said:
    """Result of a command, by the descriptors: of libraries and of processes that it started, too."""
    monkeypatch.setattr(sys, "argv", ["sensorgen", *map(str, words)])
    capfd.readouterr()
    with pytest.raises(SystemExit) as left:
        main()
    return Said(left.value.code, *capfd.readouterr())


def run(folder, *words):
    """Exit code and standard output of a command in a folder."""
    return run_all(folder, *words)[:2]


def run_all(folder, *words):
    """Exit code, standard output and errors of a command in a folder."""
    argv, out, err = sys.argv, io.StringIO(), io.StringIO()
    sys.argv = ["sensorgen", *words]
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as left:
        assert "Traceback" not in err.getvalue()
        return left.code, out.getvalue(), err.getvalue()
    finally:
        sys.argv = argv
