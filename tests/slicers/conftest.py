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


@pytest.fixture
def prusa_version(request, program, newer_program):
    """Path of a PrusaSlicer: this machine's (``own``), or Debian 13's (``newer``)."""
    return program("prusa-slicer", "prusa-slicer") if request.param == "own" else newer_program("prusa-slicer")


@pytest.fixture
def cura_version(request, program, newer_program):
    """Path of a CuraEngine: this machine's (``own``), or Debian 13's (``newer``)."""
    return program("cura-engine cura", "CuraEngine") if request.param == "own" else newer_program("CuraEngine")
