"""Models of the pressed line and programs of others by name, all with the same inputs, from coarse to fine."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.solvers.line.inputs import PressedLine, read

PROGRAMS = ("scikit-rf", "ngspice")
LEVELS: dict[str, list[dict[str, int]]] = {
    "line": [{}], "stack: one film": [{}], "sheet": [{"cells": n} for n in (20, 40, 80)], "line_tip": [{"pieces": 1}],
    "scikit-rf": [{}], "ngspice": [{"cells": n} for n in (1, 10, 100)],
}  # fmt: skip


def words(fineness: Mapping[str, Any]) -> str:
    """A level in words: its numbers alone, as "20 cells"."""
    return ", ".join(f"{value} {key}" for key, value in fineness.items() if isinstance(value, int))


def impedance(name: str, given: PressedLine, **fineness: Any) -> Complex:
    """Impedance at the contacts by one model or program [ohm].

    Parameters
    ----------
    name : str
        Of ``LEVELS``.
    given : PressedLine
        The line.
    **fineness
        How fine it is; for "line_tip" also the ``profile`` of the pressure.
    """
    from sensorgen.models import line
    from sensorgen.verification.peers import line as programs

    works: dict[str, Callable[..., Complex]] = {
        "line": line.impedance, "stack: one film": _stack, "sheet": _sheet, "line_tip": _tip,
        "scikit-rf": programs.scikit_rf, "ngspice": programs.ngspice,
    }  # fmt: skip
    return works[name](given, **fineness)


def _stack(given: PressedLine) -> Complex:
    """Two tracks and the film between them."""
    from sensorgen.models import stack

    sections = read(given).sections()
    tracks = [[0.5 * r, 0.5 * r] for r in sections.r_ohm_per_m]  # what a loop runs through is their sum
    return stack.impedance(tracks, [[y] for y in sections.y_s_per_m], sections.length_m)[..., 0, 0]


def _sheet(given: PressedLine, cells: int) -> Complex:
    """Two sheets with contacts all along one edge, pressed across their whole width."""
    from sensorgen.models import sheet

    p = vars(given)
    resistances = (
        p["top_resistivity_ohm_m"] / p["top_thickness_m"],
        p["bottom_resistivity_ohm_m"] / p["bottom_thickness_m"],
    )
    plate = sheet.Sheet(p["length_m"], p["width_m"], resistances, EPS0_F_PER_M * p["eps_r"] / p["film_m"])
    thinner = 1 / (1 - p["force_n"] / (p["width_m"] * p["tip_m"] * p["modulus_pa"]))
    press = sheet.SheetPatch(p["left_m"], 0.0, p["tip_m"], p["width_m"], thinner)
    contacts = plate.edge("top", "left"), plate.edge("bottom", "left")
    return sheet.impedance(plate, [contacts], p["frequency_hz"], press, cells)[:, 0, 0]


def _tip(given: PressedLine, pieces: int = 1, profile: str = "uniform") -> Complex:
    """The patch in pieces, each with its own pressure."""
    from sensorgen.models import compression, line_tip

    p, inputs = vars(given), read(given)
    film = EPS0_F_PER_M * p["eps_r"] * p["width_m"] / p["film_m"]
    track = line_tip.RestLine(
        p["length_m"], float(inputs.tracks()[0]), 0.0, film, p["tan_delta"], p["leak_s_per_m"], p["far_end"]
    )
    middle, contact = p["left_m"] + p["tip_m"] / 2, (np.asarray(p["tip_m"]), np.zeros(()))
    tip = line_tip.resting(
        p["length_m"], p["width_m"], (profile, pieces), np.asarray(p["force_n"]), np.asarray(middle), contact
    )
    return line_tip.impedance(track, tip, compression.unconfined(p["modulus_pa"]), p["frequency_hz"])
