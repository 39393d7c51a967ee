"""``sensorgen gcode check``: exit codes, words and JSON."""

import json

import pytest
from filled import filled

from sensorgen.design.design import make
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.ready import ready

GOOD = """G90
M83
M190 S60
G28
G32
G10 P3 S210 R180
T3
M116 P3
G1 Z0.1 F3000
G1 X10 E.4 F1200
M0 H1
"""


@pytest.fixture
def file(tmp_path):
    def write(old="", new=""):
        assert old in GOOD
        path = tmp_path / "a.gcode"
        path.write_text(GOOD.replace(old, new, 1) if old else GOOD, "utf-8")
        return path

    return write


def test_a_good_file(run, file):
    said = run("gcode", "check", file()).clean
    assert "   3  etpu" in said.out
    assert "1 info" in said.out
    assert "y 0 to 0, z 0.1 to 0.1 mm in the file's coordinates" in said.words


@pytest.mark.parametrize(
    ("old", "new", "words", "code"),
    [
        ("X10", "X300", [], 1),
        ("T3", "T0", [], 1),
        ("M190 S60\n", "", [], 0),
        ("M190 S60\n", "", ["--strict"], 1),
        ("", "", ["--printer", "prusa-xl5"], 1),  # homed elsewhere, and no longer switched off by M0
    ],
)
def test_exit_codes(run, file, old, new, words, code):
    said = run("gcode", "check", file(old, new), *words)
    assert (said.code, said.err) == (code, "")


def test_json_has_lines_and_masses(run, file):
    said = run("gcode", "check", file("X10", "X300"), "--json", "--material", "3=x60")
    data = json.loads(said.out)
    assert said.code == 1
    errors = {f["rule"]: f["line"] for f in data["findings"] if f["severity"] == "error"}
    assert errors == {"reach": 10, "bed": 10, "material": 10}
    assert (data["printer"], data["lines"], data["tools"][0]["material"]) == ("diabase-h5", 11, "x60")
    assert data["tools"][0]["mass_g"] == pytest.approx(0.4 * 2.40528e-3, rel=1e-4)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["no.gcode"], "cannot read 'no.gcode': No such file"),
        (["."], "Is a directory"),
        (["a.gcode", "--printer", "diabase"], "did you mean 'diabase-h5'?"),
        (["a.gcode", "--material", "9=x60"], "'9' is no tool"),
        (["a.gcode", "--material", "3=x61"], "did you mean 'x60'?"),
        ([], "FILE"),
        (["a.gcode", "--design", "no.yaml"], "cannot read 'no.yaml'"),
        (["a.gcode", "--design", "d.yaml", "--printer", "prusa-xl5"], "d.yaml is for diabase-h5"),
        (["a.gcode", "--design", "d.yaml"], "tools [3] print in this G-code; expected [3, 4]"),
        (["both.gcode", "--design", "d.yaml"], "no piece of 10 x 8 mm, as d, in this G-code; it prints 10.44 x 20.44"),
        (["empty.gcode"], "'empty.gcode' is empty"),
        (["ascii.stl"], "'ascii.stl' is no G-code: no line has a command; the first says 'solid part'"),
        (["wide.gcode"], "'wide.gcode' is text as UTF-16; save it as UTF-8"),
        (["nil.gcode"], "'nil.gcode' is no text: byte 4 is 0"),
    ],
)
def test_wrong_input(run, file, words, said, tmp_path):
    file()
    design = "shape: tri\nparameters: {dielectric_mm: 0.2, length_mm: 10.0, width_mm: 8.0}\n"
    (tmp_path / "d.yaml").write_text(design, "utf-8")
    both = f"{GOOD.removesuffix('M0 H1' + chr(10))}T4\nG1 X0 Y20 E1\n"
    for name, content in (
        ("both.gcode", both.encode()), ("empty.gcode", b" \n"), ("ascii.stl", b"solid part\n facet normal 0 0 1\n"),
        ("wide.gcode", GOOD.encode("utf-16")), ("nil.gcode", b"G28\0\n"),
    ):  # fmt: skip
        (tmp_path / name).write_bytes(content)
    before = sorted(tmp_path.iterdir())
    assert said in run("gcode", "check", *words).refusal
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("form", [[], ["--json"], ["--markdown"]])
def test_bytes_that_are_no_text_can_be_shown(run, file, form):
    path = file()
    path.write_bytes(path.read_bytes().replace(b"G28\n", b'M98 P"\xff"\nG1 U\xfe X1\n;TYPE:\xff\nG28\n'))
    said = run("gcode", "check", path, *form)
    assert (said.code, said.err) == (1, "")
    assert "udcff" in said.out


def test_a_file_is_held_against_its_design(run, tmp_path):
    sensor = make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 4.0, "width_mm": 4.0}})
    (tmp_path / "d.yaml").write_text("shape: tri\nparameters: {dielectric_mm: 0.2, length_mm: 4.0, width_mm: 4.0}\n")
    for name, layers in (("good.g", None), ("cut.g", [1, 2, 3, 4, 5, 6])):
        text = filled(sensor, layers).encode()
        (tmp_path / name).write_bytes(b"".join(ready(text, follow(text), sensor.machine)))
    said = run("gcode", "check", "good.g", "--design", "d.yaml", "--json")
    assert (said.code, json.loads(said.out)["findings"], json.loads(said.out)["design"]) == (0, [], "d")
    assert run("gcode", "check", "cut.g").code == 0
    said = run("gcode", "check", "cut.g", "--design", "d.yaml")
    assert (said.code, said.err) == (1, "")
    assert "layer 8 to 13 of 13 is missing: nothing of d is printed up to Z 1.3 mm" in said.words


def test_a_number_of_400_digits_is_a_finding(run, file):
    said = run("gcode", "check", file("G28\n", f"G28\nG{'9' * 400}\nM{'1' * 400}.5\nG1 X{'9' * 400}\n"))
    assert said.code == 1
    assert said.words.count("is no command") == 2
