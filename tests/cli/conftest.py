"""The command line, called in this process for speed or in one of its own."""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from in_process import Said, captured

EACH = """
import contextlib, io, json, sys
sys.argv[0] = "sensorgen"
from sensorgen.cli import main
for words in json.loads(sys.argv.pop()):
    sys.argv[1:] = words
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            main()
    except SystemExit as left:
        print(json.dumps([left.code, list(sys.modules)]))
"""
TEMPLATE = "import sys; sys.argv[0] = 'sensorgen'; from sensorgen.cli import main; {before}; main()"


@pytest.fixture
def run(capfd, monkeypatch, tmp_path):
    """Run a command in this process, in an empty folder; gives :class:`Said`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return partial(captured, capfd, monkeypatch)


@pytest.fixture
def start(tmp_path):
    """Start a command in a process of its own; ``before`` is Python that goes ahead of it."""

    def call(*words, before="pass", cwd=tmp_path, **environment):
        command = [sys.executable, "-c", TEMPLATE.format(before=before), *map(str, words)]
        streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        env = {**os.environ, "COLUMNS": "80", **environment}
        return subprocess.Popen(command, **streams, encoding="utf-8", cwd=cwd, env=env)

    return call


@pytest.fixture
def real(start):
    """Run a command in a process of its own; gives :class:`Said`."""

    def call(*words, **more):
        process = start(*words, **more)
        out, err = process.communicate(timeout=60)
        return Said(process.returncode, out, err)

    return call


@pytest.fixture
def fork(forked, tmp_path):
    """As ``real``, of a process whose begin and modules are not the point: a fork of one that has loaded them."""

    def call(*words, before="pass"):
        done = forked(*words, cwd=tmp_path, before=before, env={"COLUMNS": "80"})
        return Said(done.code, done.out, done.err)

    return call


@pytest.fixture
def loaded(tmp_path):
    """Run commands one after another in one fresh interpreter; exit code of each, and all modules loaded by then."""

    def call(*commands):
        words = [sys.executable, "-c", EACH, json.dumps(commands)]
        done = subprocess.run(words, cwd=tmp_path, stdout=subprocess.PIPE, check=True)
        found = [json.loads(line) for line in done.stdout.splitlines()]
        assert len(found) == len(commands)
        return found

    return call


@pytest.fixture
def disk(tmp_path):
    """Mount a small disk: ``disk(bytes)`` gives its folder; skipped where this user may not mount."""
    mounted = []

    def mount(size):
        place = tmp_path / "disk"
        place.mkdir()
        words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", place]
        done = subprocess.run(words, capture_output=True, encoding="utf-8")
        if done.returncode:
            pytest.skip(f"cannot mount a small disk here: {done.stderr.strip()}")
        mounted.append(place)
        return place

    try:
        yield mount
    finally:
        for place in mounted:
            subprocess.run(["umount", place], check=True)


@pytest.fixture
def contents():
    """Every file below a folder, by its name there."""

    def read(folder: Path):
        return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}

    return read
