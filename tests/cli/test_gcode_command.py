"""``sensorgen gcode check``: exit codes, words and JSON."""

import json

import pytest

GOOD = """G90
M83
M140 S60
G28
G32
G10 P3 S210 R180
T3
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
    said = run("gcode", "check", file())
    assert (said.code, said.err) == (0, "")
    assert "   3  etpu" in said.out
    assert "1 info" in said.out


@pytest.mark.parametrize(
    ("old", "new", "words", "code"),
    [
        ("X10", "X300", [], 1),
        ("T3", "T0", [], 1),
        ("M140 S60\n", "", [], 0),
        ("M140 S60\n", "", ["--strict"], 1),
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
    assert {f["rule"]: f["line"] for f in data["findings"] if f["severity"] == "error"} == {"reach": 9, "bed": 9}
    assert (data["printer"], data["lines"], data["tools"][0]["material"]) == ("diabase-h5", 10, "x60")
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
    ],
)
def test_wrong_input(run, file, words, said):
    file()
    result = run("gcode", "check", *words)
    assert result.code == 2
    assert said in result.line


def test_a_binary_file(run, tmp_path):
    (tmp_path / "a.bgcode").write_bytes(b"GCDE\1\0\0\0")
    assert "export it as plain text" in run("gcode", "check", "a.bgcode").line
