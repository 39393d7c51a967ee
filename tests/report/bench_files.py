"""Files of the bench whose truth is known, of a design that specimens are printed of."""

from dataclasses import replace

import made
import numpy as np
import scipy.io as sio

from sensorgen.analysis.comparison.expected import moved
from sensorgen.analysis.report import pieces
from sensorgen.prediction.bodies import default_body
from sensorgen.prediction.sensor_model import sensor_model

HOSTILE = "</script><script>document.title='taken'</script><img src=x onerror=alert(1)> \"'&$\\frac{ =cmd|'/c calc'!A1"
FORMULA = '=HYPERLINK("http://example.org";"x")'
TRUTH = {"resistivity": 0.5, "capacitance": 1.3, "leak_s": 2e-9, "stiffness": 0.5}


def written(report, how):
    """A report as text."""
    return "".join(pieces(report, how))


def ladder(electrode, leak, sections, other=1.0):
    """R_Y and R_Z of two rows of resistors, the second of ``other`` x, with resistors between them, by Kirchhoff."""
    n = sections + 1
    at = np.zeros((2 * n, 2 * n))

    def join(a, b, g):
        at[[a, b], [a, b]] += g
        at[[a, b], [b, a]] -= g

    for row, ohm in ((0, electrode), (n, other * electrode)):
        for k in range(sections):
            join(row + k, row + k + 1, sections / ohm)
    for k in range(n):
        join(k, n + k, leak / sections * (0.5 if k in (0, sections) else 1.0))
    inverse = np.linalg.pinv(at)

    def between(a, b):
        return inverse[a, a] + inverse[b, b] - 2 * inverse[a, b]

    return between(0, n - 1), between(0, n)


def truth(design, resistivity=1.0, capacitance=1.0, leak_s=0.0, stiffness=1.0):
    """The sensor as it really is, by factors to what is predicted."""
    sensor = moved(sensor_model(default_body(design))[0].sensor, resistivity, capacitance, leak_s)
    return replace(sensor, compression=sensor.compression.scaled_modulus(stiffness))


def write(folder, name, sensor, count=12, rate_hz=140.0, noise=1e-4, seed=1, **times):
    """The instrument's file and the rig's, of so many random presses."""
    presses = made.presses(count, seed=seed, **({"dwell_s": 3.0, "rest_s": 3.0} | times))
    run = made.run(presses, rate_hz, noise, of=sensor, seed=seed)
    lcr, log = folder / f"{name}.mat", folder / f"{name}.csv"
    sio.savemat(lcr, made.tree([run.impedance_ohm], [run.time_s], made.stamps(run.time_s)))
    return lcr, made.write_rig(log, made.rig_rows(presses, offset_s=3.5))
