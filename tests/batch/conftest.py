"""Batches for the tests: small plans, and one batch that is made once."""

from pathlib import Path

import pytest

from sensorgen.workflows.batch import make

SMALL = """\
iteration: 26
seed: 7
designs:
  - {shape: tri, parameters: {length_mm: 20, width_mm: 10}, replicates: 2}
  - {shape: reference, parameters: {length_mm: 20, width_mm: 10}}
filaments:
  etpu: {lot: PI-2026-014, drying: 65 C for 5 h}
bake: [{temperature_c: 150, hours: 24}]
"""


@pytest.fixture
def plan(tmp_path):
    """Write a plan; gives its path."""

    def write(text=SMALL, name="plan.yaml"):
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A batch of three small sensors, not sliced; read only."""
    here = tmp_path_factory.mktemp("small")
    path = here / "small.yaml"
    path.write_text(SMALL, "utf-8")
    return make(path, here / "out", gcode=False)


@pytest.fixture
def contents():
    """Every file below a folder, by its name there."""

    def read(folder: Path):
        return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}

    return read
