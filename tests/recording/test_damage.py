"""Files that are no recordings, or no longer: a clear word, and nothing run."""

import gzip
import pickle
import sys
import zipfile

import made
import numpy as np
import pytest
import scipy.io as sio
from made import read_all

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.measure.recording import rig

RUN = made.run(made.presses(1))


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("unpickled",))


def test_pickles_archives_and_other_files_are_named_and_not_opened(tmp_path):
    with zipfile.ZipFile(tmp_path / "zip", "w") as archive:
        archive.writestr("run.mat", b"x")
    np.save(tmp_path / "objects.npy", np.array([Bomb()], object), allow_pickle=True)
    np.savez(tmp_path / "table.npz", a=np.ones(3))
    (tmp_path / "gz").write_bytes(gzip.compress(b"x" * 100))
    for protocol in range(6):
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


def mutated(content, rng):
    """Bytes cut, changed, doubled or removed."""
    found = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, what = int(rng.integers(len(found))), rng.integers(5)
        if what == 0:
            del found[at:]
        elif what == 1:
            found[at] = rng.integers(256)
        elif what == 2:
            found[at : at + 4] = rng.bytes(4)
        elif what == 3:
            del found[at : at + int(rng.integers(1, 40))]
        else:
            found[at:at] = found[at : at + int(rng.integers(1, 40))]
        if not found:
            break
    return bytes(found)


@pytest.mark.parametrize(("suffix", "count"), [("mat", 500), ("packed.mat", 150), ("h5", 200), ("csv", 250)])
def test_damaged_recordings_end_in_a_word_or_a_recording(tmp_path, suffix, count):
    rng = np.random.default_rng(7)
    z, t = RUN.impedance_ohm[:40, :2], RUN.time_s[:40]
    whole = tmp_path / f"whole.{suffix}"
    tree = made.tree([z], [t], made.stamps(t), (made.TONES_HZ[:2],))
    if suffix.endswith("mat"):
        sio.savemat(whole, tree, do_compression=suffix.startswith("packed"))
    elif suffix == "h5":
        import h5py

        with h5py.File(whole, "w") as file:
            file["impedance_data/lockin1"], file["impedance_time"] = z, t
            file["settings/dem_freqs"] = made.TONES_HZ[:2]
    else:
        rows = [f"{a:.5f},{b[0].real:.6g},{b[0].imag:.6g}" for a, b in zip(t, z, strict=True)]
        whole.write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n" + "\n".join(rows) + "\n")
    read_all(whole)
    content, file = whole.read_bytes(), tmp_path / f"damaged.{suffix}"
    refused, said = 0, set()
    for _ in range(count):
        file.write_bytes(mutated(content, rng))
        try:
            for one in read_all(file):
                assert (np.diff(one.time_s) > 0).all()
                assert one.impedance_ohm.shape == (len(one.time_s), len(one.tones_hz))
        except SensorgenError as error:
            refused += 1
            said.add("damaged." in str(error))
    assert refused > count / 10
    assert said == {True}


def test_damaged_logs_of_the_rig_end_in_a_word_or_a_log(tmp_path):
    rng = np.random.default_rng(8)
    columns = [c[:50] for c in made.rig_rows(made.presses(1))]
    content = made.write_rig(tmp_path / "rig.csv", columns).read_bytes()
    said = set()
    for _ in range(300):
        (tmp_path / "damaged.csv").write_bytes(mutated(content, rng))
        try:
            found = rig(tmp_path / "damaged.csv")
            assert len(found.time_s) == len(found.error)
        except SensorgenError as error:
            said.add("damaged.csv" in str(error))
    assert said == {True}


def test_files_beyond_what_fits_into_memory_are_not_read(tmp_path, monkeypatch):
    (tmp_path / "long.csv").write_text("time_s,re_ohm_1kHz,im_ohm_1kHz\n0,1,1\n1,1,1\n")
    monkeypatch.setattr("sensorgen.measure.recording.MOST_BYTES", 40)
    with pytest.raises(BadInput, match=r"long\.csv.*: 43 bytes; expected at most 40: split it"):
        read_all(tmp_path / "long.csv")
    monkeypatch.setattr(sys.modules["sensorgen.measure.recording.rig"], "MOST_BYTES", 40)
    with pytest.raises(BadInput, match="split it"):
        rig(tmp_path / "long.csv")
