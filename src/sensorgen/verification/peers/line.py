"""Impedance of a pressed line by scikit-rf's media and by a ladder in ngspice."""

import re
import subprocess
import tempfile
import warnings
from pathlib import Path

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import OutOfRange, SensorgenError
from sensorgen.solvers.line.inputs import PressedLine, read

_PORT_OHM = 50.0
_SHUNT_OHM = 1e18  # a way to ground for direct current, which ngspice needs


def scikit_rf(line: PressedLine) -> Complex:
    """Three sections and an open end, by scattering parameters [ohm]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import skrf

        frequency = skrf.Frequency.from_f(np.atleast_1d(line.frequency_hz), unit="Hz")
        total = None
        for r, y, length in zip(*read(line).sections(), strict=True):
            if length == 0:
                continue
            gamma, zc = np.sqrt(r * y), np.sqrt(r / y)
            media = skrf.media.DefinedGammaZ0(frequency, z0_port=_PORT_OHM, z0=zc, gamma=gamma)
            part = media.line(float(length), "m")
            total = part if total is None else total**part
        end = skrf.media.DefinedGammaZ0(frequency, z0=_PORT_OHM, gamma=0).open()
        s = (total**end).s[:, 0, 0]
    return np.asarray(_PORT_OHM * (1 + s) / (1 - s))


def ngspice(line: PressedLine, cells: int) -> Complex:
    """A ladder of so many cells in each section, half of the capacitance on either side of each resistor [ohm].

    Raises
    ------
    OutOfRange
        The film loses.
    SensorgenError
        The program gives no answer.
    """
    frequency = np.atleast_1d(np.asarray(line.frequency_hz, float))
    lines, node = ["ladder", "I1 0 n0 AC 1", f"Rdc n0 0 {_SHUNT_OHM:g}"], 0
    for r, y, length in zip(*read(line).sections(), strict=True):
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
