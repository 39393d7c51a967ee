"""Slicers that can be run, and walls by whose rules a print is estimated: names, and what provenance calls them."""

SLICERS = ("prusa", "cura")
TITLES = {"prusa": "PrusaSlicer", "cura": "CuraEngine"}
PROGRAMS = {"prusa": ("prusa-slicer", "prusa-slicer"), "cura": ("CuraEngine", "cura-engine cura")}  # and its package

_RULES = {"prusa": {"arachne": "arachne", "classic": "classic"}, "cura": {"arachne": "cura-gaps", "classic": "cura"}}

WALLS = {
    "arachne": "PrusaSlicer, Arachne walls",  # the default of ours
    "classic": "PrusaSlicer, classic walls",
    "cura": "plain Cura",
    "cura-gaps": "Cura filling outline gaps",
    "cura-5": "Cura 5",
}


def rule(slicer: str, walls: str) -> str:
    """Choice among ``WALLS`` that a slicer makes of a design's walls (arachne or classic)."""
    return _RULES[slicer][walls]


def rules(walls: str | None) -> tuple[str, ...]:
    """Those of ``WALLS`` that a design's walls can come out as, the likeliest first; all where it names none.

    Cura 5 prints every design by its own.
    """
    return (*(of[walls] for of in _RULES.values()), "cura-5") if walls else tuple(WALLS)
