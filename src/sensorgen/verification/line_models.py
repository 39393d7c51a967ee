"""Models of the pressed line and programs of others by name, all with the same inputs, from coarse to fine."""

import re
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.solvers.line.inputs import PressedLine, read

PROGRAMS = ("scikit-rf", "ngspice")
LEVELS: dict[str, list[dict[str, int]]] = {
    "line": [{}], "stack: one film": [{}], "sheet": [{"cells": n} for n in (20, 40, 80)], "line_tip": [{"pieces": 1}],
    "scikit-rf": [{}], "ngspice": [{"cells": n} for n in (1, 10, 100)],
}  # fmt: skip
_PORT_OHM = 50.0
_SHUNT_OHM = 1e18  # a way to ground for direct current, which ngspice needs


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

    works: dict[str, Callable[..., Complex]] = {
        "line": line.impedance, "stack: one film": _stack, "sheet": _sheet, "line_tip": _tip,
        "scikit-rf": scikit_rf, "ngspice": ngspice,
    }  # fmt: skip
    return works[name](given, **fineness)


def differences(impedance: ArrayLike, known: ArrayLike) -> tuple[float, float]:
    """Largest relative difference from known impedances, of the whole and of the real part by itself [-].

    >>> differences([3 + 4j], [3 + 3.9j])[1]
    0.0
    """
    pairs = ((part(np.asarray(impedance)), part(np.asarray(known))) for part in (np.asarray, np.real))
    whole, real = (float(np.max(abs(ours - theirs) / abs(theirs))) for ours, theirs in pairs)
    return whole, real


def _stack(given: PressedLine) -> Complex:
    """Two tracks and the film between them."""
    from sensorgen.models import stack

    sections = read(given).sections()
    tracks = [[0.5 * r, 0.5 * r] for r in sections.r_ohm_per_m]  # what a loop runs through is their sum
    return stack.impedance(tracks, [[y] for y in sections.y_s_per_m], sections.length_m)[..., 0, 0]


def _sheet(given: PressedLine, cells: int) -> Complex:
    """Two sheets with contacts all along one edge, pressed across their whole width."""
    from sensorgen.models import sheet
    from sensorgen.solvers.sheet.parts import Sheet, SheetPatch

    p = vars(given)
    top, bottom = (p[f"{end}_resistivity_ohm_m"] / p[f"{end}_thickness_m"] for end in ("top", "bottom"))
    plate = Sheet(p["length_m"], p["width_m"], (top, bottom), EPS0_F_PER_M * p["eps_r"] / p["film_m"])
    thinner = 1 / (1 - p["force_n"] / (p["width_m"] * p["tip_m"] * p["modulus_pa"]))
    press = SheetPatch(p["left_m"], 0.0, p["tip_m"], p["width_m"], thinner)
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


