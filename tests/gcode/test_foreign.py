"""Files of strangers: findings, never a traceback or a number that is none."""

import json
import math
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.design.printer import load_printer
from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.reading import text_of
from sensorgen.export.gcode.ready import ready

from .good import LAB, MAKER, OWN  # isort: skip

DIABASE = load_printer("diabase-h5")

THUMBNAIL = """\
; thumbnail begin 16x16 188
; iVBORw0KGgoAAAANSUhEUgAAABAAAAAQCAYAAAAf8/9hAAAAnklEQVR4AWMYBQMNGIkx5D8QMDIyMhKjh+n
; T3 M82 G1 X999 E99
; thumbnail end
"""
# As Cura writes for a Marlin printer with absolute E, and OrcaSlicer for a Bambu: another printer's words.
MARLIN = f""";FLAVOR:Marlin
{THUMBNAIL}M140 S60
M105
M190 S60
M104 S205
M109 S205
M82 ;absolute extrusion mode
G21
G28 ;Home
G92 E0
G1 Z2.0 F3000
G1 X10.1 Y20 Z0.28 F5000.0
G1 X10.1 Y200.0 Z0.28 F1500.0 E15
G92 E0
;LAYER:0
M107
G0 F6000 X100.2 Y100.1 Z0.2
;TYPE:SKIRT
G1 F1200 X120 Y100 E0.65
G1 X120 Y120 E1.3
M204 S500
M205 X8 Y8
M117 Printing 1/2; G28
G2 X110 Y130 I-10 J0 E1.9
G3 X100 Y120 R10 E2.5
;TIME_ELAPSED:12.3
M600
G91
G1 E-2 F2700
G1 Z10
G90
M106 S0
M104 S0
M140 S0
M84 X Y E
"""
BAMBU = """\
; HEADER_BLOCK_START
; BambuStudio 01.07
; HEADER_BLOCK_END
M73 P0 R24
M201 X20000 Y20000 Z500 E5000
M620 S0A
M204 S10000
T0
M621 S0A
M1002 gcode_claim_action : 2
G29.1 Z0
M412 S1 ; ===turn on filament runout detection===
M622 J1
M900 K0.02 L1000 M10
; CHANGE_LAYER
; Z_HEIGHT: 0.2
; LAYER_HEIGHT: 0.2
; FEATURE: Outer wall
; LINE_WIDTH: 0.5
G1 X118.2 Y118.3 F42000
G17
G3 Z.6 I1.217 J0 P1  F42000
G1 X137.1 Y118.2 E.7
M623
"""


@pytest.mark.parametrize("text", [MARLIN, BAMBU, THUMBNAIL, "G1", "\n\n", "%\nO1000\nG20 G90 G17\nX1 Y2\nM30\n%"])
def test_other_printers_files_are_followed_and_judged(text):
    result = check(text.splitlines(), DIABASE)
    json.dumps(asdict(result), allow_nan=False)
    assert result.findings


def test_a_marlin_file_is_refused_for_what_it_is():
    rules = {f.rule for f in check(MARLIN.splitlines(), DIABASE).errors()}
    assert {"absolute-e", "temperature", "tool", "level"} <= rules
    motion = follow(MARLIN.splitlines())
    assert motion.extruded_mm.sum() == pytest.approx(15 + 2.5)
    arc = motion.number == MARLIN.splitlines().index("G2 X110 Y130 I-10 J0 E1.9") + 1
    assert motion.length_mm[arc].sum() == pytest.approx(15 * math.pi, rel=1e-3)


def test_a_file_of_something_else_is_told_in_few_lines():
    found = check([f"X{n} marks the spot" for n in range(300)], DIABASE).findings
    assert len(found) < 30
    assert any(f.message.startswith("further lines cannot be read") and f.count > 200 for f in found)


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n\n"])
def test_ends_of_lines_change_nothing(end, tmp_path):
    path = tmp_path / "a.gcode"
    path.write_bytes(end.join(LAB.splitlines()).encode())
    one, other = check(path, DIABASE), check(LAB.splitlines(), DIABASE)
    assert one.tools == other.tools
    assert [(f.rule, f.message) for f in one.findings] == [(f.rule, f.message) for f in other.findings]


