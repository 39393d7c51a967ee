"""Models of the pressed line by name, all with the same inputs."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.solvers.line.inputs import PressedLine, read

AT_ONCE = (
    "line", "line_abcd", "line_closed", "line_closed: B.48 as printed", "line_closed: uniform",
    "line_closed: R and C in series", "stack: one film",
)  # fmt: skip


def impedance(name: str, line: PressedLine, **fineness: Any) -> Complex:
    """Impedance at the contacts by one model [ohm].

    Parameters
    ----------
    name : str
        Of ``AT_ONCE``, or "line_ladder", "sheet" (both with ``cells``), "line_tip" (with ``pieces`` and ``profile``).
    line : PressedLine
        The line.
    **fineness
        How fine it is.
    """
    variants: dict[str, Any] = {"B.48 as printed": {"as_printed": "B.48"}}
    own: dict[str, Callable[..., Complex]] = {"stack": _stack, "sheet": _sheet, "line_tip": _tip}
    model, _, variant = name.partition(": ")
    if model in own:
        return own[model](line, **fineness)
    module = import_module(f"sensorgen.models.{model}")
    work = {"uniform": "uniform", "R and C in series": "series"}.get(variant, "impedance")
    found: Complex = getattr(module, work)(line, **variants.get(variant, {}), **fineness)
    return found


def _stack(line: PressedLine) -> Complex:
    """Two tracks and the film between them."""
    from sensorgen.models import stack

    sections = read(line).sections()
    tracks = [[0.5 * r, 0.5 * r] for r in sections.r_ohm_per_m]  # what a loop runs through is their sum
    return stack.impedance(tracks, [[y] for y in sections.y_s_per_m], sections.length_m)[..., 0, 0]


def _sheet(line: PressedLine, cells: int) -> Complex:
    """Two sheets with contacts all along one edge, pressed across their whole width."""
    from sensorgen.models import sheet

    p = vars(line)
    resistances = (
        p["top_resistivity_ohm_m"] / p["top_thickness_m"],
        p["bottom_resistivity_ohm_m"] / p["bottom_thickness_m"],
    )
    plate = sheet.Sheet(p["length_m"], p["width_m"], resistances, EPS0_F_PER_M * p["eps_r"] / p["film_m"])
    thinner = 1 / (1 - p["force_n"] / (p["width_m"] * p["tip_m"] * p["modulus_pa"]))
    press = sheet.Patch(p["left_m"], 0.0, p["tip_m"], p["width_m"], thinner)
    contacts = plate.edge("top", "left"), plate.edge("bottom", "left")
    return sheet.impedance(plate, [contacts], p["frequency_hz"], press, cells)[:, 0, 0]


def _tip(line: PressedLine, pieces: int = 1, profile: str = "uniform") -> Complex:
    """The patch in pieces, each with its own pressure."""
    from sensorgen.models import compression, line_tip

    p = vars(line)
    law = compression.unconfined(p["modulus_pa"])
    r = (
        p["top_resistivity_ohm_m"] / p["top_thickness_m"] + p["bottom_resistivity_ohm_m"] / p["bottom_thickness_m"]
    ) / p["width_m"]
    track = line_tip.Track(
        p["length_m"],
        r,
        0.0,
        EPS0_F_PER_M * p["eps_r"] * p["width_m"] / p["film_m"],
        p["tan_delta"],
        p["leak_s_per_m"],
        "open",
    )
    middle, contact = p["left_m"] + p["tip_m"] / 2, (np.asarray(p["tip_m"]), np.zeros(()))
    tip = line_tip.resting(
        p["length_m"], p["width_m"], (profile, pieces), np.asarray(p["force_n"]), np.asarray(middle), contact
    )
    return line_tip.impedance(track, tip, law, p["frequency_hz"])
