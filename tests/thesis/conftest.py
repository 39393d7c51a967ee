"""One computation of everything for all tests of this folder."""

import shutil
from contextlib import contextmanager, suppress

import pytest

from sensorgen.prediction import compression
from sensorgen.verification import thesis


@contextmanager
def _without_tops():
    """No cell is pressed by other tops, too, which no item of the thesis looks at."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(compression, "_under_tops", lambda *_: ())
        yield


@pytest.fixture(autouse=True, scope="module")
def _no_tops():
    with _without_tops():
        yield


@pytest.fixture(scope="session")
def rows():
    """All items; what takes seconds is kept with the predictions of this run."""
    with _without_tops():
        return thesis.rows()


@pytest.fixture(scope="session")
def cache(rows, session_cache, tmp_path_factory):
    """Folder that has what was solved for ``rows``, for tests that plant faults: theirs are kept there."""
    folder = tmp_path_factory.mktemp("thesis") / "cache"
    with suppress(shutil.Error):  # what another process is writing
        shutil.copytree(session_cache, folder)
    return str(folder)
