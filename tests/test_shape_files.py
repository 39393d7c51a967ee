"""Shape files from outside: what they may do, what happens when they do something else, and what comes back."""

import os
import re
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from sensorgen.core import cache
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design import packs, shape_files
from sensorgen.design.design import make
from sensorgen.design.shapes import rect, reference, tri
from sensorgen.scene.scene import Envelope, Fill

TEMPLATE = (Path(packs.__file__).parent / "templates" / "shape.py").read_text("utf-8")
BEGIN = "    low = p.electrode_mm\n"


def shape(text, name="zig"):
    """A shape of a file that the user trusts."""
    shape_files.trust(name, text)
    return shape_files.load(name, text)


def inside(code):
    """The template, with code at the beginning of scene()."""
    assert BEGIN in TEMPLATE
    return TEMPLATE.replace(BEGIN, "".join(f"    {line}\n" for line in code.splitlines()) + BEGIN)


def line_of(text, code):
    return text[: text.index(code)].count("\n") + 1


@pytest.fixture
def short(monkeypatch):
    """Time and memory that a test can wait for."""
    monkeypatch.setattr(shape_files, "SECONDS", 1)
    monkeypatch.setattr(shape_files, "MEMORY_BYTES", 1 << 28)


@pytest.fixture(autouse=True)
def _closed():
    yield
    shape_files.close()


@pytest.mark.parametrize("module", [reference, tri, rect])
def test_shapes_that_ship_come_back_as_they_are(module):
    """The same file, run in its own process: equal bodies, cells and parameters."""
    text = Path(module.__file__).read_text("utf-8")
    form, small = shape(text, "same"), {"length_mm": 7.0, "width_mm": 3.0}
    params = form.Params(**small)
    assert asdict(params) == asdict(module.Params(**small))
    assert params.cells() == module.Params(**small).cells()
    for fill in (Fill(), Fill(support="bvoh", film="pla")):
        assert form.scene(params, fill) == module.scene(module.Params(**small), fill)
    assert isinstance(params, Envelope)
    assert form.__doc__ == module.__doc__


def test_a_file_that_names_a_module_as_before_runs():
    text = Path(tri.__file__).read_text("utf-8")
    assert "sensorgen.scene.patterns" in text
    form = shape(text.replace("sensorgen.scene.patterns", "sensorgen.scene.triangles"), "before")
    assert form.scene(form.Params(), Fill()) == tri.scene(tri.Params(), Fill())


def test_a_shapes_own_refusal_keeps_its_words():
    form = shape(Path(tri.__file__).read_text("utf-8"), "same")
    with pytest.raises(OutOfRange, match=r"lower_height_mm 0.6 must stay below hang_height_mm 0.5"):
        form.Params(lower_height_mm=0.6).cells()


def test_it_runs_once_for_each_set_of_parameters(monkeypatch):
    asked, process = [], shape_files._ShapeProcess
    ask = process.ask
    monkeypatch.setattr(process, "ask", lambda self, question: asked.append(question) or ask(self, question))
    text = TEMPLATE + "\n# once\n"
    for _ in range(3):
        shape_files._foreign.cache_clear()
        form = shape(text)
        for height in (0.4, 0.5):
            form.scene(form.Params(height_mm=height), Fill())
    assert [q.get("parameters", {}).get("height_mm") for q in asked] == [None, 0.4, 0.5]
    for file in cache.folder().rglob("*.json"):  # a damaged store is asked for nothing
        file.write_text("{")
    shape_files._foreign.cache_clear()
    shape(text)
    assert len(asked) == 4


