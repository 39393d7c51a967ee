"""The store: whole files, the user's own left alone, nothing outside the folder touched."""

import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from sensorgen.core import files as store
from sensorgen.core.errors import Unwritable


def publish(folder, **files):
    """Write and publish files whose content is their name, with a manifest of them."""
    with store.staging(folder) as stage:
        store.write(stage, {name: text.encode() for name, text in files.items()})
        store.write(stage, {store.MANIFEST: json.dumps({"files": store.hashes(stage)}).encode()})
        store.publish(stage, folder)


def names(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if not p.is_dir())


def test_staging_leaves_nothing_behind(tmp_path):
    with store.staging(tmp_path / "deep/er/x") as stage:
        store.write(stage, {"a/b": b"1"})
        assert names(tmp_path) == [stage.relative_to(tmp_path).as_posix() + "/a/b"]
    assert names(tmp_path) == []


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_staging_cleans_up_after_an_error(tmp_path, error):
    def fail():
        with store.staging(tmp_path / "x") as stage:
            store.write(stage, {"a": b"1"})
            raise error

    with pytest.raises((Unwritable, KeyboardInterrupt)):
        fail()
    assert os.listdir(tmp_path) == []  # noqa: PTH208 - the empty folder too


def test_published_files_replace_those_of_before_and_no_others(tmp_path):
    folder = tmp_path / "x"
    publish(folder, a="1", b="1", **{"sub/c": "1"})
    (folder / "mine").write_text("mine")
    publish(folder, a="2", d="2")
    assert names(folder) == ["a", "d", "manifest.json", "mine"]
    assert (folder / "a").read_text() == "2"
    assert names(tmp_path) == ["x/a", "x/d", "x/manifest.json", "x/mine"]


OUTSIDE = [
    "../victim", "/tmp/../{here}/victim", "{here}/victim", "sub/../../victim", "link/victim", ".", "", "..", "sub",
]  # fmt: skip


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_hostile_manifest_deletes_nothing_outside(tmp_path, name):
    folder = tmp_path / "x"
    publish(folder, a="1")
    (tmp_path / "victim").write_text("mine")
    (folder / "sub").mkdir()
    (folder / "sub/mine").write_text("mine")
    (folder / "link").symlink_to(tmp_path)
    (folder / store.MANIFEST).write_text(json.dumps({"files": {name.format(here=tmp_path): "0"}}))
    publish(folder, a="2")
    assert (tmp_path / "victim").read_text() == "mine"
    assert (folder / "sub/mine").read_text() == "mine"
    assert (folder / "a").read_text() == "2"


@pytest.mark.parametrize(
    "text",
    ["{", "[]", '{"files": 3}', '{"files": [1, null]}', '{"files": {"a\\u0000/b": 0}}', "[" * 9_999, "\udcff"],
    ids=lambda text: text[:20].encode("ascii", "replace").decode() or "empty",
)  # fmt: skip
def test_a_damaged_manifest_is_no_obstacle(tmp_path, text):
    folder = tmp_path / "x"
    folder.mkdir()
    (folder / store.MANIFEST).write_bytes(text.encode("utf-8", "surrogateescape"))
    publish(folder, a="1")
    assert names(folder) == ["a", "manifest.json"]


def test_a_link_in_the_place_of_a_file_is_replaced_not_followed(tmp_path):
    folder = tmp_path / "x"
    folder.mkdir()
    (tmp_path / "victim").write_text("mine")
    (folder / "a").symlink_to(tmp_path / "victim")
    publish(folder, a="1")
    assert (tmp_path / "victim").read_text() == "mine"
    assert (folder / "a").read_text() == "1"
    assert not (folder / "a").is_symlink()


def test_leftovers_of_the_dead_are_swept_and_those_of_the_living_stay(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    mine = [f".x.{os.getppid()}.part", ".x.part", ".x.²³.part", f".x.{'9' * 40}.part", ".y.1.part", ".x.1.part.txt"]
    left = [f".x.{dead.pid}.part", f".x.{os.getpid()}.part"]
    for name in (*mine, *left):
        (tmp_path / name).mkdir()
    with store.staging(tmp_path / "x"):
        pass
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(mine)


@pytest.mark.parametrize("blocked", ["a", "sub"])
def test_nothing_is_replaced_where_something_is_in_the_way(tmp_path, blocked):
    folder = tmp_path / "x"
    (folder / "a").mkdir(parents=True) if blocked == "a" else folder.mkdir()
    if blocked == "sub":
        (folder / "sub").write_text("mine")
    with pytest.raises(Unwritable):
        publish(folder, **{"0": "1", "a": "1", "sub/b": "1"})
    assert not (folder / "0").exists()


@pytest.mark.skipif(not hasattr(signal, "SIGTERM") or os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_wait_and_are_not_lost(number):
    told = []
    before = signal.signal(number, lambda *_: told.append("told"))
    try:
        with store._undisturbed():
            os.kill(os.getpid(), number)
            os.kill(os.getpid(), number)
            assert told == []
        assert told == ["told"]
    finally:
        signal.signal(number, before)


@pytest.mark.skipif(os.name == "nt", reason="no locks on folders")
def test_whoever_publishes_second_waits_for_the_first(tmp_path, monkeypatch):
    folder, half_way, go_on, order = tmp_path / "x", threading.Event(), threading.Event(), []

    def slow(self, target, rename=Path.replace):
        if self.parent.name == "first" and self.name == "b":
            half_way.set()
            assert go_on.wait(10)
        order.append(f"{self.parent.name} {self.name}")
        return rename(self, target)

    def work(name):
        files = {"a": name.encode(), "b": name.encode(), store.MANIFEST: b"{}"}
        store.write(tmp_path / name, files)
        store.publish(tmp_path / name, folder)

    monkeypatch.setattr(Path, "replace", slow)
    workers = [threading.Thread(target=work, args=(name,)) for name in ("first", "second")]
    workers[0].start()
    assert half_way.wait(10)
    workers[1].start()
    workers[1].join(0.2)
    assert workers[1].is_alive()
    assert order == ["first a"]
    go_on.set()
    for worker in workers:
        worker.join()
    assert order == [f"{who} {what}" for who in ("first", "second") for what in ("a", "b", store.MANIFEST)]


@pytest.mark.parametrize("place", [".", "..", "folder", "taken/a.svg"])
def test_replace_refuses_what_is_no_file(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(Unwritable, match="cannot write"):
        store.replace(tmp_path.joinpath(place) if place != "." else type(tmp_path)(), b"1")
    assert names(tmp_path) == ["taken"]
