"""A log of its own for each test, and the command line on it."""

from functools import partial
from pathlib import Path

import pytest

from in_process import captured
from sensorgen.measure.log import Log

HERE = Path(__file__).parent


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
    return partial(captured, capfd, monkeypatch, "log")
