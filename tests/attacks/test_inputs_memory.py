"""Files that ask for more memory than there is: 512 MB are enough for any, and bombs are refused in one line."""

import struct
import zlib

import h5py
import numpy as np
import pytest
from child import ADDRESSES, refused

MOST = 512 << 20  # bytes, resident
HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
WEEK_S = 7 * 86400.0


@pytest.fixture
def show(forked, tmp_path):
    """Show a recording with 2 GB of addresses; no more than 512 MB of memory may be taken."""

    def run(name, *words):
        done = forked("bench", "show", tmp_path / name, *words, cwd=tmp_path, AS=ADDRESSES)
        assert done.resident < MOST
        assert done.code in (0, 2), done.err
        assert "Traceback" not in done.err
        return done

    return run


def test_a_pause_costs_no_memory(show, tmp_path):
    """Noise about a constant, and every eight seconds a press that changes it; a week between the halves."""
    t = np.arange(5000) / 140
    z = (1000 - 2000j) * (1 + 0.02 * (t % 8 < 4)) + np.random.default_rng(0).standard_normal((5000, 2)) @ [1, 1j]
    t[2500:] += WEEK_S
    rows = [f"{a:.5f},{v.real:.6g},{v.imag:.6g}\n" for a, v in zip(t.tolist(), z.tolist(), strict=True)]
    (tmp_path / "pause.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + "".join(rows))
    assert "2 parts" in refused(show("pause.csv"))
    for part in (1, 2):
        done = show("pause.csv", "--part", part)
        assert (done.code, done.err) == (0, "")
        assert f"part {part}, from" in done.out
    assert f"after a pause of {WEEK_S + 1 / 140:.6g} s" in " ".join(done.out.split())


def test_an_hour_in_steps_of_a_nanosecond_is_refused(show, tmp_path):
    t = np.cumsum(np.where(np.arange(3000) % 2, 1e-9, 500.0))
    (tmp_path / "odd.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + "".join(f"{a!r},1,1\n" for a in t.tolist()))
    show("odd.csv")


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def matrix(name, shape, content, kind=6):
    flags = element(6, struct.pack("<II", kind, 0))
    return flags + element(5, struct.pack(f"<{len(shape)}i", *shape)) + element(1, name) + content


def packed(body):
    """A packed array of a body that is given in pieces."""
    packer = zlib.compressobj(9)
    content = b"".join([*map(packer.compress, body), packer.flush()])
    return struct.pack("<II", 15, len(content)) + content


def zeros(count):
    """Tag and content of an array ``impedance_time`` of so many zeros."""
    inside = matrix(b"impedance_time", (1, count), struct.pack("<II", 9, 8 * count))
    yield struct.pack("<II", 14, len(inside) + 8 * count) + inside
    for left in range(8 * count, 0, -(1 << 24)):
        yield b"\0" * min(left, 1 << 24)


@pytest.mark.parametrize(
    ("pieces", "said"),
    [
        (zeros(1 << 25), "no measurement"),  # 256 MB in 260 kB, which are packed in the test alone
        ([packed([struct.pack("<II", 14, 0xFFFFFFF0), *zeros(1 << 10)])], "4 GB unpacked"),
        ([element(14, matrix(b"settings", (1, 30_000), element(14, b"") * 30_000, kind=1))], "more than 20000 arrays"),
        ([element(14, matrix(b"settings", (1, 3_000_000), element(1, b"a" * 3_000_000), kind=4))], "a text of 3000000"),
        ([element(14, matrix(b"settings", (1, 1) * 40_000, b""))], "an array of shape"),
    ],
    ids=["packed", "declared", "cells", "text", "axes"],
)  # fmt: skip
def test_matlab_bombs_are_refused(show, tmp_path, pieces, said):
    content = b"".join(pieces) if isinstance(pieces, list) else packed(pieces)
    (tmp_path / "bomb.mat").write_bytes(HEAD + content)
    assert said in refused(show("bomb.mat"))


def test_packed_variables_that_nobody_asked_for_stay_packed(show, tmp_path):
    junk = packed(
        [struct.pack("<II", 14, 0xFFFFFF), matrix(b"junk", (1, 1 << 21), struct.pack("<II", 9, 1 << 24)), b"\0" * 99]
    )
    (tmp_path / "junk.mat").write_bytes(HEAD + junk * 1000)
    assert "impedance_data is missing" in refused(show("junk.mat"))


def bomb(path, what):
    with h5py.File(path, "w") as file:
        if what == "zeros":
            file.create_dataset("impedance_time", (1 << 29,), "f8", chunks=(1 << 16,))
        elif what == "packed":
            data = file.create_dataset("impedance_time", (1 << 24,), "f8", chunks=(1 << 20,), compression=9)
            data[:] = 0.0
        elif what == "chunk":
            file.create_dataset("impedance_time", (9 << 20,), "f8", chunks=(9 << 20,))[:8] = 1.0
        elif what == "references":
            data = file.create_dataset("x", (1 << 22,), "f8")
            data[:] = np.random.default_rng(0).standard_normal(1 << 22)
            refs = file.create_dataset("impedance_data", (1000,), h5py.ref_dtype)
            refs[:] = [data.ref] * 1000
        elif what == "texts":
            file.create_dataset("impedance_data", (1 << 27,), "S16", chunks=(1 << 20,), compression=9)


@pytest.mark.parametrize(
    ("what", "said"),
    [("zeros", "4 GB unpacked"), ("packed", "no measurement"), ("chunk", "expected chunks up to 64 MB"),
     ("references", "impedance_data is a list of 1000"), ("texts", "no measurement|texts")],
)  # fmt: skip
def test_hdf5_bombs_are_refused(show, tmp_path, what, said):
    bomb(tmp_path / "bomb.h5", what)
    line = refused(show("bomb.h5"))
    assert any(word in line for word in said.split("|")), line


def test_long_rows_are_read_in_small_blocks(show, tmp_path):
    """Each of a quarter of a megabyte, as many as the block has rows."""
    names = ",".join(f"x{k}" for k in range(40_000))
    row = "1," * 40_000
    with (tmp_path / "wide.csv").open("w") as file:
        file.write(f"time_s,re_ohm_1kHz,im_ohm_1kHz,{names}\n")
        for k in range(600):
            file.write(f"{k},1,{k % 7},{row[:-1]}\n")
    show("wide.csv")


def test_aliases_and_depths_of_yaml_are_refused(forked, tmp_path):
    levels = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    levels += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    for name, text in (("laughs", "\n".join(levels)), ("deep", "a: " + "[" * 40_000), ("wide", "a: [" + "1," * 60_000)):
        (tmp_path / f"{name}.yaml").write_text(text)
        done = forked("check", tmp_path / f"{name}.yaml", cwd=tmp_path, AS=ADDRESSES)
        refused(done)
        assert done.resident < MOST
