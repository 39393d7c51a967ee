"""Files that are no recordings, or no longer: a clear word, and nothing run."""

import gzip
import pickle
import sys
import zipfile

import numpy as np
import pytest
from made import read_all

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording import rig


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("unpickled",))


def test_pickles_archives_and_other_files_are_named_and_not_opened(tmp_path):
    with zipfile.ZipFile(tmp_path / "zip", "w") as archive:
        archive.writestr("run.mat", b"x")
    np.save(tmp_path / "objects.npy", np.array([Bomb()], object), allow_pickle=True)
    np.savez(tmp_path / "table.npz", a=np.ones(3))
    (tmp_path / "gz").write_bytes(gzip.compress(b"x" * 100))
    for protocol in (0, 2, 5):
        (tmp_path / f"pickle{protocol}").write_bytes(pickle.dumps(Bomb(), protocol))
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "random").write_bytes(np.random.default_rng(0).bytes(4000))
    (tmp_path / "header").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM")
    (tmp_path / "four").write_bytes(b"MATLAB 4")
    said = {
        "zip": "zip archive", "objects.npy": "NumPy file", "table.npz": "zip archive", "gz": "gzip", "empty": "empty",
        "pickle2": "pickle", "pickle5": "pickle", "header": "impedance_data is missing", "four": "cut off within",
    }  # fmt: skip
    for file in tmp_path.iterdir():
        with pytest.raises(BadInput, match=said.get(file.name, file.name)) as error:
            read_all(file)
        assert file.name in str(error.value)
        with pytest.raises(BadInput):
            rig(file)
    with pytest.raises(BadInput, match="is a folder"):
        read_all(tmp_path)
    with pytest.raises(BadInput, match="No such file"):
        read_all(tmp_path / "none")
    with pytest.raises(BadInput, match="cannot read"):
        read_all(tmp_path / "a\0b")


def test_files_beyond_what_fits_into_memory_are_not_read(tmp_path, monkeypatch):
    (tmp_path / "long.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n0,1,1\n1,1,1\n")
    monkeypatch.setattr("sensorgen.measure.recording.MOST_BYTES", 40)
    with pytest.raises(BadInput, match=r"long\.csv.*: 43 bytes; expected at most 40: split it"):
        read_all(tmp_path / "long.csv")
    monkeypatch.setattr(sys.modules["sensorgen.measure.recording.rig"], "MOST_BYTES", 40)
    with pytest.raises(BadInput, match="split it"):
        rig(tmp_path / "long.csv")
