"""Logs that reports are made of, once for all tests."""

import os

import bench_files
import pytest

from sensorgen.analysis.report import report
from sensorgen.design.specimen_name import design_of, parse
from sensorgen.measure.log import Log, bench, exchange, notes
from sensorgen.measure.log.prints import predicted_rows


@pytest.fixture(autouse=True, scope="session")
def _materials(tmp_path_factory):
    """No test finds a source that the user has kept, or leaves one."""
    before = os.environ.get("SENSORGEN_MATERIALS")
    os.environ["SENSORGEN_MATERIALS"] = str(tmp_path_factory.mktemp("materials"))
    yield
    os.environ.pop("SENSORGEN_MATERIALS") if before is None else os.environ.update(SENSORGEN_MATERIALS=before)


@pytest.fixture(scope="session")
def thesis(tmp_path_factory):
    """The log of Table D.1."""
    path = tmp_path_factory.mktemp("thesis") / "log.db"
    with Log(path, create=True) as log:
        exchange.thesis(log)
    return path


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """Two specimens of one design whose truth is known, recorded and read; a prediction stored before; bad words."""
    folder = tmp_path_factory.mktemp("recorded")
    names = ["30 triX .1mm", *(f"30 triX .1mm {k}" for k in (2, 3, 4))]
    design = design_of(parse(names[0]))
    sensor = bench_files.truth(design, **bench_files.TRUTH)
    with Log(folder / "log.db", create=True) as log:
        log.add(predicted_rows(design))
        for k, name in enumerate(names[:2]):
            files = bench_files.write(folder, f"run{k}", sensor, count=7, seed=k + 1)
            bench.log_recording(log, name, *files, remark=bench_files.HOSTILE)
        log.add([notes.reading(name, "1.2k", "OL", remark=bench_files.HOSTILE) for name in names[:2]])
        log.add([notes.reading(name, "1.25k / 1.4k", "2.5M", remark=bench_files.FORMULA) for name in names[2:]])
    return folder / "log.db"


@pytest.fixture(scope="session")
def of_recorded(recorded):
    with Log(recorded) as log:
        return report(log, 30)
