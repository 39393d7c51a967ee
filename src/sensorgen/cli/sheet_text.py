"""How the bounds of a sheet are printed, and what of them goes into JSON."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from sensorgen.cli.show import si

if TYPE_CHECKING:
    from sensorgen.models.sheet import Bounds, Patch, Sheet

WIDTH = 80
MM_PER_M = 1e3
BOUNDLESS = 1e6  # N or m: a larger error tells nothing more


def lines(film: "Sheet", press: "Patch", bounds: Mapping[str, "Bounds"], given: Mapping[str, Any]) -> Iterator[str]:
    """Sheet, press and a table of bounds, in lines of at most ``WIDTH`` columns."""
    yield from _about(film, press, bounds, given)
    yield ""
    yield f"{'contacts':10} {'sigma F':>10} {'sigma x':>9} {'sigma y':>9} {'located':>8}  tones that tell most"
    for name, found in bounds.items():
        yield _row(name, found)
    yield ""
    yield from textwrap.wrap(
        "Medians over the sheet of the smallest standard errors; located: twice as well as a uniform distribution, in "
        "x and in y.",
        WIDTH,
    )
    for name, found in bounds.items():
        yield from _paragraph(name, found.verdict(), 10)


def _about(film: "Sheet", press: "Patch", bounds: Mapping[str, "Bounds"], given: Mapping[str, Any]) -> Iterator[str]:
    from sensorgen.models.sheet import depth_m

    top, bottom = (si(ohm, "ohm") for ohm in film.sheet_resistance_ohm)
    size = f"{film.length_m * MM_PER_M:g} x {film.width_m * MM_PER_M:g} mm"
    yield from _paragraph(
        "sheet", f"{size}, {top} and {bottom} per square, {si(float(film.capacitances().mean()), 'F')}/m2"
    )
    yield from _paragraph(
        "press",
        f"{given['force_n']:g} N on {given['tip_mm']:g} x {given['tip_mm']:g} mm: capacitance there "
        f"{press.capacitance_factor - 1:+.2%}; noise {given['noise']:g} of |Z|",
    )
    tones = next(iter(bounds.values())).frequency_hz
    ends = dict.fromkeys((float(tones[0]), float(tones[-1])))
    reach = ", ".join(f"{_mm(depth_m(film, f, press))} at {si(f, 'Hz')}" for f in ends)
    yield from _paragraph("current reaches", reach)
    for doubt in given["doubts"]:
        yield from _paragraph("doubt", doubt)


def _row(name: str, found: "Bounds") -> str:
    import numpy as np

    force, x, y = (float(np.median(found.sigma()[..., k])) for k in range(3))
    best = ", ".join(si(float(found.frequency_hz[k]), "Hz") for k in found.best_tones()[:2])
    return f"{name:10} {_short(force, 'N'):>10} {_mm(x):>9} {_mm(y):>9} {found.located():8.0%}  {best}"


def _paragraph(head: str, text: str, indent: int = 17) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent=f"{head:{indent}}", subsequent_indent=" " * indent)


def _mm(value_m: float) -> str:
    return f"{value_m * MM_PER_M:.3g} mm" if value_m * MM_PER_M < MM_PER_M - 0.5 else _short(value_m, "m")


def _short(value: float, unit: str) -> str:
    """A value in at most nine characters."""
    if not value < float("inf"):
        return "none"
    return si(float(f"{value:.3g}"), unit) if value < BOUNDLESS else f"> {si(BOUNDLESS, unit)}"


def plain(film: "Sheet", press: "Patch", contacts: Mapping[str, Any]) -> dict[str, Any]:
    """The sheet and what was found by contacts, as plain data."""
    return {
        "length_m": film.length_m,
        "width_m": film.width_m,
        "sheet_resistance_ohm": dict(zip(("top", "bottom"), film.sheet_resistance_ohm, strict=True)),
        "capacitance_f_per_m2": float(film.capacitances().mean()),
        "capacitance_factor": press.capacitance_factor,
        "contacts": dict(contacts),
    }


def plain_bounds(found: "Bounds", impedance_ohm: Any) -> dict[str, Any]:
    """Bounds, their maps, and the impedance matrix of the unpressed sheet by tone and ports."""
    sigma = found.sigma()
    names = ("sigma_force_n", "sigma_x_m", "sigma_y_m")
    return {
        "verdict": found.verdict(),
        "located": found.located(),
        "frequency_hz": found.frequency_hz.tolist(),
        "best_frequency_hz": [float(found.frequency_hz[k]) for k in found.best_tones()],
        "cells": found.cells,
        "impedance_ohm": {"re": impedance_ohm.real.tolist(), "im": impedance_ohm.imag.tolist()},
        "x_m": found.x_m.tolist(),
        "y_m": found.y_m.tolist(),
        **{name: [[_number(v) for v in row] for row in sigma[..., k].tolist()] for k, name in enumerate(names)},
    }


def _number(value: float) -> float | None:
    """JSON has no infinity."""
    return value if value < float("inf") else None
