"""Commands that change what later lines mean: while one holds, a file prints something else than it seems to.

After RepRapFirmware's dictionary of G-code. Some hold until they are taken back (``G68`` until ``G69``, ``M221 S95``
until ``M221 S100``) and are refused only if lines are printed meanwhile; a few are wrong wherever they stand.
"""

from dataclasses import dataclass

from sensorgen.export.gcode.found import Findings, Found
from sensorgen.export.gcode.moves import Event
from sensorgen.export.gcode.words import Command

PLACES = ("G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
STOPS = ("M2", "M81", "M99", "M112", "M999")  # after them nothing is printed; what a printer's files end with is more
PAUSES = ("M25", "M226", "M600", "M601")
# Steps, accelerations, speeds, limits, heaters and drives of the machine itself, which its own configuration sets.
SETTINGS = (
    "M42", "M143", "M201", "M203", "M208", "M280", "M301", "M302", "M303", "M304", "M305", "M307", "M308", "M500",
    "M502", "M558", "M569", "M574", "M584", "M906", "M913", "M950",
)  # fmt: skip
# What the firmware takes, and the check follows or may pass over: moves, dwells, homing, probing, planes, units, modes.
_KNOWN_G = {
    *(f"G{n}" for n in (0, 1, 2, 3, 4, 10, 11, *range(17, 22), *range(27, 33), 53, 54, 60, 68, 69, *range(90, 95))),
    *PLACES,
}


@dataclass(frozen=True, slots=True)
class Effect:
    """What a command changes for the lines after it.

    Attributes
    ----------
    name : str
        What it changes; the command of the same name that takes it back ends it.
    says : str
        What comes of it, in words.
    words : str
        Letters of which it needs one to change anything; "" if it needs none.
    neutral : float, optional
        Number of these words that changes nothing, or takes an earlier one back.
    """

    name: str
    says: str
    words: str = ""
    neutral: float | None = None


_EFFECTS = {
    **dict.fromkeys(PLACES, Effect("place of work", "whose offset is unknown")),
    "G68": Effect("rotation", "turned in the plane of the bed"),
    "G93": Effect("feed", "with feeds that are times"),
    "M28": Effect("file", "into a file on the machine's card"),
    "M37": Effect("simulation", "in simulation: not at all", "S", 0.0),
    "M92": Effect("steps", "with other steps of the motors to a millimetre", "XYZE"),
    "M200": Effect("volumes", "with E as volumes", "D", 0.0),
    "M206": Effect("offset", "with places that are offset", "XYZ", 0.0),
    "M221": Effect("flow", "with another flow than their E says", "S", 100.0),
    "M452": Effect("mode", "by a machine in laser mode"),
    "M453": Effect("mode", "by a machine in milling mode"),
    "M556": Effect("skew", "skewed", "XYZ", 0.0),
    "M563": Effect("tools", "by tools that are defined anew", "DHFXYS"),
    "M564": Effect("limits", "with the machine's own limits switched off", "SH", 1.0),
    "M567": Effect("mixture", "with another mixture of filaments", "E"),
    "M579": Effect("scale", "in another size", "XYZ", 1.0),
    "M592": Effect("flow", "with another flow than their E says", "AB", 0.0),
    **dict.fromkeys(("M665", "M666", "M667", "M669"), Effect("kinematics", "with other kinematics")),
}
_OFFSETS = Effect("offset", "with places that are offset", "XYZ", 0.0)  # G10 with L1, L2 or L20, or of a tool
_ENDS = {"G54": "place of work", "G69": "rotation", "G94": "feed", "M29": "file", "M451": "mode"}


class Effects:
    """What holds while a file is followed; nothing at first."""

    def __init__(self, found: Findings) -> None:
        """Take the list that findings go to."""
        self.found = found
        self.held: dict[tuple[str, str], tuple[int, str]] = {}  # name and tool or drive: line, and what is printed

    def obey(self, event: Event) -> None:
        """Follow one command; without its words most of them only ask."""
        command = event.command
        if ended := _ENDS.get(command.code):
            self.held.pop((ended, ""), None)
        effect = _OFFSETS if command.code == "G10" else _EFFECTS.get(command.code)
        if effect is None or (effect.words and not command.has(effect.words)):
            return
        key = effect.name, command.text("P") or command.text("D") or ""
        given = [command.number(letter) for letter in effect.words if command.has(letter)]
        neutral = given and all(value == effect.neutral for value in given)
        if neutral and command.number("L") != 20:  # L20 offsets so that the nozzle is there
            self.held.pop(key, None)
        else:
            self.held[key] = event.number, f"lines are printed {effect.says} ({str(command)[:60]})"

    def printing(self) -> None:
        """Report what is wrong with lines printed now, each once."""
        for number, message in self.held.values():
            self.found.error(
                "effect", number, message, "leave it out, and let the slicer place, scale and meter the print"
            )
        self.held.clear()


# What is wrong wherever it stands: rule, severity, message behind the command, advice.
_WRONG = {
    **dict.fromkeys(("M112", "M999"), ("end", "error", "stops the machine at once", "leave it out")),
    **dict.fromkeys(
        ("M23", "M32", "M701", "M702", "M997"), ("macro", "error", "runs what the check cannot see", "leave it out")
    ),
    **dict.fromkeys(PAUSES, ("pause", "info", "waits until somebody goes on", "be there, or leave it out")),
    **dict.fromkeys(SETTINGS, (
        "settings", "warning", "changes the machine itself; the check goes by the printer's file",
        "leave it to the machine's own configuration",
    )),
    "M121": ("modes", "warning", "takes earlier modes back; that is not followed", "write them out"),
}  # fmt: skip


def judge(command: Command, number: int, found: Findings) -> None:
    """Add what is wrong with a command wherever it stands.

    Parameters
    ----------
    command : Command
        Not of a move.
    number : int
        Its line.
    found : Findings
        Grows.
    """
    code = command.code
    if code[0] == "G" and code not in _KNOWN_G:
        found.error("read", number, f"{code} is not simulated: its target is unknown", "write plain moves")
    elif code in _WRONG:
        rule, severity, message, advice = _WRONG[code]
        found.append(Found(rule, severity, number, f"{code} {message}", advice))
    elif code == "M220" and command.number("S") not in (None, 100.0):
        message = f"{str(command)[:60]} changes all speeds; the check goes by the feeds (F)"
        found.warning("speed", number, message, "let the slicer set the speeds")
    elif code[0] == "T" and command.number("P") is not None:
        message = f"{str(command)[:60]} leaves macros of the tool change out"
        found.warning("tool-change", number, message, "leave P out")
