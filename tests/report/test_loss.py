"""Loss of the dielectric at rest: the report's range against a ladder that ngspice solves, and our own simulator."""

import subprocess

import numpy as np
import pytest

from sensorgen.analysis.comparison.expected import predicted
from sensorgen.design.design import make
from sensorgen.measure.virtual.specimen import PressedSpecimen, VirtualLine, drawn
from sensorgen.prediction import bodies

# the plain plate of the thesis: 100 x 10 mm, 4.68, 0.6 mm, two electrodes of 0.3 mm and 0.07 ohm m
PLATE = {"etpu": {"resistivity_ohm_m": 0.07}, "x60": {"relative_permittivity": 4.68}}
C_F, R_OHM = 4.68 * 8.8541878128e-12 * 0.1 * 0.01 / 0.6e-3, 2 * 0.07 * 0.1 / (0.3e-3 * 0.01)
CELLS = 60


def ladder(folder, frequency_hz, tangent):
    """Impedance of a chain of resistors, capacitors and leaks of a loss tangent, by ngspice [ohm]."""
    ohm, farad = R_OHM / CELLS, C_F / CELLS
    leak_ohm = 1 / (2 * np.pi * frequency_hz * farad * tangent)
    parts = [
        f"ra{k} n{k} m{k} {ohm / 2:.12g}\nc{k} m{k} 0 {farad:.12g}\nrg{k} m{k} 0 {leak_ohm:.12g}\n"
        f"rb{k} m{k} n{k + 1} {ohm / 2:.12g}"
        for k in range(CELLS)
    ]
    deck = [
        "* lossy line", "i1 0 n0 dc 0 ac 1", *parts, f"rend n{CELLS} 0 1e15",
        f".ac lin 1 {frequency_hz} {frequency_hz}",
        ".control", "run", "set numdgt=12", f"print real(v(n0)) imag(v(n0)) > {folder}/z.txt", "quit 0", ".endc",
        ".end",
    ]  # fmt: skip
    (folder / "line.cir").write_text("\n".join(deck) + "\n")
    subprocess.run(["ngspice", "-b", folder / "line.cir"], check=True, capture_output=True, timeout=60)
    real, imag = [float(line.split("=")[1]) for line in (folder / "z.txt").read_text().splitlines() if "=" in line]
    return complex(real, imag)


def expected(**values):
    made = make({"shape": "reference", "material_values": PLATE | {"x60": PLATE["x60"] | values}, "leads": {
        "capacitance_pf": 0, "resistance_ohm": 0, "guard": "driven"}})  # fmt: skip
    return predicted(bodies.default_body(made)).prediction.impedance


@pytest.mark.parametrize("tangent", [0.005, 0.03, 0.048])
def test_r_of_a_lossy_film_is_within_the_range(tangent, tmp_path, program):
    program("ngspice", "ngspice")
    for row in (expected()[0], expected()[-1]):
        z = ladder(tmp_path, row.frequency_hz, tangent)
        assert row.re.lower < z.real < row.re.upper
        assert row.im.lower < z.imag < row.im.upper
    assert ladder(tmp_path, 1.1e3, 0.1).real > expected()[0].re.upper  # beyond what is assumed


def test_a_stated_loss_is_the_value(tmp_path, program):
    program("ngspice", "ngspice")
    row = expected(loss_tangent=0.03)[0]
    z = ladder(tmp_path, row.frequency_hz, 0.03)
    assert row.re.value == pytest.approx(z.real, rel=2e-3)
    assert row.im.value == pytest.approx(z.imag, rel=2e-3)
    assert expected(loss_tangent=0.0)[0].re.upper < expected()[0].re.upper / 2


def test_no_virtual_specimen_is_flagged_by_its_r():
    design = make({"shape": "reference"})
    rows = predicted(bodies.default_body(design)).prediction.impedance
    tones_hz = np.array([row.frequency_hz for row in rows])
    outside = np.zeros(len(rows), int)
    for seed in range(40):
        z = VirtualLine(PressedSpecimen(design, drawn(design, seed)), tones_hz).impedance(0.0, (0.05, 0.05))
        outside += [not row.re.lower <= of.real <= row.re.upper for row, of in zip(rows, z, strict=True)]
    assert outside.max() <= 2  # of 40, as 95 % ranges are left: 15 with a film without loss
