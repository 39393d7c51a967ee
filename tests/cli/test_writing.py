"""Whatever happens while it writes: one clear line, whole files, nothing left behind."""

import json
import os
import random
import shutil
import signal
import subprocess
import time
from hashlib import sha256
from pathlib import Path

import pytest

from sensorgen.design import design
from sensorgen.workflows.build import build

SIZE = {"length_mm": 6.0, "width_mm": 6.0}
BUILD = ("build", "reference", "--size", "6x6", "--no-cad", "--name", "x")
OLD, NEW = ("--dielectric", "0.6"), ("--dielectric", "0.7")
pytestmark = pytest.mark.usefixtures("shared_cache")  # what is written counts, not how it is found


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The files of the old build, and those of the new one."""

    def files(film):
        data = {"shape": "reference", "name": "x", "parameters": {"dielectric_mm": film, **SIZE}}
        folder = build(design.make(data), tmp_path_factory.mktemp("both"), cad=False).folder
        return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    return files(0.6), files(0.7)


@pytest.fixture
def built(tmp_path, both):
    """The old build, in the usual place."""
    for name, content in both[0].items():
        path = tmp_path / "out/x" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return tmp_path / "out"


def assert_whole(found, both):
    """Every file is of one build or of the other, and the manifest is, too."""
    assert found
    for name, content in found.items():
        assert content in (both[0].get(name), both[1].get(name)), name


def assert_manifest_verifies(found):
    listed = json.loads(found["manifest.json"])["files"]
    assert listed == {name: sha256(content).hexdigest() for name, content in found.items() if name != "manifest.json"}


def test_a_forced_short_is_written_whole_and_elsewhere_to_the_same_bytes(run, start, tmp_path, contents):
    """Nothing is predicted of the drawing. Elsewhere: another process, with a hash seed and a folder of its own."""
    words = ("build", "tri", "--size", "6x6", "--dielectric", "0", "--no-cad", "--force", "--name", "x")
    assert run(*words).clean
    found = contents(tmp_path / "out/x")
    process = start(*words, "--out", "b/c", PYTHONHASHSEED="1")
    process.communicate()
    assert (process.returncode, contents(tmp_path / "b/c/x")) == (0, found)
    drawn = json.loads(found["prediction.json"])["drawn"]
    assert (drawn["status"], drawn["capacitance"]) == ("short", None)
    assert "touch" in drawn["reason"] or "short" in drawn["reason"]
    assert {"x.prusa.3mf", "x.svg", "check.json"} < set(found)
    assert_manifest_verifies(found)


@pytest.mark.parametrize("out", ["x/deeper", ""])  # the last is the design's own folder
def test_output_folder_is_a_file(run, tmp_path, out):
    (tmp_path / "x").write_text("mine")
    assert (
        "'x' is a file; expected a folder: move it away, or name another place with --out"
        in run(*BUILD, "--out", out).refusal
    )
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("x", "mine")]


def test_output_folder_is_a_link(run, tmp_path):
    (tmp_path / "out").symlink_to("real")
    assert "'out' is a link that leads nowhere" in run(*BUILD).line
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    (tmp_path / "real").mkdir()
    assert run(*BUILD).code == 0
    assert (tmp_path / "real/x/manifest.json").is_file()


@pytest.mark.parametrize("out", ["/proc/none", "/dev/null", "out\udcff/" + "b" * 300])
def test_output_folder_that_cannot_be(run, tmp_path, out):
    assert "name another place with --out" in run(*BUILD, "--out", out).refusal
    assert not any(p.name.endswith(".part") for p in tmp_path.rglob("*"))


def test_read_only(run, disk, contents, both):
    place = disk("8m")
    assert run(*BUILD, *OLD, "--out", place).code == 0
    subprocess.run(["mount", "-o", "remount,ro", place], check=True)
    assert (
        f"cannot write to '{place}/x': Read-only file system; name another place with --out"
        in run(*BUILD, *NEW, "--out", place).refusal
    )
    assert contents(place) == {f"x/{name}": content for name, content in both[0].items()}


def test_disk_full(run, disk, contents, both):
    """There is room for one build, but not for a second beside it."""
    place = disk(str(sum(map(len, both[0].values())) + 400_000))
    assert run(*BUILD, *OLD, "--out", place).code == 0
    (place / "filler").write_bytes(bytes(shutil.disk_usage(place).free - 50_000))
    before = contents(place)
    said = run(*BUILD, *NEW, "--out", place)
    assert said.code == 2
    assert said.line.endswith(f"cannot write to '{place}/x': No space left on device; name another place with --out")
    assert contents(place) == before
    assert sorted(p.name for p in place.iterdir()) == ["filler", "x"]


@pytest.mark.skipif(os.name == "nt", reason="no file size limits on Windows")
def test_a_write_that_breaks_off(fork, built, contents, both):
    """As on a full disk, but without needing one: no file may grow beyond the limit."""
    before = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (3_000, 3_000))"
    assert (
        fork(*BUILD, *NEW, before=before).refusal
        == "sensorgen: cannot write to 'out/x': File too large; name another place with --out"
    )
    assert contents(built) == {f"x/{name}": content for name, content in both[0].items()}


def test_drawing_breaks_off(fork, tmp_path):
    (tmp_path / "a.svg").write_text("mine")
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"
    said = fork("draw", "tri", "--size", "6x6", "-o", "a.svg", before=limit)
    assert said.line == "sensorgen: cannot write 'a.svg': File too large"
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.svg", "mine")]


@pytest.mark.parametrize("place", [".", "folder", "pipe", "/proc/none/x.svg"])
def test_drawing_to_what_is_no_file(run, tmp_path, place):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    assert f"cannot write '{place}'" in run("draw", "tri", "--size", "6x6", "-o", place).refusal
    assert (tmp_path / "pipe").is_fifo()  # a device would have been replaced, too


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_output_to_a_full_disk(tmp_path, start):
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        process = start("list", "materials")
        process.communicate()
        done = subprocess.run([*process.args], stdout=full, stderr=subprocess.PIPE, encoding="utf-8", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "sensorgen: cannot write the output: No space left on device\n")


def test_a_reader_that_leaves_early(start):
    with start("list", "materials") as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 0


# Interruptions. Most of the time of a build goes into its prediction; writing follows, and is short.

SIGNALS = {"SIGINT": 130, "SIGTERM": 143, "SIGKILL": -9}


def writing(process, out):
    """Wait until this build has begun to write (or is done); its folder is there before the prediction."""
    while process.poll() is None and not list(out.glob(f".x.*.{process.pid}.part/x.prusa.3mf")):
        time.sleep(0.005)


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("turns", [1, pytest.param(16, marks=pytest.mark.nightly)])
def test_interrupted_while_writing(start, fork, built, contents, both, name, turns):
    rng = random.Random(name)
    for turn in range(turns):
        process = start(*BUILD, *(NEW, OLD)[turn % 2])
        writing(process, built)
        time.sleep(rng.uniform(0.0, 0.15))
        process.send_signal(getattr(signal, name))
        _, err = process.communicate()
        done = process.returncode in (0, -getattr(signal, name))  # by then, or as good as
        assert done or process.returncode == SIGNALS[name], err
        assert_whole(contents(built / "x"), both)
        left = [p.name for p in built.iterdir() if p.name != "x"]
        if name != "SIGKILL":
            assert not left
            assert done or err.strip().endswith("; no file is half-written")
            assert err.strip().count("\n") == 0
    if name == "SIGKILL":
        assert fork(*BUILD, *NEW).code == 0
        assert contents(built) == {f"x/{name}": content for name, content in both[1].items()}  # leftovers are swept


AT_RENAME = """
import os, pathlib, signal
rename, turns = pathlib.Path.replace, iter(range({turn}))
def interrupted(self, target):
    if "out/x/" in pathlib.Path(target).as_posix() and next(turns, None) is None:  # files of the cache do not count
        os.kill(os.getpid(), signal.{name})
    return rename(self, target)