HOSTILE = [
    ("while True:\n    pass", "still running when its time was over|no answer within"),
    ("while True:\n    try:\n        while True:\n            pass\n    except BaseException:\n        pass",
     "ended without an answer|no answer within"),
    ("x = []\nwhile True:\n    x.append(bytearray(1 << 24))", "needs more memory than a shape may have"),
    ("x = 'x' * (10 << 30)", "needs more memory than a shape may have"),
    ("import os\nos._exit(0)", "ended without an answer .exit code 0"),
    ("import sys\nsys.exit(3)", "SystemExit: 3"),
    ("import os\nos.kill(os.getpid(), 9)", "a shape computes and does nothing else .*not permitted"),
    ("open('/etc/passwd').read()", "a shape computes and does nothing else .*not permitted: '/etc/passwd'"),
    ("open('x.txt', 'w')", "a shape computes and does nothing else"),
    ("import time\ntime.sleep(9)", "a shape computes and does nothing else"),
    ("import socket\nsocket.create_connection(('127.0.0.1', 9))", "No module named '_?socket'"),
    ("import sys\nsink = sys._getframe(3).f_locals['sink']\nwhile True:\n"
     "    sink.write(b'[' * (1 << 22) + b'\\n')",
     "ended without an answer"),
    ("import sys\nsys._getframe(3).f_locals['sink'].write(b'{\"answer\": 1e999}\\n')", "number that is not finite"),
    ("1 / 0", "ZeroDivisionError: division by zero"),
    ("raise ValueError('a' * 10_000 + '\\x1b[2J\\n')", "ValueError: aaa"),
    ("return scene(p, fill)", "RecursionError"),
    ("return None", "TypeError: scene.. gives NoneType; expected a Scene"),
]  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="no limits there")
@pytest.mark.parametrize(("code", "expected"), HOSTILE, ids=[code.partition("\n")[0][:30] for code, _ in HOSTILE])
def test_what_a_shape_does_wrong_is_one_line_with_its_place(short, code, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = inside(code)
    form = shape(text)
    with pytest.raises(BadInput, match=expected) as error:
        form.scene(form.Params(), Fill())
    said = str(error.value)
    assert said.startswith("zig.py")
    assert len(said) < 600
    assert "\n" not in said
    if not re.search("ended without|gives NoneType|not finite|no answer within", said):
        assert re.match(r"zig.py, line \d+: ", said)
        first = line_of(text, code.partition("\n")[0])
        assert first <= int(re.findall(r"line (\d+)", said)[0]) <= first + code.count("\n")
    assert not list(tmp_path.iterdir())


def test_modules_that_numpy_imports_late_are_there():
    form = shape(inside("import numpy as np\nassert np.random.default_rng(1).integers(9) >= 0\nnp.fft.fft([1, 2])"))
    assert form.scene(form.Params(), Fill()).bodies


def test_numpy_and_shapely_are_there_if_the_file_names_them():
    form = shape(inside("import numpy\nimport shapely\nassert numpy.linalg.det(numpy.eye(2)) == 1\n"
                        "assert shapely.box(0, 0, 1, 1).area == 1"))  # fmt: skip
    assert form.scene(form.Params(), Fill()).bodies


def test_what_it_prints_goes_nowhere(capfd):
    form = shape(inside("import sys\nprint('hello')\nsys.stderr.write('there')\nprint(input() if False else '')"))
    assert form.scene(form.Params(), Fill()).bodies
    assert capfd.readouterr() == ("", "")


def test_others_go_on_after_one_that_has_ended(short):
    bad = shape(inside("import os\nos._exit(1)"))
    with pytest.raises(BadInput):
        bad.scene(bad.Params(), Fill())
    good = shape(TEMPLATE)
    assert good.scene(good.Params(), Fill()).bodies


def change(old, new):
    assert old in TEMPLATE
    return TEMPLATE.replace(old, new)


WRONG = [
    ("def scene(", "this is wrong", "zig.py, line {}: SyntaxError"),
    ("class Params(Envelope)", "class Params", "parameter|Params has no electrode_mm; expected a dataclass"),
    ('"help": "Height of the blocks.", ', "", "parameter height_mm has no help; write metadata="),
    (', "range": (0.05, 5.0)})\n    film', "})\n    film", "parameter height_mm has no range; write metadata="),
    ('"film", fill.film', '"../film", fill.film', "body '../film': expected a name of its own"),
    ('"film", fill.film', '"blocks", fill.film', "body 'blocks': expected a name of its own"),
    ('"film", fill.film', '"film", "gold"', "body 'film': material 'gold' is none of the design's; take it from fill"),
    ('"bottom"),', '"left"),', "body 'bottom_electrode': terminal 'left'; expected top, middle, bottom"),
    ("box(*whole, low, film)", "box(*whole, low, 1e9)", "body 'film': .* along z; expected within 0 to"),
    ("p.width_mm, top + p.isolation_mm))", "p.width_mm, float('nan')))", "ValueError|three lengths above 0"),
    ("Scene(bodies, ", "Scene((), ", "the scene has no bodies"),
    ("return self.length_mm / self.period_mm", "return -1", "cells.. is -1; expected a number above 0"),
    ('"range": (0.05, 5.0)})\n    film', '"range": (0, 10**400)})\n    film', "parameter height_mm has no range;"),
    ('"range": (0.5, 50.0)', '"choices": ("4", "4\\x1b[2J")', "is not among its choices, or one cannot be printed"),
    ("return self.length_mm / self.period_mm", "return 1e30", "1e.30 cells of the pattern"),
]


@pytest.mark.parametrize(("old", "new", "expected"), WRONG, ids=[new[:30] or "none" for _, new, _ in WRONG])
def test_what_no_sensor_has_is_refused(old, new, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "shapes").mkdir()
    text = change(old, new)
    (tmp_path / "shapes" / "zig.py").write_text(text)
    shape_files.trust("zig", text)
    with pytest.raises((BadInput, OutOfRange)) as error:
        make({"shape": "zig"})
    assert re.search(expected.format(line_of(text, new)), str(error.value)), str(error.value)
    assert "\n" not in str(error.value)


def test_its_process_ends_with_this_one():
    """An endless shape of a process that was killed."""
    if not sys.platform.startswith("linux"):
        pytest.skip("the system does not end it there")
    code = (
        "import sys; from sensorgen.design import shape_files\n"
        "shape_files.trust('zig', sys.argv[1])\n"
        "p = shape_files._process('zig', sys.argv[1]); print(p._process.pid, flush=True); p._process.wait()"
    )
    parent = subprocess.Popen([sys.executable, "-c", code, TEMPLATE], stdout=subprocess.PIPE, encoding="utf-8")
    child = int(parent.stdout.readline())
    os.kill(child, 0)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    while True:  # ends when the system has ended it; the suite's own time limit is the other way out
        try:
            os.kill(child, 0)
            if Path(f"/proc/{child}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] == "Z":
                break
        except (ProcessLookupError, FileNotFoundError):
            break
