"""Files written by SciPy and h5py, read by ours."""

import struct
import zlib

import h5py
import made
import numpy as np
import pytest
import scipy.io as sio
from made import read, read_all

from sensorgen.core.errors import BadInput

SHORT = made.run(made.presses(2))
BEFORE = np.s_[:300]


def save(path, tree, **how):
    sio.savemat(path, tree, **how)
    return path


def swapped(path, tree, **how):
    """Another byte order, by rewriting every element of a file that SciPy wrote little-endian."""
    content = bytearray(save(path, tree, **how).read_bytes())
    sizes = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}

    def swap(piece):
        at, found = 0, bytearray()
        while at < len(piece):
            kind, size = struct.unpack_from("<II", piece, at)
            if kind >> 16:
                step, count = sizes[kind & 0xFFFF], kind >> 16
                data = bytes(piece[at + 4 : at + 8])
                turned = b"".join(data[i : i + step][::-1] for i in range(0, count, step))
                found += struct.pack(">I", kind) + turned.ljust(4, b"\0")
                at += 8
                continue
            data = bytes(piece[at + 8 : at + 8 + size])
            step = sizes.get(kind)
            data = swap(data) if kind == 14 else b"".join(data[i : i + step][::-1] for i in range(0, size, step))
            found += struct.pack(">II", kind, size) + data.ljust((size + 7) // 8 * 8, b"\0")
            at += 8 + (size + 7) // 8 * 8
        return bytes(found)

    header = bytes(content[:124]) + struct.pack(">H", 0x0100) + b"MI"
    path.write_bytes(header + swap(bytes(content[128:])))
    return path


@pytest.fixture(scope="module")
def tree():
    return made.tree([SHORT.impedance_ohm], [SHORT.time_s], made.stamps(SHORT.time_s))


@pytest.mark.parametrize("how", [{}, {"do_compression": True}])
def test_seven_tones_come_back_to_the_last_bit(tmp_path, tree, how):
    found = read(save(tmp_path / "run.mat", tree, **how))
    np.testing.assert_array_equal(found.impedance_ohm, SHORT.impedance_ohm)
    np.testing.assert_array_equal(found.time_s, SHORT.time_s)
    np.testing.assert_array_equal(found.tones_hz, made.TONES_HZ)
    assert (found.source.format, found.source.program) == ("MATLAB 5", "TiePieLCR V1.0.3")
    assert found.source.rate_hz == pytest.approx(140)
    assert found.counts()["transient"] == 23  # 1.6 over 10 Hz, at 140 samples per second
    assert found.counts()["valid"] == len(SHORT.time_s) - 23
    assert found.clock.epoch_s == pytest.approx(made.EPOCH_S + 0.03, abs=4 * found.clock.epoch_error_s)


def test_a_file_of_the_other_byte_order_is_the_same(tmp_path, tree):
    found = read(swapped(tmp_path / "big.mat", tree))
    np.testing.assert_array_equal(found.impedance_ohm, SHORT.impedance_ohm)
    assert found.source.program == "TiePieLCR V1.0.3"


def test_one_tone_squeezed_to_vectors_and_scalars(tmp_path):
    z = SHORT.impedance_ohm[BEFORE, 0]
    squeezed = {
        "impedance_data": {"lockin1": z}, "impedance_time": SHORT.time_s[BEFORE],
        "timestamps": made.stamps(SHORT.time_s[BEFORE]), "settings": made.settings([1100.0])["calibration"] | {
            "dem_freqs": 1100.0, "bandwidth": 10, "version": "V1.0.3"},
    }  # fmt: skip
    found = read(save(tmp_path / "one.mat", squeezed))
    np.testing.assert_array_equal(found.impedance_ohm[:, 0], z)
    assert found.tones_hz.tolist() == [1100.0]


@pytest.mark.parametrize("lengths", [(300, 300), (1, 300)])
def test_several_lockins_of_any_length_and_any_tones(tmp_path, lengths):
    tones = (made.TONES_HZ, made.TONES_HZ[:1])
    raw = [SHORT.impedance_ohm[:n, : len(t)] for n, t in zip(lengths, tones, strict=True)]
    times = [SHORT.time_s[:n] for n in lengths]
    file = save(tmp_path / "two.mat", made.tree(raw, times, made.stamps(times[0]), tones))
    found = read_all(file)
    assert [one.source.lockin for one in found] == [1, 2]
    for one, z, tone in zip(found, raw, tones, strict=True):
        np.testing.assert_array_equal(one.impedance_ohm, z)
        assert one.tones_hz.tolist() == tone.tolist()
        assert one.clock.epoch_s == found[0].clock.epoch_s
        np.testing.assert_array_equal(one.time_s, SHORT.time_s[: len(z)])


def test_eleven_lockins_come_in_their_order(tmp_path):
    z = [np.full((30, 1), k + 1j) for k in range(1, 12)]
    found = read_all(save(tmp_path / "many.mat", made.tree(z, [SHORT.time_s[:30]] * 11, None, [[1e3]] * 11)))
    assert [one.impedance_ohm[0, 0].real for one in found] == list(range(1, 12))


def test_skipped_blocks_and_nan_are_missing_and_counted(tmp_path):
    z = SHORT.impedance_ohm[BEFORE].copy()
    z[100:114] = 0
    z[200, 3] = np.nan
    z[201, 3] = 1e300 + 1e308j
    found = read(save(tmp_path / "gaps.mat", made.tree([z], [SHORT.time_s[BEFORE]])))
    counts = found.counts()
    assert (counts["zero"], counts["missing"], counts["valid"]) == (14, 2, 300 - 23 - 16)
    assert np.isnan(found.impedance_ohm[100:114]).all()
    assert np.isnan(found.impedance_ohm[200]).tolist() == [False] * 3 + [True] + [False] * 3
    assert np.isnan(found.clock.epoch_s)


def test_a_run_that_stopped_half_way_keeps_what_is_whole(tmp_path):
    tree = made.tree([SHORT.impedance_ohm[:290]], [SHORT.time_s[BEFORE]], made.stamps(SHORT.time_s[:295]))
    found = read(save(tmp_path / "half.mat", tree))
    assert found.counts()["samples"] == 290
    assert "10 incomplete samples at the end" in found.source.notes[0]


@pytest.mark.parametrize(
    ("name", "largest", "settings"),
    [
        ("sig_offset", 0.8, {}),  # volts, where the file says nothing of gains
        ("sig_offset", 2.0 / 50, {"gain": 1, "scope_ranges": np.array([2, 3])}),
        ("ref_offset", 0.8 * 5e-6, {"reference": 2, "scope_ranges": np.array([2, 3])}),  # amperes
    ],
)
def test_ranges_are_those_of_the_inputs_behind_their_gains(tmp_path, name, largest, settings):
    """The program writes the signal's volts over its gain, and the reference's times what its amplifier has."""
    lived = made.run(made.presses(1), rate_hz=140)
    at = np.arange(0, lived.time_s[-1], 0.01)
    gains = {"gain_list": np.array([1, 50]), "reference_gain_list": np.array([1.0, -3.8e-4, -5e-6])}
    for share, marked in ((0.98, False), (1.0, True)):
        offsets = {"offset_time": at[None], "ref_offset": np.zeros((1, len(at))), "sig_offset": np.zeros((1, len(at)))}
        offsets[name][0, 200:300] = -share * largest
        tree = made.tree([lived.impedance_ohm], [lived.time_s], offsets=offsets)
        own = made.settings(made.TONES_HZ, **settings) | {"calibration": gains if settings else {"none": 1.0}}
        tree["settings"] = made.cell(own)
        assert (save(tmp_path / "run.mat", tree), read(tmp_path / "run.mat").marks["clipped"].any())[1] == marked


def test_an_input_beyond_its_range_marks_its_samples(tmp_path):
    at = np.linspace(0, 2, 60)
    offsets = {"offset_time": at[None], "ref_offset": np.zeros((1, 60), complex),
               "sig_offset": np.where((at > 1) & (at < 1.5), 0.9 + 0j, 0.1)[None] / 50}  # fmt: skip
    tree = made.tree([SHORT.impedance_ohm[BEFORE]], [SHORT.time_s[BEFORE]], offsets=offsets)
    found = read(save(tmp_path / "clipped.mat", tree))
    assert found.counts()["clipped"] == pytest.approx(0.5 * 140, abs=6)
    assert found.marks["clipped"][180]


def as_matlab(group, name, value, refs):
    """A variable as MATLAB 7.3 lays it out."""
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, member in value.items():
            as_matlab(inner, key, member, refs)
        return
    if isinstance(value, np.ndarray) and value.dtype == object:
        for i, member in enumerate(value.ravel()):
            as_matlab(refs, f"{name}{i}", member, refs)
        pointers = np.array([refs[f"{name}{i}"].ref for i in range(value.size)], h5py.ref_dtype)
        group.create_dataset(name, data=pointers.reshape(value.shape).T).attrs["MATLAB_class"] = np.bytes_("cell")
        return
    if isinstance(value, str):
        group.create_dataset(name, data=np.array([[ord(c)] for c in value], np.uint16)).attrs["MATLAB_class"] = (
            np.bytes_("char")
        )
        return
    value = np.atleast_2d(value)
    if np.iscomplexobj(value):
        raw = np.empty(value.T.shape, [("real", "f8"), ("imag", "f8")])
        raw["real"], raw["imag"] = value.T.real, value.T.imag
    else:
        raw = value.T
    group.create_dataset(name, data=raw).attrs["MATLAB_class"] = np.bytes_("double")


def save_73(path, tree):
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")
        for name, value in tree.items():
            as_matlab(file, name, value, refs)
    content = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + content[128:])
    return path


