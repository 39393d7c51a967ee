"""A stranger's shape that is trusted leaves its process in no way that we know."""

import json
import os
import platform
import select
import socket
import struct
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest

from sensorgen.core import confine
from sensorgen.core.errors import BadInput
from sensorgen.design import shape_files

ATTACKS = (Path(__file__).parent / "shape_attacks.py").read_text("utf-8")
VICTIMS = ("truncated", "deleted", "renamed", "linked", "permitted", "timed")
NOBODY = {"user": 65534, "group": 65534, "extra_groups": []}
SECRET = "correct-horse-battery"
linux = pytest.mark.skipif(not confine.available(), reason="this system confines no process")


@pytest.fixture
def victims(tmp_path, monkeypatch):
    """Targets of the attacks; a function that gives the attacks' text, and a check that no target has changed."""
    folder = tmp_path / "victims"
    folder.mkdir(mode=0o777)
    folder.chmod(0o777)
    for parent in (tmp_path, *tmp_path.parents[:3]):
        if parent.stat().st_uid == os.getuid() and parent != Path("/tmp"):
            parent.chmod(0o755)
    for name in VICTIMS:
        (folder / name).write_text(name)
        (folder / name).chmod(0o666)
    (folder / "link").symlink_to("/etc/passwd")
    (folder / "stranger_module.py").write_text("")
    monkeypatch.setenv("SENSORGEN_SECRET", SECRET)
    left_open = os.open(folder / "timed", os.O_RDWR)
    os.set_inheritable(left_open, True)
    server = socket.create_server(("127.0.0.1", 0))
    before = state(folder)
    given = {
        "folder": str(folder), "parent": os.getpid(), "port": server.getsockname()[1], "secret": SECRET,
        "machine": platform.machine(), "bytes": 2 << 30, "library": ctypes_library(),
    }  # fmt: skip

    def text(**more):
        return ATTACKS.replace("GIVEN = {}", f"GIVEN = {given | more!r}")

    def untouched():
        return state(folder) == before and not select.select([server], [], [], 0)[0]

    yield text, untouched
    os.close(left_open)
    server.close()


def state(folder):
    return {
        path.name: (path.lstat().st_mode, path.lstat().st_mtime_ns, path.lstat().st_nlink, path.lstat().st_size)
        for path in folder.iterdir() if path.name != "__pycache__"
    }  # fmt: skip


def ctypes_library():
    """A library that the interpreter has not loaded."""
    from ctypes.util import find_library

    return find_library("z") if sys.modules.get("zlib") is None else find_library("bz2") or "libbz2.so.1.0"


def worked(document):
    tried = json.loads(document)
    assert len(tried) >= 20
    return [name for name, (_, result) in tried.items() if result is True], tried


@linux
def test_the_attempts_are_real(victims):
    """Not confined, as root: each works, but for what this kernel or user lacks."""
    text, untouched = victims
    control = text(control=[], bytes=1 << 20)
    done = subprocess.run(
        [sys.executable, "-c", control], capture_output=True, encoding="utf-8", close_fds=False, check=True
    )
    success, _ = worked(done.stdout)
    assert not untouched()
    assert len(success) >= (45 if os.getuid() == 0 else 30), success


@linux
@pytest.mark.parametrize(("left_out", "error"), [("_landlock(libc)", 1), ("_SET_SECCOMP", 13)])
def test_either_wall_alone_keeps_files_closed(left_out, error):
    """Without Landlock the filter's EPERM; with a filter that allows all, Landlock's EACCES."""
    source = Path(confine.__file__).read_text("utf-8")
    if left_out == "_SET_SECCOMP":
        source = source.replace('    return b"".join(', '    code = [(_RETURN, 0, 0, _ALLOW)]\n    return b"".join(')
    else:
        source = source.replace(f"    {left_out}\n", "")
    end = "\nconfine()\ntry:\n    open('/etc/passwd')\nexcept OSError as e:\n    os._exit(e.errno)\nos._exit(0)\n"
    done = subprocess.run([sys.executable, "-I", "-S", "-c", source + end], check=False)
    if error == 13 and done.returncode == 0 and not landlock():
        pytest.skip("this kernel has no Landlock")
    assert done.returncode == error


def landlock():
    import ctypes

    return ctypes.CDLL(None).syscall(444, None, 0, 1) >= 1


@linux
def test_a_kernel_that_confines_nothing_runs_nothing(monkeypatch, tmp_path):
    """By a filter that refuses to set filters."""
    number = {"x86_64": 157, "aarch64": 167}[platform.machine()]
    code = [(0x20, 0, 0, 0), (0x15, 0, 3, number), (0x20, 0, 0, 16), (0x15, 0, 1, 22), (6, 0, 0, 0x00050016),
            (6, 0, 0, 0x7FFF0000)]  # fmt: skip
    program = b"".join(struct.pack("HBBI", *each) for each in code)
    refuse = (
        "import ctypes, os, struct, sys\n"
        f"code = ctypes.create_string_buffer({program!r}, {len(program)})\n"
        f"filters = ctypes.create_string_buffer(struct.pack('HxxxxxxQ', {len(code)}, ctypes.addressof(code)))\n"
        "one, zero = ctypes.c_ulong(1), ctypes.c_ulong(0)\n"
        "assert ctypes.CDLL(None).prctl(38, one, zero, zero, zero) == 0\n"
        "assert ctypes.CDLL(None).prctl(22, ctypes.c_ulong(2), filters, zero, zero) == 0\n"
        "os.execv(sys.argv[1], sys.argv[1:])\n"
    )
    start = subprocess.Popen
    monkeypatch.setattr(
        shape_files.subprocess, "Popen", lambda words, **how: start([sys.executable, "-c", refuse, *words], **how)
    )
    text = f"open({str(tmp_path / 'ran')!r}, 'w')\n"
    shape_files.trust("zig", text)
    with pytest.raises(BadInput, match=r"zig.py: did not run, since this kernel does not confine it .*seccomp"):
        shape_files._ShapeProcess("zig", text)
    assert not (tmp_path / "ran").exists()


def interpreter_of_all():
    """An interpreter that every user of this machine may run; None without one."""
    old = "import sys; sys.exit(sys.version_info < (3, 11))"
    for path in (sys.executable, "/usr/bin/python3"):
        with suppress(OSError, subprocess.CalledProcessError):
            subprocess.run([path, "-I", "-S", "-c", old], **NOBODY, cwd="/", check=True)
            return path
    return None


@linux
@pytest.mark.parametrize("user", ["this", "nobody"])
def test_no_attack_succeeds(victims, user, monkeypatch, record_property):
    text, untouched = victims
    if user == "nobody":
        if os.getuid():
            pytest.skip("only root can become nobody")
        path = interpreter_of_all()
        if path is None:
            pytest.skip("no interpreter that nobody can run")
        monkeypatch.setattr(sys, "executable", path)
        as_nobody = partial(subprocess.Popen, **NOBODY)
        monkeypatch.setattr(shape_files.subprocess, "Popen", as_nobody)
    shape_files.trust("zig", text())
    process = shape_files._ShapeProcess("zig", text())
    success, tried = worked(process.about["about"])
    process.close()
    kinds = Counter(kind for kind, _ in tried.values())
    whose = "nobody" if user == "nobody" else "root" if os.getuid() == 0 else "a user"
    record_property("user", whose)
    record_property("by_kind", ", ".join(f"{kind} {count}" for kind, count in kinds.items()))
    record_property("attempts", len(tried))
    record_property("successes", len(success))
    assert success == []
    assert untouched()
