"""What a check has found, as plain data for the terminal, the drawing and ``check.json``."""

from dataclasses import asdict, dataclass
from typing import Any

SEVERITIES = ("error", "warning", "info")


@dataclass(frozen=True)
class Finding:
    """One finding of one rule.

    Attributes
    ----------
    rule : str
        Number and name of the rule, as in ``1-gap``.
    severity : str
        "error", "warning" or "info".
    body : str
        Name of the body, or of two, joined by " / ".
    message : str
        What is the matter, in one sentence.
    advice : str
        What to change.
    value_mm, limit_mm : float or None
        What was found and what was expected [mm].
    layer : int or None
        Number of the printed layer, from 1 at the bed [-].
    place_mm : tuple of (float, float, float) or None
        One place where it shows: x, y, z on the bed, from the sensor's corner [mm].
    count : int
        At how many places it shows [-].
    last_layer : int or None
        Where it goes on through the layers after, the last of them [-].
    waiver : str
        The design's reason to accept it, or "".
    """

    rule: str
    severity: str
    body: str
    message: str
    advice: str
    value_mm: float | None = None
    limit_mm: float | None = None
    layer: int | None = None
    place_mm: tuple[float, float, float] | None = None
    count: int = 1
    last_layer: int | None = None
    waiver: str = ""

    def margin_mm(self) -> float | None:
        """How far the value is from the limit; negative, since a finding is on the wrong side of it [mm]."""
        if self.value_mm is None or self.limit_mm is None:
            return None
        return -round(abs(self.value_mm - self.limit_mm), 9)

    def as_dict(self) -> dict[str, Any]:
        """The finding with its margin, for JSON."""
        return asdict(self) | {"margin_mm": self.margin_mm()}