def test_matlab_7_3_is_the_same(tmp_path, tree):
    found = read(save_73(tmp_path / "run.mat", tree))
    np.testing.assert_array_equal(found.impedance_ohm, SHORT.impedance_ohm)
    np.testing.assert_array_equal(found.time_s, SHORT.time_s)
    assert found.source.format == "MATLAB 7.3"
    assert found.source.program == "TiePieLCR V1.0.3"
    assert found.clock.blocks == pytest.approx(len(SHORT.time_s) / 14, abs=3)


def test_matlab_7_3_with_lockins_of_unequal_length(tmp_path):
    raw, times = [SHORT.impedance_ohm[:300], SHORT.impedance_ohm[:200]], [SHORT.time_s[:300], SHORT.time_s[:200]]
    found = read_all(save_73(tmp_path / "two.mat", made.tree(raw, times, None, [made.TONES_HZ] * 2)))
    assert [one.counts()["samples"] for one in found] == [300, 200]


def test_plain_hdf5(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["impedance_data/lockin1"] = SHORT.impedance_ohm
        file["impedance_time"] = SHORT.time_s
        file.create_group("settings").attrs.update(dem_freqs=made.TONES_HZ, version="V9", bandwidth=10.0)
    found = read(tmp_path / "run.h5")
    np.testing.assert_array_equal(found.impedance_ohm, SHORT.impedance_ohm)
    assert (found.source.format, found.source.program) == ("HDF5", "TiePieLCR V9")


def test_csv_with_columns_of_other_names(tmp_path):
    file = tmp_path / "run.csv"
    rows = [f"{t:.6f};{float(z[0].real)!r};{float(z[0].imag)!r};{int(i != 50)}" for i, (t, z) in
            enumerate(zip(SHORT.time_s[BEFORE], SHORT.impedance_ohm[BEFORE], strict=True))]  # fmt: skip
    file.write_text("t;R;X;fine\n" + "\n".join(rows) + "\n")
    columns = {"t": "time_s", "R": "re_ohm_1.1kHz", "X": "im_ohm_1.1kHz", "fine": "valid"}
    found = read(file, columns)
    np.testing.assert_array_equal(found.impedance_ohm[:, 0], SHORT.impedance_ohm[BEFORE, 0])
    np.testing.assert_allclose(found.time_s, SHORT.time_s[BEFORE], atol=1e-6)
    assert (found.counts()["invalid"], found.source.rate_hz) == (1, pytest.approx(140, rel=1e-3))
    with pytest.raises(BadInput, match="no column 'T', which the map"):
        read(file, {"T": "time_s"})


def test_csv_with_stamps_only_is_rebuilt_from_them(tmp_path):
    stamps = made.stamps(SHORT.time_s)
    rows = [f"{s:.6f},1.5,-2.5" for s in stamps]
    (tmp_path / "s.csv").write_text("stamp_s,re_ohm_5.3kHz,im_ohm_5.3kHz\n" + "\n".join(rows) + "\n")
    found = read(tmp_path / "s.csv")
    assert (np.diff(found.time_s) > 0).all()
    assert found.source.rate_hz == pytest.approx(140, rel=1e-3)
    np.testing.assert_allclose(found.clock.real_s(found.time_s) - made.EPOCH_S - 0.03, SHORT.time_s, atol=5e-3)


def test_what_is_no_recording_says_what_is_missing(tmp_path):
    z, t = SHORT.impedance_ohm[BEFORE], SHORT.time_s[BEFORE]
    cases = [
        ({"x": 1.0}, "impedance_data is missing"),
        ({"impedance_data": {"other": z}}, "has the fields other"),
        (made.tree([z], [t], None, ([1e3, 2e3],)), "column for each of its 2 tones"),
        (made.tree([z, z], [t, t], None, [made.TONES_HZ]), "1 structs for 2 lock-ins"),
        (made.tree([z], [t * 0]), "does not rise"),
        (made.tree([z], [t], None, ([-1.0] * 7,)), "tones above 0"),
    ]
    for tree, said in cases:
        with pytest.raises(BadInput, match=said) as error:
            read(save(tmp_path / "bad.mat", tree))
        assert "bad.mat" in str(error.value)


def test_unpacking_is_bounded(tmp_path, monkeypatch, tree):
    file = save(tmp_path / "run.mat", tree, do_compression=True)
    monkeypatch.setattr("sensorgen.measure.recording.spool.MOST_BYTES", file.stat().st_size)
    with pytest.raises(BadInput, match="GB unpacked; expected up to"):
        read(file)


def test_a_header_that_claims_a_hundred_gigabytes_allocates_nothing(tmp_path):
    def element(kind, size, data):
        return struct.pack("<II", kind, size) + data

    huge, dims = 0xFFFFFFF0, element(5, 8, struct.pack("<ii", 100_000, 125_000))
    name = element(1, 14, b"impedance_data\0\0")
    array, cells = (element(6, 8, struct.pack("<II", kind, 0)) for kind in (6, 2))
    for body in (
        element(14, huge, array + dims + name),
        element(14, 80, array + dims + name + element(9, huge, b"\0" * 24)),
        element(14, 72, cells + dims + name + element(0x40005, 32, struct.pack("<II", 1, 0))),
    ):
        file = tmp_path / "huge.mat"
        head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
        for content in (head + body, head + struct.pack("<II", 15, len(zlib.compress(body))) + zlib.compress(body)):
            file.write_bytes(content)
            with pytest.raises(BadInput, match=r"huge\.mat: .*(damaged|cut off|4 GB unpacked|has the fields none)"):
                read(file)
    with h5py.File(tmp_path / "huge.h5", "w") as h5:
        h5.create_dataset("impedance_data/lockin1", (10_000_000_000, 7), "f8", chunks=(1000, 7))
        h5["impedance_time"], h5["settings/dem_freqs"] = [0.0, 1.0], [1e3]
    with pytest.raises(BadInput, match="/impedance_data/lockin1: 522 GB"):
        read(tmp_path / "huge.h5")


def test_hdf5_that_leads_elsewhere_is_refused(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["z"] = np.ones(3)
    with h5py.File(tmp_path / "link.h5", "w") as file:
        file["impedance_data"] = h5py.ExternalLink("secret.h5", "/z")
    with pytest.raises(BadInput, match="a link; expected the data"):
        read(tmp_path / "link.h5")
    for name, end in (("soft.h5", "/z"), ("nowhere.h5", "/none")):
        with h5py.File(tmp_path / name, "w") as file:
            file["z"] = h5py.ExternalLink("secret.h5", "/z")
            file["impedance_data"] = h5py.SoftLink(end)
        with pytest.raises(BadInput, match="impedance_data: a link; expected the data"):
            read(tmp_path / name)
    with h5py.File(tmp_path / "outside.h5", "w") as file:
        file.create_dataset("impedance_data", (4,), "f8", external=[(str(tmp_path / "secret.h5"), 0, 32)])
    with pytest.raises(BadInput, match="in another file"):
        read(tmp_path / "outside.h5")
    with h5py.File(tmp_path / "loop.h5", "w") as file:
        group = file.create_group("impedance_data")
        for k in range(8):
            group[f"lockin{k}"] = group
    with pytest.raises(BadInput, match="without end"):
        read(tmp_path / "loop.h5")
    with h5py.File(tmp_path / "wide.h5", "w") as file:
        inner = file.create_group("g0")
        inner["x"] = 1.0
        for level in range(1, 10):
            outer = file.create_group(f"g{level}")
            for k in range(9):
                outer[f"lockin{k}"] = inner
            inner = outer
        file["impedance_data"] = inner
    with pytest.raises(BadInput, match="without end"):
        read(tmp_path / "wide.h5")