pathlib.Path.replace = interrupted
exec("")"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("turn", [10, *(pytest.param(turn, marks=pytest.mark.nightly) for turn in (0, 23))])
def test_killed_between_two_renames(fork, built, contents, both, turn):
    before = AT_RENAME.format(turn=turn, name="SIGKILL")
    assert fork(*BUILD, *NEW, before=f"exec({before!r})").code == -9
    found = contents(built / "x")
    assert_whole(found, both)
    assert found["manifest.json"] == both[0]["manifest.json"]  # the last to be replaced
    assert fork(*BUILD, *NEW).code == 0
    assert contents(built) == {f"x/{name}": content for name, content in both[1].items()}


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("name", [pytest.param("SIGINT", marks=pytest.mark.nightly), "SIGTERM"])
def test_an_interruption_between_two_renames_waits_for_the_last(fork, built, contents, both, name):
    before = AT_RENAME.format(turn=5, name=name)
    assert fork(*BUILD, *NEW, before=f"exec({before!r})").code == SIGNALS[name]
    assert contents(built) == {f"x/{name}": content for name, content in both[1].items()}


WITHIN_A_LIBRARY = """
import os, signal
from sensorgen.core import files
def write(*_):
    try:
        os.kill(os.getpid(), signal.{name})
        for _ in range(1000):
            pass
    except BaseException:
        raise {error}("of the library's own") from None
files.write = write
exec("")"""


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("name", "said", "error"),
    [
        ("SIGINT", "interrupted", "OSError"),
        ("SIGTERM", "stopped", "ImportError"),
        pytest.param("SIGINT", "interrupted", "RuntimeError", marks=pytest.mark.nightly),
        pytest.param("SIGINT", "interrupted", "ImportError", marks=pytest.mark.nightly),
        pytest.param("SIGTERM", "stopped", "OSError", marks=pytest.mark.nightly),
        pytest.param("SIGTERM", "stopped", "RuntimeError", marks=pytest.mark.nightly),
    ],
)
def test_an_interruption_of_which_a_library_makes_an_error(fork, built, contents, both, name, said, error):
    before = WITHIN_A_LIBRARY.format(name=name, error=error)
    left = fork(*BUILD, *NEW, before=f"exec({before!r})")
    assert (left.code, left.line) == (SIGNALS[name], f"sensorgen: {said}; no file is half-written")
    assert contents(built) == {f"x/{name}": content for name, content in both[0].items()}


