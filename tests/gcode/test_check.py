"""Good files pass, and one changed line of each kind is found: with its rule, its severity and its line."""

import re

import pytest

from sensorgen.design.printer import load_printer
from sensorgen.export.gcode.check import check

from .good import LAB, MAKER, OWN, changed  # isort: skip

DIABASE = load_printer("diabase-h5")
WITH_SPINDLES = DIABASE.model_copy(update={"control": DIABASE.control.model_copy(update={"spindles": (1, 2)})})


def found(lines, machine=DIABASE):
    return {(f.rule, f.severity) for f in check(lines, machine).findings}


def errors(lines, machine=DIABASE):
    return {f.rule for f in check(lines, machine).findings if f.severity == "error"}


@pytest.mark.parametrize(
    ("text", "warned"),
    [(MAKER, {"start", "fan", "speed"}), (LAB, {"start", "speed", "wait"}), (OWN, set())],
    ids=["maker", "lab", "own"],
)
def test_good_files_pass_with_their_warnings(text, warned):
    result = check(text.splitlines(), DIABASE)
    assert result.errors() == []
    assert {f.rule for f in result.findings if f.severity == "warning"} == warned


# Text of the good file, the line to change, what to make of it, the rule that must refuse it; what is not planted in
# a slicer's file by tests/slicers/planted.py.
PLANTED = [
    ("reach", OWN, "G1 X5 Y5 F7200", "G1 X209 Y5 F7200"),
    ("reach", OWN, "G1 X5 Y5 F7200", "G1 X5 Y-91 F7200"),
    ("reach", OWN, "G1 Z.2 F3000", "G1 Z211 F3000"),
    ("reach", OWN, "G1 Z.1 F3000", "G1 Z-.1 F3000"),
    ("reach", LAB, "G3 X18.100 Y-3.900 I0.000 J0.500 E0.0575 F1800", "G3 X18.1 Y-4.9 I0 J95.2 E0.5 F1800"),
    ("bed", OWN, "G1 X15 Y5 E.2 F1200", "G1 X196 Y5 E.2 F1200"),
    ("bed", OWN, "G1 Z.2 F3000", "G1 Z205 F3000"),
    ("below", OWN, "G1 Z.2 F3000", "G28\nG32\nG1 Z.05 F3000"),
    ("below", OWN, "G1 Z.2 F3000", "G92 E0\nG1 Z.05 F3000"),
    ("cold", OWN, "G10 P4 S230 R180", "G10 P4 R180"),
    ("cold", OWN, "M568 P4 A2", "G10 P4 S120"),
    ("cold", OWN, "M116 P4", "M568 P4 A0\nG10 P4 S230"),
    ("cold", OWN, "M568 P4 A2", "M104 T4 S0"),
    ("tool", OWN, "T4", "T0"),
    ("tool", OWN, "T3", ""),
    ("tool", OWN, "M568 P4 A2", "M568 P7 A2"),
    ("tool", OWN, "M568 P4 A2", "M109 T0 S230"),
    ("tool", OWN, "M116 P4", "M116 P9"),
    ("tool", MAKER, 'M98 P"tprime4.g" ; tool change', 'M98 P"tprime6.g" ; tool change'),
    ("tool-change", MAKER, 'M98 P"tprime4.g" ; tool change', 'T4\nM98 P"tprime4.g"'),
    ("tool-change", OWN, "T4", 'M98 P"tprime4.g"\nG1 X3 F600\nT4'),
    ("absolute-e", OWN, "M501", "M82"),
    ("temperature", OWN, "G10 P4 S230 R180", "G10 P4 S251 R180"),
    ("temperature", OWN, "G10 P4 S230 R180", "G10 P4 S230 R260"),
    ("temperature", OWN, "M568 P4 A2", "M109 S230"),
    ("temperature", OWN, "M190 S75 ; set bed temperature", "M190 S121"),
    ("home", OWN, "G28\nG32", "G32\nG28"),
    ("home", LAB, "G28\nG32", "G28 X Y\nG29"),
    ("home", OWN, "T4", "M84\nT4"),
    ("home", OWN, "T4", "M18 Y\nT4"),
    ("z", OWN, "G1 X0 Y20 Z.1 F7200", "G1 X0 Y20 F7200"),
    ("z", MAKER, "G1 Z.4 F3000", "G91\nG1 Z0\nG90"),
    ("speed", OWN, "G1 X15 Y5 E.2 F1200", "G1 X15 Y5 Z9 E.2 F9000"),
    ("speed", OWN, "G1 X15 Y5 E.2 F1200", "G1 X5.1 Y5 E.2 F6000"),
    ("heat-left", OWN, "G10 P4 S0 R0", "M84\nM30"),
    ("heat-left", MAKER, "M0 H1", "M84"),
    ("purge", LAB, "G1 E15.000 F1800", "G1 E15.1 F1800"),
    ("purge", OWN, "G1 E-4.7 F2400", "G1 E-25 F2400"),
    ("macro", MAKER, "G32", 'G32\nM98 P"mine.g"'),
    ("relative", MAKER, "G1 X180 Y85 Z200 F12000 ; End", "G91"),
    ("pause", OWN, "T4", "T4\nM226"),
    ("command", OWN, "T4", "T4\nM221 D1 S105\nM221 D0 S100"),
    ("command", OWN, "T4", "G10 P4 Z-0.3\nT4"),
    ("read", OWN, "G1 X15 Y5 E.2 F1200", "G1 X-nan Y5 E.2 F1200"),
    ("read", OWN, "G1 X15 Y5 E.2 F1200", "G1 X15 Y5 E.2 F1200 \N{DEGREE SIGN}"),
    ("read", OWN, "M116", "M117 Gr\N{LATIN SMALL LETTER U WITH DIAERESIS}n"),
    ("read", OWN, "G1 X15 Y5 E.2 F1200", "G1 X\N{ARABIC-INDIC DIGIT FIVE} E.2"),
]  # fmt: skip


