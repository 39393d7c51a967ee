"""Walls by whose rules a print is estimated: names, and what provenance calls them."""

WALLS = {
    "arachne": "PrusaSlicer, Arachne walls",  # the default of ours
    "classic": "PrusaSlicer, classic walls",
    "cura": "plain Cura",
    "cura-gaps": "Cura filling outline gaps",
}