def test_builds_of_one_name_at_once(start, tmp_path, contents, both):
    """Whoever comes last wins, with all of its files."""
    processes = [start(*BUILD, *period) for period in (OLD, NEW)]
    for process in processes:
        _, err = process.communicate()
        assert (process.returncode, err) == (0, "")
    assert contents(tmp_path / "out/x") in both
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["x"]


def test_the_users_own_files_stay(run, tmp_path):
    folder = tmp_path / "out/x"
    (folder / "profiles").mkdir(parents=True)
    mine = [folder / "notes.txt", folder / "profiles/mine.ini", tmp_path / "out/other.txt"]
    for file in mine:
        file.write_text("mine")
    for period in (OLD, NEW):
        said = run(*BUILD, *period, "--json").ok
        assert not {"notes.txt", "profiles/mine.ini"} & set(json.loads(said.out)["files"])
    assert [file.read_text() for file in mine] == ["mine"] * 3


def test_files_of_an_earlier_build_go(run, built, contents, both):
    folder = built / "x"
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"] |= {"x.step": "0", "profiles/old/one.ini": "0"}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    (folder / "x.step").write_text("of a build with CAD")
    (folder / "profiles/old").mkdir()
    (folder / "profiles/old/one.ini").write_text("of another printer")
    assert run(*BUILD, *NEW).code == 0
    assert contents(folder) == both[1]


def test_a_folder_where_a_file_should_go(run, built, contents):
    (built / "x/x.svg").unlink()
    (built / "x/x.svg").mkdir()
    before = contents(built)
    assert "cannot write 'out/x/x.svg': a folder is in its place" in run(*BUILD, *NEW).refusal
    assert contents(built) == before