def scikit_rf(given: PressedLine) -> Complex:
    """Three sections and an open end, by scattering parameters [ohm]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import skrf

        frequency = skrf.Frequency.from_f(np.atleast_1d(given.frequency_hz), unit="Hz")
        total = None
        for r, y, length in zip(*read(given).sections(), strict=True):
            if length == 0:
                continue
            gamma, zc = np.sqrt(r * y), np.sqrt(r / y)
            media = skrf.media.DefinedGammaZ0(frequency, z0_port=_PORT_OHM, z0=zc, gamma=gamma)
            part = media.line(float(length), "m")
            total = part if total is None else total**part
        end = skrf.media.DefinedGammaZ0(frequency, z0=_PORT_OHM, gamma=0).open()
        s = (total**end).s[:, 0, 0]
    return np.asarray(_PORT_OHM * (1 + s) / (1 - s))


def ngspice(given: PressedLine, cells: int) -> Complex:
    """A ladder of so many cells in each section, half of the capacitance on either side of each resistor [ohm].

    Raises
    ------
    OutOfRange
        The film loses.
    SensorgenError
        The program gives no answer.
    """
    frequency = np.atleast_1d(np.asarray(given.frequency_hz, float))
    lines, node = ["ladder", "I1 0 n0 AC 1", f"Rdc n0 0 {_SHUNT_OHM:g}"], 0
    for r, y, length in zip(*read(given).sections(), strict=True):
        farad_per_m = np.atleast_1d(y.imag)[0] / (2 * np.pi * frequency[0])
        if np.any(y.real):
            raise OutOfRange("the film loses: the ladder has capacitors alone")
        step = float(length) / cells
        for _ in range(cells if step else 0):
            half = farad_per_m * step / 2
            lines += [
                f"Ca{node} n{node} 0 {half:.17g}", f"R{node} n{node} n{node + 1} {float(r) * step:.17g}",
                f"Cb{node} n{node + 1} 0 {half:.17g}",
            ]  # fmt: skip
            node += 1
    asked = [word for f in frequency for word in (f"ac lin 1 {f:.17g} {f:.17g}", "print v(n0)")]
    text = "\n".join([*lines, ".control", "set numdgt=15", *asked, ".endc", ".end", ""])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ladder.cir"
        file.write_text(text, "utf-8")
        done = subprocess.run(  # noqa: S603
            ["ngspice", "-b", str(file)],  # noqa: S607
            capture_output=True, encoding="utf-8", errors="replace", cwd=folder, check=False,
        )  # fmt: skip
    printed = re.findall(r"v\(n0\) = ([-+.e\d]+),([-+.e\d]+)", done.stdout)
    if len(printed) != len(frequency):
        raise SensorgenError(f"ngspice: {(done.stderr or done.stdout).strip()[-200:]}")
    return np.array([complex(float(re_ohm), float(im_ohm)) for re_ohm, im_ohm in printed])


_DIGITS = 220
_LARGEST = 1e4  # of abs(z^2): cosh z then has 43 digits before the point


def exact_impedance(r_ohm_per_m: Sequence[float], y_s_per_m: Sequence[complex], length_m: Sequence[float]) -> complex:
    r"""Of sections from the contacts to the open far end [ohm], in 220 digits: Taylor series of chain matrices.

    .. math:: \begin{pmatrix} U \\ I \end{pmatrix} \to \exp\left[l \begin{pmatrix} 0 & r \\ y & 0 \end{pmatrix}\right]
              \begin{pmatrix} U \\ I \end{pmatrix}

    Independent of all models of lines, and exact to the last digit of what it is rounded to.

    Parameters
    ----------
    r_ohm_per_m, y_s_per_m, length_m : sequence
        Of each section: resistance [ohm/m], shunt admittance [S/m], length [m].

    Raises
    ------
    OutOfRange
        A section of more than ``_LARGEST``.

    Examples
    --------
    >>> round(exact_impedance([9000.0], [6e-09j], [1.0]).real, 3)  # a third of the resistance
    3000.0
    """
    with localcontext() as context:
        context.prec = _DIGITS
        least = Decimal(10) ** -(_DIGITS - 20)
        state = np.array([Decimal(1), Decimal(0), Decimal(0), Decimal(0)])  # U, I: real and imaginary parts
        for r, y, length in reversed(list(zip(r_ohm_per_m, y_s_per_m, length_m, strict=True))):
            if abs(square := r * y * length**2) > _LARGEST:
                raise OutOfRange(f"a section of the line is {abs(square) ** 0.5:.3g} long")
            rows = [[0, 0, r, 0], [0, 0, 0, r], [y.real, -y.imag, 0, 0], [y.imag, y.real, 0, 0]]
            matrix = np.array([[Decimal(value) * Decimal(length) for value in row] for row in rows])
            term, k = state, 0
            while max(abs(term)) > least:
                k += 1
                term = matrix @ term / k
                state = state + term
        (u_re, u_im), (i_re, i_im) = state.reshape(2, 2)
        size = i_re * i_re + i_im * i_im
        return complex(float((u_re * i_re + u_im * i_im) / size), float((u_im * i_re - u_re * i_im) / size))
