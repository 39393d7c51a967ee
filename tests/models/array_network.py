"""Arrays of crossing tracks by ngspice, and by the currents of the crossings with resistances of dense matrices."""

import re
import subprocess

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.solvers.tracks import Tracks


def by_ngspice(tracks: Tracks, frequency_hz: float, input_ohm: float, folder) -> Complex:
    """Currents into all columns of guarded rows, one circuit for each driven row [S]; leads of 0 ohm, lossy."""
    m, n = tracks.capacitance_f.shape
    lines, wanted = ["array"], []
    for drive in range(m):
        for i in range(m):
            lines += [f"V{drive}r{i} s{drive}r{i} 0 AC {int(i == drive)}"]
            lines += [f"R{drive}in{i} s{drive}r{i} {drive}r{i}c0 {input_ohm:.17g}"]
        for j in range(n):
            lines += [f"R{drive}ic{j} t{drive}c{j} {drive}q0c{j} {input_ohm:.17g}", f"V{drive}c{j} t{drive}c{j} 0 0"]
            wanted += [f"print i(v{drive}c{j})"]
        for i, j in np.ndindex(m, n):
            farad = float(tracks.capacitance_f[i, j])
            loss = 2 * np.pi * frequency_hz * farad * tracks.tan_delta + tracks.leak_s[i, j]
            lines += [f"C{drive}x{i}x{j} {drive}r{i}c{j} {drive}q{i}c{j} {farad:.17g}"]
            lines += [f"R{drive}x{i}x{j} {drive}r{i}c{j} {drive}q{i}c{j} {1 / loss:.17g}"]
            if j + 1 < n and np.isfinite(tracks.row_ohm[i, j]):
                lines += [f"R{drive}r{i}a{j} {drive}r{i}c{j} {drive}r{i}c{j + 1} {tracks.row_ohm[i, j]:.17g}"]
            if i + 1 < m and np.isfinite(tracks.column_ohm[i, j]):
                lines += [f"R{drive}q{i}a{j} {drive}q{i}c{j} {drive}q{i + 1}c{j} {tracks.column_ohm[i, j]:.17g}"]
    text = [*lines, ".control", "set numdgt=15", f"ac lin 1 {frequency_hz:.17g} {frequency_hz:.17g}", *wanted]
    file = folder / "array.cir"
    file.write_text("\n".join([*text, ".endc", ".end", ""]), "utf-8")
    done = subprocess.run(["ngspice", "-b", str(file)], capture_output=True, text=True, cwd=folder, check=False)
    found = re.findall(r"i\(v\d+c\d+\) = ([-+.e\d]+),([-+.e\d]+)", done.stdout)
    assert len(found) == m * n, done.stderr[-300:] + done.stdout[-300:]
    return np.array([complex(float(re_s), float(im_s)) for re_s, im_s in found]).reshape(m, n)


def by_currents(tracks: Tracks, frequency_hz: float, input_ohm: float, two_terminal: bool = False) -> Complex:
    """Readings of tracks that are whole and read beside row 0 and column 0, by the currents of all crossings [S].

    A track's potential at crossing k is its terminal's minus the sum over crossings l of its current times the
    resistance that both share, that of the way to the nearer one: no node is solved for.
    """
    m, n = tracks.capacitance_f.shape
    y = tracks.capacitance_f * 2j * np.pi * frequency_hz * (1 - 1j * tracks.tan_delta) + tracks.leak_s
    row, column = np.divmod(np.arange(m * n), n)
    ohm = 0.0 if two_terminal else input_ohm
    along_row = np.cumsum(np.hstack([tracks.row_lead_ohm[:, None] + ohm, tracks.row_ohm]), 1)
    along_column = np.cumsum(np.vstack([tracks.column_lead_ohm[None] + ohm, tracks.column_ohm]), 0)
    shared = np.where(row[:, None] == row, along_row[row[:, None], np.minimum(column[:, None], column)], 0)
    shared += np.where(column[:, None] == column, along_column[np.minimum(row[:, None], row), column], 0)
    to_row, to_column = np.eye(m)[row], np.eye(n)[column]
    inverse = np.linalg.inv(np.diag(1 / y.ravel()) + shared)
    if not two_terminal:
        return to_row.T @ inverse @ to_column
    ends = np.hstack([to_row, -to_column])
    impedance = np.linalg.pinv(ends.T @ inverse @ ends, rcond=1e-12)
    own = np.diag(impedance)
    return 1 / (own[:m, None] + own[m:] - 2 * impedance[:m, m:])
