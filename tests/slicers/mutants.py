"""Mutants of G-code, each made from its number, and what the check makes of them."""

import random
from pathlib import Path

from filled import filled

from sensorgen.asprinted import agreement
from sensorgen.core import document
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design
from sensorgen.export.gcode.check import check_motion
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.ready import ready

SENSOR = design.make(
    {"shape": "tri", "name": "fuzz", "parameters": {"dielectric_mm": 0.2, "length_mm": 4.0, "width_mm": 4.0}}
)
PIECES = (
    b"G" + b"9" * 400, b"M" + b"1" * 310 + b".5", b"T99999999999999999999", b"G1 X1e308 E1e308", b"G92", b"G91\n",
    b"G20\n", b"M82\n", b"T-1\n", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\0", b"\xff\xfe", b"nan", b"inf", b"-", b".",
    b"{", b'"', b"(", b"*7", b";LAYER:-9999999999\n", b";LAYER_CHANGE\n", b";HEIGHT:1e999\n", b";TYPE:\xc3\xa9\n",
    b"G2 X1 Y1 I1 J1 E1\n", b"G3 R0\n", b"G28\n", b"M0\n", b"G10 P3 Snan\n", b"G4 P1e99\n", b"M98 P\"tprime9.g\"\n",
    b"Z1e9 ", b"X-0.0000000001 ", b"E-99999 ", b"F0 ",
    b"M98 P\"\xff\"\n", b" U\xfe ",
)  # fmt: skip
SWAPS = (
    (b"X", b"Y"), (b"G1", b"G2"), (b".", b""), (b"T3", b"T4"), (b"E", b"E-"), (b"\n", b"\r\n"), (b" ", b""),
    (b"1", b"9"),
    (b"G", b"g"), (b"M", b"G"),
)  # fmt: skip


def base() -> bytes:
    """A good file of the sensor for the printer."""
    text = filled(SENSOR).encode()
    return b"".join(ready(text, follow(text), SENSOR.machine))


def mutant(text: bytes, number: int) -> bytes:
    """The mutant of a number, from 0: always the same."""
    chance = random.Random(number)
    for _ in range(chance.choice((1, 1, 2, 3, 8, 40))):
        at = chance.randrange(len(text) + 1)
        end = min(len(text), at + chance.choice((1, 1, 2, 5, 20, 300, 5000)))
        kind = chance.randrange(9)
        if kind == 0:
            text = text[:at] + bytes([chance.randrange(256)]) + text[at + 1 :]
        elif kind == 1:
            text = text[:at] + text[end:]
        elif kind == 2:
            text = text[:end] + text[at:]
        elif kind == 3:
            text = text[:at] + chance.choice(PIECES) + text[at:]
        elif kind == 4:
            lines = text.split(b"\n")
            chance.shuffle(lines) if chance.random() < 0.05 else lines.insert(chance.randrange(len(lines)), lines.pop())
            text = b"\n".join(lines)
        elif kind == 5:
            text = text.replace(*chance.choice(SWAPS))
        elif kind == 6 and chance.random() < 0.2:
            text = text[:at]
        elif kind == 7:
            text = text[:at] + str(chance.uniform(-1e4, 1e4)).encode() + text[at:]
        else:
            text = text[:at] + bytes(chance.randrange(256) for _ in range(chance.choice((1, 4, 30)))) + text[end:]
    return text


def outcome(content: bytes, path: Path) -> str:
    """What becomes of a file: "passed", "refused", or "unreadable"; raises for a fault."""
    path.write_bytes(content)
    loaded = {SENSOR.tool(name): name for name in SENSOR.used()}
    try:
        motion = follow(path, SENSOR.machine.control.prime_macro)
        found = check_motion(motion, SENSOR.machine, loaded, others_empty=True)
        found = found.with_more(agreement.check_motion(SENSOR, motion))
    except SensorgenError as error:
        if "\n" in str(error) or not str(error):
            raise ValueError(f"not one line: {error}") from error
        return "unreadable"
    document.to_json(found)
    list(document.text(found.document()))
    return "refused" if found.errors() else "passed"
