"""A log of its own for each test, and the command line on it."""

import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from sensorgen.cli import main
from sensorgen.measure.log import Log

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Said:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def words(self):
        """The output without its line breaks and columns."""
        return " ".join(self.out.split())

    @property
    def line(self):
        """The one line on stderr; anything else there is a fault."""
        assert self.err.count("\n") == 1, self.err
        assert self.err.startswith("sensorgen: "), self.err
        return self.err.strip()


@pytest.fixture
def path(tmp_path, monkeypatch):
    """Where the log is, for the command line too."""
    monkeypatch.setenv("SENSORGEN_LOG", str(tmp_path / "log.db"))
    return tmp_path / "log.db"


@pytest.fixture
def log(path):
    """An empty log, open."""
    with Log(path, create=True) as log:
        yield log


@pytest.fixture
def run(capfd, monkeypatch, tmp_path, path):
    """Run a command of ``sensorgen log`` in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["sensorgen", "log", *map(str, words)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as left:
            main()
        return Said(left.value.code, *capfd.readouterr())

    return call
