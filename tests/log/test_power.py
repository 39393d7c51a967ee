"""Loss of power: nothing that was acknowledged may still be on its way to the disk."""

import os
import sys
from pathlib import Path

import made
import pytest
import scipy.io

from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import log_recording

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asks the kernel for the names of open files")


@pytest.fixture
def pending(monkeypatch):
    """Names and contents that a loss of power would take: every change of a folder until that folder is synced."""
    found: set[str] = set()

    def naming(name):
        real = getattr(os, name)

        def call(*args, **how):
            real(*args, **how)
            found.add(str(Path(args[-1] if name != "mkdir" else args[0]).absolute().parent))
            if name != "mkdir":
                assert f"synced {Path(args[0]).absolute()}" in synced, "it has its name before its content is safe"

        monkeypatch.setattr(os, name, call)

    synced: set[str] = set()

    def fsync(handle, real=os.fsync):
        real(handle)
        path = str(Path(f"/proc/self/fd/{handle}").readlink())
        found.discard(path)
        synced.add(f"synced {path}")

    for name in ("mkdir", "replace", "link"):
        naming(name)
    monkeypatch.setattr(os, "fsync", fsync)
    return found


def test_everything_is_on_the_disk_before_it_is_acknowledged(tmp_path, pending):
    run = made.run(made.presses(2), rate_hz=70)
    tree = made.tree([run.impedance_ohm], [run.time_s], made.stamps(run.time_s))
    scipy.io.savemat(tmp_path / "run.mat", tree)
    with Log(tmp_path / "new" / "place" / "log.db", create=True) as log:
        assert not pending
        real = log.add

        def add(entries):
            assert not pending  # what a row names is there before the row
            return real(entries)

        log.add = add
        assert log_recording(log, "26 triX .1mm", tmp_path / "run.mat")
        assert not pending
