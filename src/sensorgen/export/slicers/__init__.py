"""The slicers: their profiles, in their own formats."""

SLICERS = ("prusa", "cura")  # those that can be run: PrusaSlicer and CuraEngine
TITLES = {"prusa": "PrusaSlicer", "cura": "CuraEngine"}
PROGRAMS = {"prusa": ("prusa-slicer", "prusa-slicer"), "cura": ("CuraEngine", "cura-engine cura")}  # and its package
TIME_LIMIT_S = 1800.0  # that a slicer may take when nobody says otherwise
