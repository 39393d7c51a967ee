"""One computation of everything for all tests of this folder."""

import pytest

from sensorgen.verification import thesis


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Folder that keeps what was solved for ``rows``."""
    return str(tmp_path_factory.mktemp("thesis"))


@pytest.fixture(scope="session")
def rows(cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SENSORGEN_CACHE", cache)
        return thesis.rows()