@pytest.mark.parametrize("text", [MAKER, OWN])
def test_small_letters_line_numbers_and_checksums_change_nothing(text):
    def numbered(number, line):
        code = f"N{number} {line}"
        return f"{code}*{np.bitwise_xor.reduce(np.frombuffer(code.encode(), dtype=np.uint8))}"

    lines = [line.partition(";")[0].rstrip() for line in text.splitlines() if line[:1] not in (";", "")]
    plain = check(lines, DIABASE)
    assert plain.errors() == []
    lower = [line if '"' in line else line.lower() for line in lines]
    for other in ([numbered(n, line) for n, line in enumerate(lines, 1)], lower):
        again = check(other, DIABASE)
        assert [(f.rule, f.message) for f in again.findings] == [(f.rule, f.message) for f in plain.findings]
        assert again.tools == plain.tools


COMMANDS = """
G0 G1 G2 G3 G4 G10 G11 G17 G18 G20 G21 G28 G32 G53 G54 G90 G91 G92 M0 M82 M83 M98 M104 M106 M107 M109 M116 M140 M190
M290 M568 T0 T1 T3 T4 T9 T-1 T1.5 T99999999999999999999 M117 P"tprime3.g" P"x ;TYPE:x ;LAYER:1 ;LAYER:-9999999999
;LAYER_CHANGE ;WIDTH:0.4 ;HEIGHT:x ( ) *7 N5 {1+1} nan inf X E Xnan E-inf R L2 A1 S0 S210 Pnan Snan S1e9 H1 if while
"""
KNOWN = [*COMMANDS.split(), "\N{DEGREE SIGN}", "\udcff", "\0"]
WORDS = st.one_of(
    st.sampled_from(KNOWN),
    st.builds(
        lambda letter, value: f"{letter}{value:g}",
        st.sampled_from("XYZEFIJRPSTHLAGMN"),
        st.one_of(st.integers(-300, 300), st.floats(allow_nan=True, allow_infinity=True, width=32)),
    ),
    st.text(max_size=6),
)
LINES = st.lists(st.lists(WORDS, max_size=6).map(" ".join), max_size=25)


@settings(max_examples=40, deadline=None)
@given(LINES)
@example(["G91", "G1 X1e38", "G1 X1e38", "G20", "G1 X9" + "9" * 350, "G1 X-9" + "9" * 350, "M83", "G1 E9" + "9" * 350])
@example(["M83", "G2 X1 Y1 I1e300 J1e300", "G3 R1e300 X5", "G2 I0.00001", "G3 X5 Y5 R-0.0001", "G2 I1e200 J1e200 X1"])
@example(["M83", "T99999999999999999999", "G1 X1 E1", "T1.5", "G1 X2 E1", "T999999", "G1 X3 E1"])
@example(["G28", "M83", "T2", "G10 Pnan S210", "G1 X1 E1"])
@example(["G28", "M83", "T2", "G10 P2 Snan", "M104 Tnan S0", "M104 Snan", "M116 Pnan", "G4 Snan", "G1 X1 E1"])
def test_anything_is_followed_without_a_traceback(lines):
    result = check(lines, DIABASE)
    json.dumps(asdict(result), allow_nan=False)
    motion = follow(lines)
    assert np.isfinite(motion.rows).all()
    found = paths.paths_of(motion, DIABASE, "slicer")
    assert (found.filament_mm > 0).all()
    assert len(found.model()) <= len(found)
    try:
        made = b"".join(ready(text_of(lines), motion, DIABASE))
    except BadInput:
        return
    assert made.endswith(b"\n") or not made


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=400), st.sampled_from([b"", b"G28\n", OWN.encode()]))
def test_any_bytes_are_read_or_refused(tmp_path_factory, content, head):
    path = tmp_path_factory.getbasetemp() / "any.gcode"
    path.write_bytes(head + content)
    try:
        result = check(path, DIABASE)
    except BadInput:  # and nothing else
        return
    json.dumps(asdict(result), allow_nan=False)
