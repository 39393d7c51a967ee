"""Real slicers for the tests of this folder."""

import pytest


@pytest.fixture
def prusa_slicer(program) -> str:
    """Path of PrusaSlicer."""
    return program("prusa-slicer", "prusa-slicer")


@pytest.fixture
def cura_engine(program) -> str:
    """Path of CuraEngine."""
    return program("cura-engine cura", "CuraEngine")
