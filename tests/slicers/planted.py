"""Faults to plant in G-code of PrusaSlicer for the Diabase: how to change the file, and what the check makes of it.

Each fault is a name, a change of the file's lines, and what is expected: the rules of which one must refuse it; a rule
that warns, after "warns:"; or, after "argued:", why the file is accepted.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

Lines = list[str]
Edit = Callable[[Lines], Lines]


@dataclass(frozen=True)
class Fault:
    """A fault: its name, how to plant it, and what is expected."""

    name: str
    edit: Edit
    expected: str


def _printed(line: str) -> bool:
    return re.match(r"G1 .*[XY].*E\.?[0-9]", line) is not None


def middle(lines: Lines) -> int:
    """A printed line of a wall or infill about half through the file."""
    return _middle("\n".join(lines))


@cache
def _middle(text: str) -> int:
    lines = text.split("\n")
    kind, found = "", []
    for k, line in enumerate(lines):
        kind = line if line.startswith(";TYPE") else kind
        if _printed(line) and "tower" not in kind and "Skirt" not in kind and "Custom" not in kind:
            found.append(k)
    return found[len(found) // 2]


def amid(*new: str) -> Edit:
    """Put lines between printed lines."""
    return lambda lines: [*lines[: middle(lines)], *new, *lines[middle(lines) :]]


def before(head: str, *new: str, nth: int = 0) -> Edit:
    """Put lines before the nth line that starts so."""
    return lambda lines: [*lines[: _at(lines, head, nth)], *new, *lines[_at(lines, head, nth) :]]


def after(head: str, *new: str, nth: int = 0) -> Edit:
    """Put lines after the nth line that starts so."""
    return lambda lines: [*lines[: _at(lines, head, nth) + 1], *new, *lines[_at(lines, head, nth) + 1 :]]


def _at(lines: Lines, head: str, nth: int) -> int:
    return [k for k, line in enumerate(lines) if line.startswith(head)][nth]


def sub(pattern: str, by: str, count: int = 0) -> Edit:
    """Replace a pattern in all lines, or in so many places; it must be there."""

    def edit(lines: Lines) -> Lines:
        text, changes = re.subn(pattern, by, "\n".join(lines), count=count, flags=re.MULTILINE)
        assert changes, pattern
        return text.split("\n")

    return edit


def scaled(letter: str, factor: float, where: Callable[[Lines], range] | None = None, shift: float = 0.0) -> Edit:
    """Scale and shift a word of printed lines, in all the file or a part of it."""

    def edit(lines: Lines) -> Lines:
        part = where(lines) if where else range(len(lines))
        new = list(lines)
        for k in part:
            if letter == "Z" or _printed(lines[k]):
                new[k] = re.sub(
                    rf"(?<=[ ]){letter}(-?[0-9.]+)", lambda m: f"{letter}{float(m[1]) * factor + shift:.5f}", lines[k]
                )
        assert new != lines
        return new

    return edit


def of_tool(tool: int, nth: int = 0) -> Callable[[Lines], range]:
    """Lines from the nth time that a tool is taken to the next change."""

    def part(lines: Lines) -> range:
        start = _at(lines, f"T{tool}", nth)
        end = next((k for k in range(start + 1, len(lines)) if re.match(r"T[0-9]", lines[k])), len(lines))
        return range(start, end)

    return part


def layer(number: int) -> Callable[[Lines], range]:
    """Lines of a layer, from 1."""

    def part(lines: Lines) -> range:
        starts = [k for k, line in enumerate(lines) if line.startswith(";LAYER_CHANGE")] + [len(lines)]
        return range(starts[number - 1], starts[number])

    return part


def without(where: Callable[[Lines], range], *, printed_only: bool = False) -> Edit:
    """Leave lines out; moves of filament stay moves if only printed lines are wanted."""

    def edit(lines: Lines) -> Lines:
        part = where(lines)
        return [line for k, line in enumerate(lines) if k not in part or (printed_only and not _printed(line))]

    return edit


def shifted(tool: int, x: float) -> Edit:
    """Shift all places of a tool in the sensor."""

    def edit(lines: Lines) -> Lines:
        hand, new = 0, []
        for line in lines:
            hand = int(line[1]) if re.match(r"T[0-9]", line) else hand
            near = hand == tool and line.startswith("G1")
            new.append(re.sub(r"X(-?[0-9.]+)", lambda m: f"X{float(m[1]) + x:.3f}", line) if near else line)
        return new

    return edit


def strip(lines: Lines) -> Lines:
    """Leave out what is printed of one of five strips."""
    new = list(lines)
    for k in of_tool(3, 2)(lines):
        found = re.search(r"X(-?[0-9.]+)", lines[k])
        if found and -0.9 < float(found[1]) < -0.1 and _printed(lines[k]):
            new[k] = re.sub(r" E\S+", "", lines[k])
    assert new != lines
    return new


def of_model(where: Callable[[Lines], range]) -> Edit:
    """Leave out the sensor's printed lines, those near the middle of the bed; the tower stays."""

    def edit(lines: Lines) -> Lines:
        part, new, near = where(lines), [], True
        for k, line in enumerate(lines):
            found = re.search(r"X(-?[0-9.]+)", line) if line.startswith("G1") else None
            near = abs(float(found[1])) < 10 if found else near
            new += [] if k in part and near and _printed(line) else [line]
        return new

    return edit