@pytest.mark.parametrize(("rule", "text", "old", "new"), PLANTED, ids=lambda x: x[:24].strip() if x else "gone")
def test_a_planted_fault_is_refused(rule, text, old, new):
    lines = changed(text, old, new)
    if (rule, new) == ("heat-left", "M84\nM30"):
        lines = [line for line in lines if line != "M0 H1\n"]
    result = check(lines, DIABASE)
    faults = [f for f in result.errors() if f.rule == rule]
    assert faults, [f.rule for f in result.findings]
    assert all(f.message and f.advice and 1 <= f.line <= len(lines) for f in faults)


@pytest.mark.parametrize(
    ("text", "old", "new"),
    [
        (MAKER, 'M98 P"tprime4.g" ; tool change', "T4\nM116 P4"),
        (LAB, "T1", 'M98 P"tprime1.g"'),
        (LAB, "T1", 'M98 P"0:/macros/tprime1.g"'),
        (OWN, "G10 P4 S230 R180", "G10 P4 S230"),
        (OWN, "G10 P4 S230 R180", "M104 T4 S230"),
        (OWN, "G10 P4 S230 R180", "M109 T4 S230 R180"),
        (OWN, "G10 P4 S230 R180", "G10 P4 R180\nG10 P4 S230"),
        (OWN, "M568 P4 A2", "G91\nG1 Z5\nG1 Z-5\nG90"),
        (OWN, "M568 P4 A2", "M568 P4 A0"),
        (OWN, "M116 P4", "M568 P4 A0\nM104 T4 S230"),
        (OWN, "M568 P4 A2", 'M291 P"Go on; it\'s fine?" S3'),
        (OWN, "M116", "M25"),
        (OWN, "T4", "M221 S100\nM221\nM290 S0 R0\nM220 S100\nG17\nM204 P500\nM572 D1 S0\nM117 Layer 2; half\nT4"),
        (OWN, "G1 X15 Y5 E.2 F1200", "G1 Z.1 E9 F6000"),
        (LAB, "G1 Z0.850 E-5.0000 F4800", "G1 Z0.850 E-5.0000 F9000"),
        (OWN, "M0 H1", "M0 H1\nM81"),
        (OWN, "G1 X5 Y5 F7200", "G10\nG1 X5 Y5 F7200\nG11"),
        (OWN, "G1 X5 Y5 F7200", "G1 X208 Y-90 F7200"),
        (OWN, "G1 X5 Y5 F7200", "G1 X5 Y5 F20000"),
        (OWN, "G1 X15 Y5 E.2 F1200", "G1 X15 Y5 E.2 F12000"),
        (OWN, "G28\nM501", "G1 Z210\nG28\nM501"),
        (OWN, "M83", "M83\nG92 E0"),
        (OWN, "M501", "M84"),
        (OWN, "T4", "T4\nT4"),
        (OWN, "T4", "T-1\nT4"),
        (OWN, ";TYPE:Custom", "; printed at 210 \N{DEGREE SIGN}C"),
    ],
)
def test_what_must_be_accepted_is(text, old, new):
    assert errors(changed(text, old, new)) == set()


