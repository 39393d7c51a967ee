"""One computation of everything for all tests of this folder."""

import shutil
from contextlib import suppress

import pytest

from sensorgen.verification import thesis


@pytest.fixture(scope="session")
def rows():
    """All items; what takes seconds is kept with the predictions of this run."""
    return thesis.rows()


@pytest.fixture(scope="session")
def cache(rows, session_cache, tmp_path_factory):
    """Folder that has what was solved for ``rows``, for tests that plant faults: theirs are kept there."""
    folder = tmp_path_factory.mktemp("thesis") / "cache"
    with suppress(shutil.Error):  # what another process is writing
        shutil.copytree(session_cache, folder)
    return str(folder)