def of_kind(kind: str, change: Callable[[str], str | None]) -> Edit:
    """Change the printed lines of a kind, or leave them out."""

    def edit(lines: Lines) -> Lines:
        here, new = False, []
        for line in lines:
            here = kind in line if line.startswith(";TYPE") else here
            made = change(line) if here and _printed(line) else line
            new += [] if made is None else [made]
        assert new != lines
        return new

    return edit


def swapped(lines: Lines) -> Lines:
    """The two tools swapped, with their temperatures."""
    other = {"3": "4", "4": "3"}
    return [
        re.sub(r"^(T|M116 P|M568 P|G10 P)([34])", lambda m: m[1] + other[m[2]], line) if line[:1] in "TMG" else line
        for line in lines
    ]


def swapped_tools_only(lines: Lines) -> Lines:
    """The two tools swapped, with the temperatures of their materials."""
    other, heat = {"3": "4", "4": "3"}, {"3": "210", "4": "230"}
    new = swapped(lines)
    return [re.sub(r"^G10 P([34]) S2[13]0", lambda m: f"G10 P{m[1]} S{heat[other[m[1]]]}", line) for line in new]


def cut(share: float) -> Edit:
    """Cut at a share of the file, with a clean end."""

    def edit(lines: Lines) -> Lines:
        end = _at(lines, "G10 P3 S0 R0", 0)
        start = max(k for k in range(int(share * end)) if lines[k].startswith(";LAYER_CHANGE"))
        return [*lines[:start], "G1 E-4.7 F2400", *lines[end:]]

    return edit


def moved(x: float, y: float, kind: str) -> Edit:
    """Shift the places of a kind of line."""

    def change(line: str) -> str:
        for letter, by in (("X", x), ("Y", y)):
            line = re.sub(
                rf"{letter}(-?[0-9.]+)", lambda m, letter=letter, by=by: f"{letter}{float(m[1]) + by:.3f}", line
            )
        return line

    def edit(lines: Lines) -> Lines:
        here, new = False, []
        for line in lines:
            here = kind in line if line.startswith(";TYPE") else here
            new.append(change(line) if here and line.startswith("G1") else line)
        assert new != lines
        return new

    return edit


def twice(where: Callable[[Lines], range]) -> Edit:
    """Repeat some lines."""

    def edit(lines: Lines) -> Lines:
        part = where(lines)
        return [*lines[: part.stop], *lines[part.start : part.stop], *lines[part.stop :]]

    return edit


def at_middle(change: Callable[[str], str]) -> Edit:
    """Change one printed line."""
    return lambda lines: [change(line) if k == middle(lines) else line for k, line in enumerate(lines)]