def test_a_tool_with_nothing_on_it_may_be_refused():
    def said(loaded):
        return [f.message for f in check(OWN.splitlines(), DIABASE, loaded, others_empty=True).errors()]

    assert said({3: "etpu", 4: "x60"}) == []
    assert said({3: "etpu", 5: "x60"}) == ["tool 4 prints, and nothing is on it; loaded are etpu on 3, x60 on 5"]
    assert len(said({2: "etpu", 5: "x60"})) == 2
    assert check(OWN.splitlines(), DIABASE, {3: "etpu"}).errors() == []


def test_tools_may_be_spindles():
    assert errors(LAB.splitlines()) == set()
    assert errors(LAB.splitlines(), WITH_SPINDLES) == {"tool"}
    assert errors(OWN.splitlines(), WITH_SPINDLES) == set()
    assert errors(changed(OWN, "T4", "T1\nT4"), WITH_SPINDLES) == set()


def test_a_slicers_own_file_is_refused():
    raw = [re.sub(r" R[0-9]+|(?<=M106) P3", "", line) for line in OWN.splitlines()]
    assert "raw" in errors(raw)
    assert "raw" not in errors([line for line in raw if not line.startswith("; generated")])
    assert "raw" not in errors([re.sub(r" R[0-9]+", "", line) for line in OWN.splitlines()])  # its fan has a number


def test_a_file_cut_short_is_refused():
    lines = OWN.splitlines()
    for end in range(16, len(lines) - 4, 5):
        assert "heat-left" in errors(lines[:end])


def test_a_tool_that_still_waits_warm_is_left_on():
    lines = [line.replace("G10 P4 S0 R0", "G10 P4 S0") for line in OWN.splitlines() if line != "M0 H1"]
    (fault,) = check(lines, DIABASE).errors()
    assert (fault.rule, "tools 4 are" in fault.message) == ("heat-left", True)


def test_a_refused_command_says_why_and_where():
    result = check(changed(OWN, "M501", "M501\nM203 X90000 Y90000\nM777"), DIABASE)
    line = OWN.splitlines().index("M501") + 2
    assert [(f.rule, f.severity, f.line, f.message) for f in result.findings] == [
        ("command", "error", line, "M203 sets speed limits"),
        ("command", "error", line + 1, "diabase-h5 has no M777 in its list of commands"),
    ]


@pytest.mark.parametrize("line", ["M42 P1 S1", "M106 P3 S99 T45"])
def test_a_printers_file_changes_the_list(line):
    more = {"M42": "P S0..1", "M106": "P3 S0..255 T45"}
    changed_control = DIABASE.control.model_copy(update={"commands": DIABASE.control.commands | more})
    other = DIABASE.model_copy(update={"control": changed_control})
    lines = changed(OWN, "T4", f"{line}\nT4")
    assert (errors(lines), errors(lines, other)) == ({"command"}, set())
    none = other.model_copy(update={"control": other.control.model_copy(update={"commands": {"M116": None}})})
    assert "command" in errors(OWN.splitlines(), none)


def test_what_stops_or_is_left_on_before_and_after_the_print_is_told():
    assert ("pause", "info") in found(changed(OWN, "M116", "M25"))
    assert ("heat-left", "info") in found(MAKER.splitlines())  # left to the stop macro


@pytest.mark.parametrize("line", ["M290 S0.05 R0", "M290 S0"])
def test_a_height_that_may_be_meant_is_warned_of(line):
    assert found(changed(OWN, "T4", f"T4\n{line}")) == {("height", "warning")}


def test_the_first_line_of_a_kind_is_named():
    lines = [*OWN.splitlines(), "M104 S210", "G28", "M104 S210"]
    (fault,) = check(lines, DIABASE).errors()
    assert (fault.line, fault.count) == (len(OWN.splitlines()) + 1, 2)


def test_another_printer_has_other_rules():
    other = load_printer("prusa-xl5")
    lines = """G90
M83
M190 S60
G28
T0
M109 S215
G1 X100 Y100 Z.2 F6000
G1 X120 E1 F1200
M106 S255
M104 S0
M84"""
    assert found(lines.splitlines(), other) == set()
    assert "reach" in errors([*lines.splitlines(), "G1 X-1"], other)
    assert "heat-left" in errors(lines.splitlines()[:-2], other)
    without_t = [line for line in lines.splitlines() if line != "T0"]
    assert found(without_t, other) == set()  # its first tool is in hand
    assert check(without_t, other).tools[0].tool == 0
    assert {"tool", "cold"} & errors(["M83", "G1 X1 E1"], other) == {"cold"}
