"""Other people's programs on the same line: scikit-rf's media and ngspice's circuits."""

import re
import subprocess

import line_ladder
import numpy as np
import pytest
from line_cases import PLATE

from sensorgen.models import line
from sensorgen.solvers.line.inputs import read


def through_scikit_rf(inputs) -> complex:
    """Z of three line sections and an open end, by scattering parameters against 50 ohm."""
    rf = pytest.importorskip("skrf", reason="scikit-rf is not installed")
    frequency = rf.Frequency.from_f([inputs["frequency_hz"]], unit="Hz")
    r, y, lengths = read(line.PressedLine(**inputs)).sections()
    total = None
    for rs, ys, length in zip(r, y, lengths, strict=True):
        gamma, zc = np.sqrt(rs * ys), np.sqrt(rs / ys)
        media = rf.media.DefinedGammaZ0(frequency, z0_port=50, z0=zc, gamma=gamma)
        part = media.line(float(length), "m")
        total = part if total is None else total**part
    s = (total ** rf.media.DefinedGammaZ0(frequency, z0=50, gamma=0).open()).s[0, 0, 0]
    return complex(50 * (1 + s) / (1 - s))


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("f", "whole", "real"), [(1.1e3, 1e-10, 1e-7), (99.7e3, 1e-12, 1e-11), (1e7, 1e-13, 1e-13)])
def test_scikit_rf_agrees(f, whole, real):
    inputs = PLATE | {"frequency_hz": f}
    z, theirs = line.impedance(line.PressedLine(**inputs)), through_scikit_rf(inputs)
    assert abs(theirs - z) < whole * abs(z)
    assert abs(theirs.real - z.real) < real * z.real


@pytest.mark.filterwarnings("default")
def test_scikit_rf_dies_towards_low_frequency():
    """Nearly everything is reflected: 1 - s keeps few digits, and Re Z none. Ours is right (test_line.py)."""
    inputs = PLATE | {"frequency_hz": 1e-3}
    assert abs(through_scikit_rf(inputs).real - 3000) > 0.1 * 3000
    assert line.impedance(line.PressedLine(**inputs)).real == pytest.approx(3000, rel=0.01)


def netlist(inputs, cells: int) -> str:
    """The ladder of `line_ladder`, half of the capacitance on each side of each resistor; node 0 is the other track."""
    r, y, lengths = read(line.PressedLine(**inputs)).sections()
    omega = 2 * np.pi * inputs["frequency_hz"]
    lines, node = ["ladder", "I1 0 n0 AC 1", "Rdc n0 0 1e18"], 0
    for rs, ys, length in zip(r, y, lengths, strict=True):
        step = length / cells
        if step == 0:
            continue
        for _ in range(cells):
            half = ys.imag * step / omega / 2
            lines += [f"Ca{node} n{node} 0 {half:.17g}", f"R{node} n{node} n{node + 1} {rs * step:.17g}"]
            lines += [f"Cb{node} n{node + 1} 0 {half:.17g}"]
            node += 1
    control = [
        ".control",
        "set numdgt=15",
        f"ac lin 1 {inputs['frequency_hz']:.17g} {inputs['frequency_hz']:.17g}",
        "print v(n0)",
    ]
    return "\n".join([*lines, *control, ".endc", ".end", ""])


def through_ngspice(ngspice: str, inputs, cells: int, folder) -> complex:
    """Z of the ladder, from the voltage that 1 A drives."""
    file = folder / "ladder.cir"
    file.write_text(netlist(inputs, cells), "utf-8")
    done = subprocess.run([ngspice, "-b", str(file)], capture_output=True, encoding="utf-8", timeout=60, cwd=folder)
    found = re.search(r"v\(n0\) = ([-+.e\d]+),([-+.e\d]+)", done.stdout)
    assert found, done.stdout + done.stderr
    return complex(float(found[1]), float(found[2]))


@pytest.mark.parametrize("f", [1.1e3, 99.7e3, 1e6])
def test_ngspice_solves_the_same_ladder(f, tmp_path, program):
    ngspice = program("ngspice", "ngspice")
    inputs = PLATE | {"frequency_hz": f}
    theirs = through_ngspice(ngspice, inputs, 100, tmp_path)
    assert theirs == pytest.approx(line_ladder.impedance(line.PressedLine(**inputs), 100), rel=1e-8)
    z = line.impedance(line.PressedLine(**inputs))
    assert abs(theirs - z) < 1e-4 * abs(z)
    assert abs(theirs.real - z.real) < 1e-3 * z.real