# Commands that the printer does not take in a print, between printed lines.
_REFUSED = (
    "G29", "G30", "G32", "G28", "G28 Z", "G38.2 Z-5", "G1 U360", "G1 U-9.2 F9900", "G1 V200", "G1 W31", "G1 A365",
    "G0 C10", "G1 X0 Y0 U90", "M3 S10000", "M4 S10000", "M5", "M106 P1 S0", "M106 P8 S255", "M106 P3 S255 T45",
    "M30 0:/sys/config.g", "M471 S\"0:/sys/config.g\" T\"0:/sys/old.g\"", "M28 config.g", "M23 other.g", "M32 other.g",
    "M207 S100 F3000", "M566 X9999 Y9999", "M350 X256 Y256", "M204 P90000", "M201 X99999", "M906 X5000",
    "M143 S400", "M302 P1", "M203 X90000", "M208 X900", "M569 P0 S0", "M584 X1 Y0", "M42 P1 S1", "M290 S-0.5 R0",
    "G92 X100", "G92 Z5", "M112", "M999", "M81", "M2", "M99", "M221 S300", "M220 S500", "G55", "G59.3",
    "G10 L2 P1 X10", "G10 L20 P1 X0", "G10 P4 X1", "M206 Z-0.2", "M564 S0", "M579 X1.1", "M92 E840", "M200 D1.75",
    "G68 R30", "G93", "G18", "G19", "G53 G1 X0", "G5 X9 Y9 I1 J1 P1 Q1", "M556 S100 X1", "M563 P4 D0 H1", "M567 P4",
    "M592 D1 A0.1", "M669 K1", "M37 S1", "M452", "M453", "M701 S\"etpu\"", "M997", "M500", "M502", "M561", "M303 H1",
    "M307 H1 A9", "M308 S0 Y\"thermistor\"", "M950 H9", "M574 X0", "M572 D2 S5", "G4 S99999", "M84 S1", "M18", "M84",
    "M98 P\"0:/macros/mine.g\"", "T4 P0", "T1.5", "M1000", "M42", "M280 P0 S90", "M121", "G60 S0", "M501",
)  # fmt: skip

_WHY = "command macro read reach tool end home level"
COMMANDS = tuple(Fault(f"{command} amid the print", amid(command), _WHY) for command in _REFUSED)
_MORE_THAN = "what 5 % of a filament's diameter makes too"

