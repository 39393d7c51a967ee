"""One process that forks for the commands of all tests of this folder."""

import pytest
from child import Forks


@pytest.fixture(scope="session")
def forked():
    """Run a command in a process of its own with little memory."""
    forks = Forks()
    yield forks
    forks.process.communicate(timeout=60)
