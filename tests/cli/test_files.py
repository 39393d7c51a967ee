"""Design files that cannot be read, mean harm, or are merely odd."""

import os
import tracemalloc
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput

DEEP = "[" * 100_000
BOMB = "a: &a [x, x]\n" + "".join(f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]\n" for a, b in pairwise("abcdefghi"))
FILES = {
    "tag": ("shape: !!python/object/apply:os.system ['touch pwned']", "line 1: tags (!name) are not taken"),
    "billion laughs": (BOMB, "line 2: aliases (*name) are not taken"),
    "deep": (DEEP, "nested deeper than 20 levels"),
    "key twice": ("shape: tri\nshape: rect", "line 2, column 1: key 'shape' is given twice"),
    "unhashable key": ("shape: tri\n? [a, b]\n: 1", "line 2, column 3: key that is a list or a mapping: expected text"),
    "number as key": ("shape: tri\nparameters: {1: 2}", "key '1': expected text"),
    "merge key": ("shape: tri\n<<: {quality: extrafine}", "unknown key '<<'"),
    "tab": ("shape: tri\nparameters:\n\tperiod_mm: 2", "line 3, column 1: while scanning"),
    "two documents": ("shape: tri\n---\nshape: rect", "expected a single document"),
    "open quote": ("shape: 'tri", "line 1"),
    "empty": ("", "holds nothing; expected a mapping of names to values"),
    "list at top": ("- tri", "holds a list; expected a mapping"),
    "huge code point": ('shape: "\\UFFFFFFFF"', "bad.yaml: "),
    "half a code point": ('shape: "\\ud800"', "bad.yaml: "),
    "NUL": ("shape: tri\0", "control character #x0000 at position 10"),
    "no shape": ("quality: fine", "shape is missing; expected bump, cog, cone, double"),
    "empty shape": ("shape:", "shape is None; expected text"),
    "unknown key": ("shape: tri\nmaterial: {}", "unknown key 'material'; did you mean 'materials'?"),
    "true": ("shape: tri\nparameters: {period_mm: true}", "parameters.period_mm is True; expected a number"),
    "huge number": ("shape: tri\nparameters: {period_mm: 1" + "0" * 400 + "}", "period_mm is inf; expected"),
    "infinity": ("shape: tri\nparameters: {period_mm: .inf}", "period_mm is inf; expected a number from 0.1"),
    "not a number": ("shape: tri\nparameters: {period_mm: .nan}", "period_mm is nan; expected a number from 0.1"),
    "nothing": ("shape: tri\nparameters: {period_mm: }", "parameters.period_mm is None; expected a number"),
    "list of parameters": ("shape: tri\nparameters: [1]", "parameters is [1]; expected a mapping of names to values"),
    "word for materials": ("shape: tri\nmaterials: x60", "materials is 'x60'; expected a mapping with top_electrode"),
    "waiver without reason": ("shape: tri\nwaivers: [{rule: 5-width}]", "waivers.0.reason is missing"),
    "waiver of no rule": ("shape: tri\nwaivers: [{rule: width, reason: because}]", "expected text such as 5-width"),
    "unsafe name": ("shape: tri\nname: ../../x", "name: '../../x' cannot be a file name everywhere"),
    "empty name": ("shape: tri\nname: ''", "name: '' cannot be a file name"),
    "one source each": ("shape: tri\nmaterials: {film: x60@thesis-4.1, dielectric: x60@thesis-3.2}", "name one source"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), FILES.values(), ids=FILES)
def test_bad_file(run, tmp_path, text, message):
    (tmp_path / "bad.yaml").write_text(text, encoding="utf-8")
    said = run("build", "bad.yaml", "--no-cad")
    assert (said.code, said.out) == (2, "")
    assert said.line.startswith("sensorgen: bad.yaml: ")
    assert message in said.line
    assert len(said.line) < 500
    assert [p.name for p in tmp_path.iterdir()] == ["bad.yaml"]


def test_100_mb_are_refused_without_being_read(run, tmp_path):
    with (tmp_path / "big.yaml").open("wb") as file:
        file.write(b"shape: tri\n#")
        file.truncate(100_000_000)  # sparse
    said = run("check", "big.yaml")
    assert "100000000 bytes; expected at most 100000" in said.line
    tracemalloc.start()
    with pytest.raises(BadInput):
        yamlfile.read(tmp_path / "big.yaml")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000


def test_the_largest_file_that_is_read_is_refused_for_what_it_holds(run, tmp_path):
    (tmp_path / "wide.yaml").write_text("a: [" + "1," * 49_000 + "]")
    said = run("check", "wide.yaml")
    assert said.code == 2
    assert "bytes" not in said.line


def test_a_folder(run, tmp_path):
    (tmp_path / "d.yaml").mkdir()
    assert "cannot read 'd.yaml'" in run("check", "d.yaml").line


def test_no_such_file(run):
    assert "cannot read 'no.yaml': No such file or directory" in run("check", "no.yaml").line


@pytest.mark.parametrize("place", ["nowhere", "link.yaml"])
def test_a_link_that_leads_nowhere_or_to_itself(run, tmp_path, place):
    (tmp_path / "link.yaml").symlink_to(place)
    assert "cannot read 'link.yaml'" in run("check", "link.yaml").line


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_that_nobody_writes_to_is_not_waited_for(real, tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "pipe.yaml: not a file" in real("check", "pipe.yaml").line


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/stdin"])
def test_a_device_is_not_read(real, device):
    if not Path(device).exists():
        pytest.skip(f"no {device} here")
    assert device in real("check", device).refusal


@contextmanager
def as_nobody():
    """Root, who may read everything, is nobody for a while."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


@pytest.mark.skipif(not hasattr(os, "seteuid"), reason="no users on this system")
def test_no_permission(run, tmp_path):
    (tmp_path / "shut.yaml").write_text("shape: reference")
    assert run("check", "shut.yaml").code == 0
    (tmp_path / "shut.yaml").chmod(0)
    with as_nobody():
        said = run("check", "shut.yaml")
    assert said.line == "sensorgen: cannot read 'shut.yaml': Permission denied"


@pytest.mark.parametrize(
    "content", [bytes(range(256)), "shape: tri # größe".encode("latin-1"), "shape: tri".encode("utf-16")],
    ids=["binary", "latin-1", "utf-16"],
)  # fmt: skip
def test_not_utf8(run, tmp_path, content):
    (tmp_path / "odd.yaml").write_bytes(content)
    assert "save it as UTF-8 text" in run("check", "odd.yaml").line


def test_bom_and_windows_line_ends_and_umlauts_in_comments_are_fine(run, tmp_path):
    (tmp_path / "ok.yaml").write_bytes(b"\xef\xbb\xbfshape: reference # gr\xc3\xb6\xc3\x9fe\r\nquality: fine\r\n")
    assert run("check", "ok.yaml").clean


@pytest.mark.parametrize("stem", ["mein größter sensor", "CON"])
def test_a_file_whose_name_is_no_name_for_results(run, tmp_path, stem):
    path = tmp_path / f"{stem}.yaml"
    path.write_text("shape: reference")
    said = run("check", path)
    assert "set it with --name, or 'name:' in a design file" in said.line
    assert run("check", path, "--name", "fine-name").code == 0
    path.write_text("shape: reference\nname: fine-name")
    assert run("check", path).code == 0