GEOMETRY = (
    Fault("first layer at Z 0", sub(r"^G1 Z\.1 F3000", "G1 Z0 F3000"), "first-layer layers"),
    Fault("first layer at Z 0.3", sub(r"^G1 Z\.1 F3000", "G1 Z0.3 F3000"), "first-layer layers below"),
    Fault("everything 0.09 mm too low", scaled("Z", 1.0, shift=-0.09), "first-layer"),
    Fault("everything 0.02 mm too high", scaled("Z", 1.0, shift=0.02), "first-layer"),
    Fault("everything 1 mm too high", scaled("Z", 1.0, shift=1.0), "first-layer"),
    Fault("heights twice as large", scaled("Z", 2.0), "first-layer"),
    Fault("heights 2 % larger", scaled("Z", 1.02), "layers"),
    Fault("0.003 mm too low", scaled("Z", 1.0, shift=-0.003), "argued: below what the printer places"),
    Fault("one layer 0.05 mm too low", scaled("Z", 1.0, layer(7), -0.05), "layers"),
    Fault("one layer left out", without(layer(6)), "layers"),
    Fault("a layer of parts under a line wide left out", of_model(layer(7)), "warns: layers"),
    Fault("the first layer left out", without(layer(1), printed_only=True), "first-layer layers"),
    Fault("the last layer left out", cut(0.999), "layers"),
    Fault("three layers left out", without(lambda lines: range(layer(5)(lines).start, layer(7)(lines).stop)), "layers"),
    Fault("a layer without its printed lines", without(layer(4), printed_only=True), "layers"),
    Fault("a layer printed twice", twice(layer(5)), "volume"),
    Fault("cut at 20 % with a clean end", cut(0.2), "layers"),
    Fault("cut at 60 % with a clean end", cut(0.6), "layers"),
    Fault("cut at 97 % with a clean end", cut(0.97), "layers"),
    Fault("the middle cut out", lambda lines: lines[:900] + lines[1500:], "layers volume material tool"),
    Fault("cut at 50 % without an end", lambda lines: lines[: len(lines) // 2], "heat-left"),
    Fault("cut within a line", lambda lines: [*lines[:1500], lines[1500][:7]], "heat-left read"),
    Fault("two prints, one after the other", lambda lines: lines + lines, "end"),
    Fault("tools swapped with their temperatures", swapped, "material"),
    Fault("tools swapped, each as hot as its material wants", swapped_tools_only, "material"),
    Fault("one layer by the other tool", lambda lines: [re.sub(r"^(T|M116 P)4", r"\g<1>3", line)
        if k in of_tool(4, 1)(lines) else line for k, line in enumerate(lines)], "material volume"),
    Fault("a tool that has no material", sub(r"^(T|M116 P|M568 P|G10 P)4", r"\g<1>5"), "tool"),
    Fault("a tool that the printer lacks", sub(r"^T4", "T7"), "tool"),
    Fault("slicer's tool numbers", sub(r"^(T|M116 P|M568 P|G10 P)3", r"\g<1>2"), "tool"),
    Fault("no tool is taken", sub(r"^T[34]\n", ""), "tool"),
    Fault("T4 in mid-line", at_middle(lambda line: f"{line} T4"), "command"),
    Fault("all E x 10", scaled("E", 10.0), "width volume melt"),
    Fault("all E x 3", scaled("E", 3.0), "width volume"),
    Fault("all E x 1.5", scaled("E", 1.5), "volume"),
    Fault("all E x 0.95", scaled("E", 0.95), f"argued: {_MORE_THAN}"),
    Fault("all E x 0.7", scaled("E", 0.7), "volume"),
    Fault("all E x 0.1", scaled("E", 0.1), "volume width"),
    Fault("E x 3 for one tool's stretch", scaled("E", 3.0, of_tool(4, 1)), "width volume"),
    Fault("E x 0.3 for one tool's stretch", scaled("E", 0.3, of_tool(4, 1)), "volume purge"),
    Fault("E x 0.5 in one layer", scaled("E", 0.5, layer(4)), "volume"),
    Fault("one line with E x 20", at_middle(lambda line: re.sub(r"E\S+", "E2", line)), "width speed melt volume"),
    Fault("filament of 2.85 mm", scaled("E", (1.75 / 2.85) ** 2), "volume"),
    Fault("E as volumes", scaled("E", 2.405), "width volume"),
    Fault("twelve retractions of 14 mm", amid(*["G1 E-14 F2400"] * 12), "purge"),
    Fault("twelve pushes of 14 mm", amid(*["G1 E14 F2400"] * 12), "purge"),
    Fault("one push of 40 mm", amid("G1 E40 F2400"), "purge"),
    Fault("infill left out", of_kind("Solid infill", lambda _: None), "volume"),
    Fault("one tool's places shifted by 0.3 mm", shifted(4, 0.3), "place"),
    Fault("one strip left out", strip, "volume"),
    Fault("walls left out", of_kind("External perimeter", lambda _: None), "volume"),
    Fault("no purge at all", of_kind("Wipe tower", lambda _: None), "purge"),
    Fault("no purge of one tool", lambda lines: of_kind_of(lines, of_tool(4, 0)), "purge"),
    Fault("tower on the sensor", moved(-175.0, -59.0, "Wipe tower"), "clear"),
    Fault("tower beside the bed", moved(60.0, 0.0, "Wipe tower"), "bed reach"),
    Fault("skirt on the sensor", moved(8.0, 4.0, "Skirt"), "clear"),
    Fault("a line far from the sensor", amid("G1 X60 Y60 F7200", "G1 X70 Y60 E.4 F1200", "G1 X0 Y0 F7200"), "clear"),
    Fault("a line off the bed", amid("G1 X60 Y80 F7200", "G1 X60 Y89 E.4 F1200", "G1 X0 Y0 F7200"), "bed clear"),
    Fault("an arc off the bed", amid("G1 X190 Y0", "G3 X190 Y20 I0 J10 E.4 F1200", "G1 X0 Y0 F7200"), "bed"),
    Fault("a move beyond the axis", amid("G1 X300 F7200"), "reach"),
    Fault("a plunge", amid("G1 Z.05", "G1 X3"), "below layers first-layer"),
    Fault("a plunge while printing", amid("G1 X3 Y1 Z.2 E.1"), "below layers"),
    Fault("a helix into the print", amid("G2 X1 Y1 Z.1 I1 J1 E.2"), "below layers"),
    Fault("inches", before("G1 ", "G20"), "first-layer reach bed layers"),
    Fault("relative places", amid("G91"), "relative"),
    Fault("all places named 0", amid("G92"), "layers"),
    Fault("absolute E", before("G1 ", "M82"), "absolute-e"),
    Fault("a wall moved by 2 mm", moved(2.0, 0.0, ";TYPE:External"), "volume clear material width"),
    Fault("everything 30 mm to the left", moved(-30.0, 0.0, ";TYPE"), "place clear"),
)  # fmt: skip


def of_kind_of(lines: Lines, where: Callable[[Lines], range]) -> Lines:
    """Without the tower's lines of one stretch."""
    part = where(lines)
    rest = of_kind("Wipe tower", lambda _: None)([";TYPE:Wipe tower", *lines[part.start : part.stop]])
    return [*lines[: part.start], *rest, *lines[part.stop :]]


HEAT = (
    Fault("eTPU at 155 C", sub(r"^G10 P3 S210", "G10 P3 S155"), "material"),
    Fault("eTPU at 249 C", sub(r"^G10 P3 S210", "G10 P3 S249"), "material"),
    Fault("X60 at 200 C", sub(r"^G10 P4 S230", "G10 P4 S200"), "material"),
    Fault("X60 at 260 C", sub(r"^G10 P4 S230", "G10 P4 S260"), "temperature"),
    Fault("cooled while printing", amid("G10 P4 S120 R120", "G10 P3 S120 R120"), "cold material"),
    Fault("switched off while printing", amid("M568 P3 A0", "M568 P4 A0"), "cold"),
    Fault("one tool never heated", sub(r"^G10 P4 S230.*\n", ""), "cold"),
    Fault("bed never heated", sub(r"^M190.*\n", ""), "material"),
    Fault("bed at 119 C", sub(r"^M190 S75", "M190 S119"), "material"),
    Fault("bed at 130 C", sub(r"^M190 S75", "M190 S130"), "temperature"),
    Fault("bed at 30 C", sub(r"^M190 S75", "M190 S30"), "material"),
    Fault("bed switched off amid the print", amid("M140 S0"), "material"),
    Fault("bed not waited for", lambda lines: sub(r"^M116.*\n", "")(sub(r"^M190 S75", "M140 S75")(lines)), "wait"),
    Fault("no M116 anywhere", sub(r"^M116.*\n", ""), "wait"),
    Fault("one M116 left out after a change", lambda lines: [line for k, line in enumerate(lines)
        if k != _at(lines, "M116 P4", 1)], "wait"),
    Fault("off and on before M116", after("T4", "G10 P4 S0", "G10 P4 S230 R180", nth=2), "argued: it is waited for"),
    Fault("off and on without waiting", amid("G10 P3 S0", "G10 P4 S0", "G10 P3 S210 R180", "G10 P4 S230 R180"), "wait"),
    Fault("temperature without a tool", amid("M104 S210"), "temperature"),
    Fault("temperature of another tool", amid("G10 P9 S210"), "tool"),
    Fault("hot tools at the end", sub(r"^(G10 P[34] S0|M0).*\n", ""), "heat-left"),
    Fault("no end at all", lambda lines: lines[: _at(lines, "G28", 1)], "warns: end"),
)  # fmt: skip

START = (
    Fault("no homing", sub(r"^G28\nG32\n", "G32\n"), "home"),
    Fault("homed by the probe's macro alone", sub(r"^G28\nG32\n", "G32\n"), "home"),
    Fault("Z not stated after a change", sub(r"^G1 Z\S+ F3000\n(?=G1\s+X\S+\s+E)", ""), "z"),
    Fault("no levelling", sub(r"^G32$", "G28"), "level"),
    Fault("homed without levelling, then probed late", lambda lines: amid("G32")(sub(r"^G32$", "G28")(lines)), "level"),
    Fault("no M83", sub(r"^M83.*\n", ""), "absolute-e"),
    Fault("no G90", sub(r"^G90.*\n", ""), "warns: start"),
    Fault("moves before homing", before("G28", "G1 X5 Y0 F3000"), "home"),
    Fault("an end command in the middle", amid("M0 H1"), "end"),
    Fault("a print line at 12001 mm/min", at_middle(lambda line: f"{line} F12001"), "speed melt"),
    Fault("a feed of 0", amid("G1 X1 Y1 E.1 F0"), "speed"),
    Fault("printing at 200 mm/s", sub(r"F1200\b", "F9000"), "melt speed"),
    Fault("travel at 500 mm/s", sub(r"F7200", "F30000"), "warns: speed"),
    Fault("un-retract with Z at 4800 mm/min", after("T4", "G1 Z40 F6000", "G1 Z.4 E5 F4800"), "warns: speed"),
    Fault("M73 with a wrong share", amid("M73 P900"), "argued: only the display shows it"),
    Fault("a pause", amid("M226"), "pause"),
    Fault("a message", amid('M291 P"stop; M112" S1'), "argued: only the display shows it"),
    Fault("baby steps of 0.05 mm", amid("M290 S0.05 R0"), "warns: height"),
    Fault("fan of the part off", amid("M106 P3 S0"), "fan"),
)

FORM = (
    Fault("a wrong checksum", at_middle(lambda line: f"N7 {line}*1"), "read"),
    Fault("small letters", amid("g1 u360"), "command"),
    Fault("no blanks", amid("G1U360"), "command"),
    Fault("two commands in a line", amid("G90 M3 S1000"), "command"),
    Fault("behind a remark in brackets", amid("(safe) M30 config.g"), "command"),
    Fault("numbered", amid("N12 M3"), "command"),
    Fault("a move of the firmware's language", amid("if true", "  G1 U360"), "command"),
    Fault("a loop", amid("while true", "  G30"), "command"),
    Fault("an expression", amid("G1 X{move.axes[0].max} E.1"), "read"),
    Fault("a letter in a number", at_middle(lambda line: line.replace("X", "XO", 1)), "read"),
    Fault(
        "a decimal comma",
        at_middle(lambda line: re.sub(r"X(-?)(\d*)\.(\d)", r"X\g<1>\g<2>,\g<3>", line, count=1)),
        "read",
    ),
    Fault("a place without a command", amid("X5 Y5 E.1"), "read"),
    Fault("not a number", amid("G1 Xnan E.1"), "read"),
    Fault("400 digits", amid("G1 X" + "9" * 400), "read reach"),
    Fault("G with 400 digits", amid("G" + "9" * 400), "read"),
    Fault("a number as a power", amid("G1 X1e3 E.1"), "melt width"),
    Fault("I in a straight move", at_middle(lambda line: f"{line} I1"), "read"),
    Fault("R in a straight move", at_middle(lambda line: f"{line} R2"), "read"),
    Fault("H in a move", amid("G1 H2 X5"), "read command"),
    Fault("an arc without a centre", amid("G2 X1 Y1 E.1"), "read"),
    Fault("noise", amid("\x07\x08 ]]", "%%"), "read"),
)

FAULTS = {"commands": COMMANDS, "geometry": GEOMETRY, "heat": HEAT, "start": START, "form": FORM}
