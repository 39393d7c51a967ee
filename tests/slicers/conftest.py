"""Real slicers for the tests of this folder: skipped where they are missing, but never on CI."""

import os
import shutil

import pytest


def _needed(program: str, package: str) -> str:
    path = shutil.which(program)
    if path is not None:
        return path
    reason = f"{program} is not installed (Debian: apt install {package})"
    if os.environ.get("CI"):
        pytest.fail(f"{reason}; CI must have it")
    pytest.skip(reason)


@pytest.fixture
def prusa_slicer() -> str:
    """Path of PrusaSlicer."""
    return _needed("prusa-slicer", "prusa-slicer")


@pytest.fixture
def cura_engine() -> str:
    """Path of CuraEngine."""
    return _needed("CuraEngine", "cura-engine cura")
