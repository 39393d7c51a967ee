"""Read a slicer's G-code: which tools it takes, and how much each extrudes for what."""

import math
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

# What the slicers' ";TYPE:" comments call lines that are not part of a body, in lower case.
NOT_MODEL = frozenset(
    {
        "skirt", "skirt/brim", "prime-tower", "wipe tower", "custom",
        "support", "support-interface", "support material", "support material interface",
    }
)  # fmt: skip

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_BRACKETS = re.compile(r"\([^)]*\)")


@dataclass(frozen=True)
class Extruded:
    """What a file prints: tools in the order of their selection, and volumes [mm3] by tool and line type."""

    tools: tuple[int, ...]
    volume_mm3: dict[tuple[int, str], float]

    def total_mm3(self) -> dict[int, float]:
        """Volume that each tool extrudes, tower and skirt included [mm3]."""
        return self._sum(self.volume_mm3)

    def model_mm3(self) -> dict[int, float]:
        """Volume that each tool extrudes for the bodies alone [mm3]."""
        return self._sum({key: v for key, v in self.volume_mm3.items() if key[1] not in NOT_MODEL})

    @staticmethod
    def _sum(parts: dict[tuple[int, str], float]) -> dict[int, float]:
        sums: defaultdict[int, float] = defaultdict(float)
        for (tool, _), volume in parts.items():
            sums[tool] += volume
        return {tool: sums[tool] for tool in sorted(sums)}


def read(lines: Iterable[str], filament_mm: float) -> Extruded:
    """Follow tools and extruder through a file.

    Filament drawn back is owed by its tool: pushing it forward again counts for nothing, and only what
    goes beyond is extruded. So retractions, also those over a tool change, cancel.

    Parameters
    ----------
    lines : iterable of str
        The G-code, with the slicer's tool numbers (from 0) and its ``;TYPE:`` comments.
    filament_mm : float
        Diameter of the filament [mm].

    Returns
    -------
    Extruded
        Tools in order of selection, a repeated one once; volumes [mm3].

    Examples
    --------
    >>> found = read(["M83", "T1", "G1 X9 E2", "G1 E-1", "T0", "T1", "G1 E1", "G1 X0 E0.5"], filament_mm=2.0)
    >>> found.tools, round(found.total_mm3()[1] / math.pi, 6)
    ((1, 0, 1), 2.5)
    """
    state = _State()
    for line in lines:
        code, _, comment = line.partition(";")
        if comment.startswith("TYPE:"):
            state.kind = comment.removeprefix("TYPE:").strip().lower()
        state.follow(_BRACKETS.sub("", code).strip().upper())
    area_mm2 = math.pi / 4 * filament_mm**2
    return Extruded(tuple(state.tools), {key: length * area_mm2 for key, length in state.length_mm.items()})


@dataclass
class _State:
    """The machine as far as its extruders go; ``owed_mm`` is filament drawn back and not yet returned."""

    tool: int = 0
    kind: str = ""
    relative: bool = False
    position_mm: float = 0.0
    tools: list[int] = field(default_factory=list)
    owed_mm: defaultdict[int, float] = field(default_factory=lambda: defaultdict(float))
    length_mm: defaultdict[tuple[int, str], float] = field(default_factory=lambda: defaultdict(float))

    def follow(self, code: str) -> None:
        words = _WORD.findall(code)
        if not words:
            return
        letter, digits = words[0]
        if letter == "T":
            self._select(int(float(digits)))
        elif letter == "M" and digits in ("82", "83"):
            self.relative = digits == "83"
        elif letter == "G":
            length = next((float(d) for name, d in words[1:] if name == "E"), None)
            if length is not None:
                self._extrude(digits.lstrip("0") or "0", length)

    def _select(self, tool: int) -> None:
        if tool < 0:  # RepRapFirmware puts the tool down with T-1
            return
        self.tool = tool
        if not self.tools or self.tools[-1] != tool:
            self.tools.append(tool)

    def _extrude(self, command: str, length: float) -> None:
        if command == "92":
            self.position_mm = length
        elif command in ("0", "1", "2", "3"):
            step = length if self.relative else length - self.position_mm
            self.position_mm = self.position_mm + step
            self._push(step)

    def _push(self, step: float) -> None:
        owed = self.owed_mm[self.tool]
        self.owed_mm[self.tool] = max(0.0, owed - step)
        if step > owed:
            self.length_mm[(self.tool, self.kind)] += step - owed
