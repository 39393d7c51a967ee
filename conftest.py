"""What the tests have to say besides passing, a cache of its own for each, and the programs that some of them run."""

import gc
import itertools
import os
import shutil
import signal
import sys
from contextlib import suppress
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line has it: on small matrices threads only wait
with suppress(ValueError):  # not in the main thread
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job would hand down a deaf ear


os.fsync = lambda _: None  # no test cuts the power; tests/log/test_power.py counts the calls

NUMBERS = itertools.count()


def _own_folders(monkeypatch, folder, cache=None):
    """Whatever the user, or another test, has kept is out of sight."""
    own = folder / str(next(NUMBERS))  # by its number: pytest would look at all those of ten thousand tests for each
    own.mkdir()
    monkeypatch.setenv("SENSORGEN_CACHE", str(cache or own / "cache"))
    monkeypatch.setenv("SENSORGEN_LOG", str(own / "log.db"))
    monkeypatch.setenv("BROWSER", "true")  # opens nothing
    monkeypatch.setenv("SENSORGEN_BUDGET", "0")  # changes of designs are tried by the tests of that alone
    monkeypatch.setattr("sensorgen.core.parallel.cores", lambda: 1)  # no process beside, but in the tests of that
    monkeypatch.setenv("SENSORGEN_SLICER", "none")  # verdicts by real slices are tested by those of that alone
    monkeypatch.setenv("SENSORGEN_MATERIALS", str(own / "materials"))
    monkeypatch.setenv("SENSORGEN_PACKS", str(own / "packs"))


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory):
    """Predictions of all test processes of this run, keyed as a user's are: by design, models and source code."""
    base = tmp_path_factory.getbasetemp()
    return (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "session-cache"


@pytest.fixture(autouse=True, scope="session")
def _folder(tmp_path_factory, session_cache):
    """Folder with what is each test's own; fixtures of modules, which are made before those of a test, have one too."""
    folder = tmp_path_factory.mktemp("own")
    with pytest.MonkeyPatch.context() as monkeypatch:
        _own_folders(monkeypatch, folder, session_cache)
        yield folder


@pytest.fixture(autouse=True)
def _cache(request, monkeypatch, _folder, session_cache):
    """A test that patches, or is marked `own_cache`, neither reads nor keeps predictions of others."""
    patches = "monkeypatch" in request.node._fixtureinfo.argnames and "shared_cache" not in request.fixturenames
    own = patches or request.node.get_closest_marker("own_cache")
    _own_folders(monkeypatch, _folder, None if own else session_cache)


@pytest.fixture
def shared_cache():
    """For a test that patches nothing that decides a prediction: it shares predictions, as tests without patches do."""


@pytest.fixture
def unpressed(monkeypatch, _cache):
    """No cross-section is pressed, which takes ten seconds: for tests that look at nothing that a load changes.

    Predictions without the mesher have a folder of their own.
    """
    from sensorgen.core.errors import NotInstalled
    from sensorgen.solvers.contact import mesher

    monkeypatch.setattr(mesher, "find_spec", {}.get)  # other programs may still import it
    monkeypatch.setenv("SENSORGEN_CACHE", str(Path(os.environ["SENSORGEN_CACHE"]) / "unpressed"))
    with pytest.raises(NotInstalled):
        mesher.check()


@pytest.fixture
def unpredicted(_cache):
    """No design is predicted: for tests of files that hold no number of a prediction, or none that they look at."""
    import no_numbers

    with no_numbers.unpredicted():
        yield


@pytest.fixture
def at_rest(unpressed):
    """No design is predicted under a load: for tests that look at capacitance, resistance and gap alone."""
    import no_numbers

    with no_numbers.at_rest():
        yield


@pytest.fixture
def roughly(_cache):
    """Predictions by closed forms and of no load: for tests of words, and of logs that hold a prediction."""
    import no_numbers

    with no_numbers.roughly_at_rest():
        yield


@pytest.fixture
def unpainted(monkeypatch):
    """No figure is painted: for tests that look at names of files, or at what stands beside the pictures.

    tests/test_plots.py, test_plots_bench.py and tests/report paint.
    """
    from sensorgen.analysis.plots import static

    content = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<svg/>"}
    monkeypatch.setattr(static, "_written", lambda *given: content[given[-1]])


@pytest.fixture(autouse=True, scope="module")
def one_kernel():
    """build123d and NGSolve bring two versions of one CAD kernel, which crash together: tests load one or the other."""
    yield
    assert not {"build123d", "ngsolve"} <= sys.modules.keys()


@pytest.fixture
def program():
    """Path of a program by the names that it may have; without it a test is skipped, but never on CI."""

    def path(package, *names):
        found = next(filter(None, map(shutil.which, names)), None)
        if found is None and os.environ.get("CI"):
            pytest.fail(f"{names[0]} is not installed, though scripts/system-packages --programs installs it")
        if found is None:
            pytest.skip(f"{names[0]} is not installed (Debian: apt install {package})")
        return found

    return path


@pytest.fixture(scope="session")
def _started(tmp_path_factory):
    """Browsers that run: one for all tests, and another where it has gone."""
    pages = []
    yield pages
    for page in pages:
        page.close()


@pytest.fixture
def browser(program, _started, tmp_path_factory):
    """A page of Chromium that nobody has used."""
    from browser import Page

    chromium = program("chromium", "chromium", "chromium-browser", "google-chrome")
    if not _started or _started[-1].process.poll() is not None:
        _started.append(Page(chromium, tmp_path_factory.mktemp("chromium")))
    _started[-1].renew()
    return _started[-1]


@pytest.fixture(scope="session")
def forked():
    """Run a command in a process of its own, see :class:`forks.Forks`."""
    from forks import Forks

    forks = Forks()
    yield forks
    forks.close()


@pytest.fixture
def newer_program():
    """Path of a slicer of Debian 13, newer than this machine's own; without it a test is skipped, but never on CI."""

    def path(name):
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        found = Path(os.environ.get("SENSORGEN_DEBIAN13") or cache / "sensorgen-debian13") / "bin" / name
        if not found.is_file() and os.environ.get("CI"):
            pytest.fail(f"{found} is missing, though scripts/debian13-slicers makes it")
        if not found.is_file():
            pytest.skip(f"{found} is missing (scripts/debian13-slicers makes it)")
        return str(found)

    return path


def pytest_terminal_summary(terminalreporter):
    """Print the printed volumes beside the solid ones, as the tests of the slicers recorded them."""
    rows = [
        value
        for reports in terminalreporter.stats.values()
        for report in reports
        for name, value in getattr(report, "user_properties", ())
        if name == "volumes"
    ]
    if rows:
        terminalreporter.section("extruded and exact volume per tool")
        for row in sorted(set(rows)):
            terminalreporter.write_line(row)


FIRST = (  # longest first, down to ten seconds of work or waiting: a worker that began one last would be left alone
    "report/test_browser", "test_fit", "cli/test_import_command", "cli/test_predict_command",
    "asprinted/test_compensation", "lab/test_faults", "lab/test_run", "cli/test_calibrate_command",
    "cli/test_characterise_command", "asprinted/test_real", "thesis/test_faults", "cli/test_compress_command",
    "test_invert", "test_compression_error", "cli/test_as_printed", "cli/test_writing", "test_one_answer",
    "slicers/test_batch_real", "lab/test_live", "report/test_preview", "models/test_press3d",
    "cli/test_optimise_command", "lab/test_truths", "test_changed_sensor", "cli/test_packs", "models/test_press2d",
    "test_shape_files", "test_one_verdict", "models/test_press_normal", "test_design_chart", "test_calibration",
    "report/test_contents", "slicers/test_slicing_real", "test_predict", "slicers/test_windows_real", "test_build",
    "cli/test_invert_command", "models/test_porous", "test_chart", "asprinted/test_volume", "test_plots",
    "lab/test_day", "asprinted/test_pressed", "slicers/test_best_tri_real", "test_planned",
    "batch/test_record", "attacks/test_log", "slicers/test_profiles_real",
)  # fmt: skip


def pytest_collection_modifyitems(items):
    """Files that take long first; `make test` keeps that order with ``--no-loadscope-reorder``."""
    order = {f"tests/{name}.py": k for k, name in enumerate(FIRST)}
    items.sort(key=lambda item: order.get(item.nodeid.partition("::")[0], len(order)))


def pytest_collection_finish():
    """Ten thousand tests stay: the garbage collector need not look at them again and again."""
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)
