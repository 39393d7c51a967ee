"""One computation of everything for all tests of this folder."""

import shutil
from contextlib import contextmanager, suppress

import pytest

from sensorgen.prediction import compression
from sensorgen.verification import thesis

# Rectangular cell, film 0.1 mm, by press3d: solved anew by night (test_reproduced); tests/models/test_press3d.py guards
# the solver by day.
RECT = compression.CompressionResult(
    design="rect", body="drawn", model="press3d", stress_kpa=(0.0, 100.0), displacement_um=(0.0, 6.600351690538338),
    lower_f_per_m2=(2.0275862456669025e-07, 2.0482512868169926e-07),
    upper_f_per_m2=(2.0344939967780471e-07, 2.0560759081421425e-07),
)  # fmt: skip
solved = compression.answer


def _stored(body, asked):
    """Curve of the rectangular cell, or one that is solved."""
    p = body.design.params
    return RECT if (body.design.shape, p.dielectric_mm) == ("rect", 0.1) else solved(body, asked)


@contextmanager
def _pressed_once():
    """No cell is pressed by other tops, too, which no item of the thesis looks at, and none in three dimensions."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(compression, "_under_tops", lambda *_: ())
        monkeypatch.setattr(compression, "answer", _stored)
        yield


@pytest.fixture(autouse=True, scope="module")
def _presses():
    with _pressed_once():
        yield


@pytest.fixture(scope="session")
def rows():
    """All items; what takes seconds is kept with the predictions of this run."""
    with _pressed_once():
        return thesis.rows()


@pytest.fixture(scope="session")
def cache(rows, session_cache, tmp_path_factory):
    """Folder that has what was solved for ``rows``, for tests that plant faults: theirs are kept there."""
    folder = tmp_path_factory.mktemp("thesis") / "cache"
    with suppress(shutil.Error):  # what another process is writing
        shutil.copytree(session_cache, folder)
    return str(folder)
