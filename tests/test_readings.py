"""CSV files of impedances: what passes, and what is said about the rest."""

import io
import os
import sys
import tracemalloc
from contextlib import suppress

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.measure.csv_table import CsvTable, Waiting
from sensorgen.measure.readings import Readings, readings

HEAD = "time_s,re_ohm_1.1kHz,im_ohm_1.1kHz,re_ohm_99.7kHz,im_ohm_99.7kHz\n"
ROW = "0.5,100,-2e6,90.5,-2e4\n"


@pytest.fixture
def read(tmp_path):
    """Read text or bytes as a file; gives tones, names of other columns, impedances, other cells and row numbers."""

    def call(text, size=1 << 14):
        path = tmp_path / "m.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with readings(str(path)) as source:
            blocks = list(source.blocks(size))
        z = np.concatenate([b.impedance_ohm for b in blocks])
        rows = [row for b in blocks for row in b.rows]
        return source.frequency_hz.tolist(), source.kept, z, [cells for b in blocks for cells in b.text], rows

    return call


def test_a_plain_file(read):
    tones, kept, z, cells, rows = read(HEAD + ROW + ROW)
    assert tones == [1100.0, 99700.0]
    assert kept == ["time_s"]
    assert z.tolist() == [[100 - 2e6j, 90.5 - 2e4j]] * 2
    assert cells == [["0.5"], ["0.5"]]
    assert rows == [2, 3]


@pytest.mark.parametrize("size", [1, 3])
def test_blocks_do_not_show(read, size):
    text = HEAD + "".join(f"t{k},{k},-{k},2,-3\n" for k in range(10))
    _, _, z, cells, rows = read(text, size)
    assert z[:, 0].real.tolist() == list(range(10))
    assert [c[0] for c in cells] == [f"t{k}" for k in range(10)]
    assert rows == list(range(2, 12))


WAYS = {
    "bom": "\ufeff" + HEAD + ROW,
    "no last newline": HEAD + ROW.rstrip("\n"),
    "crlf": (HEAD + ROW).replace("\n", "\r\n"),
    "blank rows": HEAD + "\n" + ROW + "\n \n",
    "semicolons": (HEAD + ROW).replace(",", ";"),
    "decimal commas": HEAD.replace("1.1kHz", "1.1 kHz").replace(",", ";") + "0,5;100;-2e6;90,5;-2e4\n",
    "tabs": (HEAD + ROW).replace(",", "\t"),
    "quotes": HEAD + '"0.5",100,-2e6,"90.5",-2e4\n',
    "Hz": HEAD.replace("1.1kHz", "1100Hz").replace("99.7kHz", "0.0997MHz") + ROW,
    "blanks": HEAD + ROW.replace(",", " , "),
}


@pytest.mark.parametrize("text", WAYS.values(), ids=WAYS)
def test_other_ways_to_write_the_same(read, text):
    tones, _, z, _, _ = read(text)
    assert tones == pytest.approx([1100.0, 99700.0])
    assert z.tolist() == [[100 - 2e6j, 90.5 - 2e4j]]


def test_quoted_labels_keep_their_separators(read):
    _, kept, z, cells, _ = read('label,re_ohm_1kHz,im_ohm_1kHz\n"a, ""b""",1,-2\nplain,3,-4\n')
    assert kept == ["label"]
    assert cells == [['a, "b"'], ["plain"]]
    assert z[:, 0].tolist() == [1 - 2j, 3 - 4j]


@pytest.mark.parametrize("row", ["1,,-2e6,1,-2", "1,NaN,-2e6,1,-2", "1, ,-2e6,1,-2", "0,5;1,25;;1;-2,0"])
def test_empty_cells_were_not_measured(read, row):
    z = read((HEAD.replace(",", ";") if ";" in row else HEAD) + row + "\n")[2]
    assert np.isnan(z[0, 0])
    assert z[0, 1] == 1 - 2j


def test_columns_in_any_order(read):
    tones, kept, z, cells, _ = read("im_ohm_2kHz,a,re_ohm_1kHz,re_ohm_2kHz,b,im_ohm_1kHz\n-4,x,1,3,y,-2\n")
    assert tones == [1000.0, 2000.0]
    assert z.tolist() == [[1 - 2j, 3 - 4j]]
    assert (kept, cells) == (["a", "b"], [["x", "y"]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["m.csv", "the file is empty", "expected a header"]),
        (HEAD, ["m.csv", "no rows below the header"]),
        ("time_s,force_n\n1,2\n", ["row 1", "no impedances among the columns time_s, force_n"]),
        ("re_ohm_1kHz,x\n1,2\n", ["row 1", "column re_ohm_1kHz has no partner im_ohm_1kHz"]),
        ("re_ohm_1kHz,im_ohm_1kHz,re_ohm_1kHz\n1,2,3\n", ["re_ohm_1kHz and re_ohm_1kHz are the same part"]),
        ("re_ohm_1kHz,im_ohm_1kHz,re_ohm_1000Hz,im_ohm_1000Hz\n1,2,3,4\n", ["re_ohm_1kHz and re_ohm_1000Hz"]),
        ("re_ohm_abc,im_ohm_abc\n1,2\n", ["row 1", "column re_ohm_abc", "'abc' is not a frequency"]),
        ("re_ohm_0Hz,im_ohm_0Hz\n1,2\n", ["column re_ohm_0Hz", "above 0"]),
        (HEAD + ROW + "1,2,x,4,5\n", ["m.csv", "row 3", "column im_ohm_1.1kHz", "'x' is not a number"]),
        (HEAD + ROW + "1,2,3,4\n", ["row 3", "4 cells, but the header has 5"]),
        (HEAD + "0,5,100,5,-2,5,90,5,-2,5\n", ["row 2", "10 cells", "decimal commas", "';'"]),
        (HEAD + ROW + "1,inf,3,4,5\n", ["row 3", "column re_ohm_1.1kHz", "'inf' is not finite"]),
        (HEAD + '1,"2,3,4,5\n', ["row 2", "close every quotation mark"]),
        (HEAD + ROW + '"a"b,"1",2,3,4\n', ["m.csv, row 3", "close every quotation mark"]),
        ('"' + HEAD + ROW, ["m.csv, row 1", "close every quotation mark"]),
        ((HEAD + ROW).replace("\n", "\r"), ["m.csv, row 1", "end rows with a line feed"]),
        (HEAD + ROW + "1,2\r,3,4,5\n", ["m.csv, row 3", "end rows with a line feed"]),
        ("x" * 200_000 + "," + HEAD + ROW, ["m.csv, row 1", "field limit"]),
        (HEAD + ROW + "1,1_0,3,4,5\n", ["row 3", "column re_ohm_1.1kHz", "'1_0' is not a number"]),
        (HEAD + ROW + "1,\u0661,3,4,5\n", ["row 3", "column re_ohm_1.1kHz", "is not a number"]),
        (HEAD.replace(",", ";") + "1;1.234,5;2;3;4\n", ["row 2", "'1.234,5' has a point and a comma"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_place(read, text, words):
    with pytest.raises(BadInput) as error:
        read(text)
    for word in words:
        assert word in str(error.value)


def test_the_row_is_right_in_later_blocks(read):
    with pytest.raises(BadInput, match=r"row 9, column im_ohm_1\.1kHz"):
        read(HEAD + ROW * 7 + "1,2,x,4,5\n" + ROW, size=3)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (HEAD.encode() + ROW.encode() * 3 + b"1,2\xff,3,4,5\n" + ROW.encode(), "row 5, character 4: byte 0xff"),
        (b"\xb5" + (HEAD + ROW).encode(), "row 1, character 1: byte 0xb5"),
        ((HEAD + ROW).encode("utf-16"), "row 1, character 1"),
    ],
)
def test_text_that_is_not_utf8(read, text, place):
    for size in (1, 1 << 14):
        with pytest.raises(BadInput, match=rf"m\.csv, {place}.* is not UTF-8"):
            read(text, size)


def test_other_alphabets_are_text(read):
    assert read("ort_µm," + HEAD + "€," + ROW)[3] == [["€", "0.5"]]


def test_no_damage_to_a_file_ends_in_anything_but_words(read):
    """Four hundred files with one to four wrong bytes: read, or refused in one line."""
    rng = np.random.default_rng(11)
    whole, marks = (HEAD + ROW * 3).encode(), b',;"\n\r\t .eE-+\x00\xff\xc3na0123'
    for _ in range(400):
        damaged = bytearray(whole)
        for _ in range(rng.integers(1, 5)):
            damaged.insert(rng.integers(len(damaged)), marks[rng.integers(len(marks))])
        with suppress(BadInput):
            assert not np.isinf(read(bytes(damaged))[2]).any()


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(BadInput, match="is a folder"), readings(str(tmp_path)):
        pass
    with pytest.raises(BadInput, match="No such file"), readings(str(tmp_path / "none.csv")):
        pass
    with pytest.raises(BadInput, match="null"), readings("a\0b"):
        pass


def test_a_block_of_the_standard_input_is_what_has_come(monkeypatch):
    reader, writer = os.pipe()
    with os.fdopen(reader, "rb") as end, os.fdopen(writer, "wb", buffering=0) as pipe:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(end, encoding="utf-8"))
        pipe.write(b"\xef\xbb\xbf" + (HEAD + ROW).encode())
        with readings("-") as source:
            blocks = source.blocks()
            assert next(blocks).rows == [2]
            pipe.write((ROW * 3 + ROW[:3]).encode())
            assert next(blocks).rows == [3, 4, 5]
            pipe.write((ROW[3:] + ROW.rstrip()).encode())
            assert next(blocks).rows == [6]
            pipe.close()
            assert [block.rows for block in blocks] == [[7]]


class Trickle(io.BytesIO):
    """A stream that gives five bytes at a time, as a pipe may."""

    def read1(self, size=-1):
        return self.read(5)


@pytest.mark.parametrize("kind", [io.BytesIO, Trickle])
@pytest.mark.parametrize("limit", [1, 7, 100])
def test_lines_of_a_stream_are_those_of_a_file(limit, kind):
    text = "a,b\n1,2\n\nlonger than the limit\r\nno end"
    stream, file = Waiting(kind(text.encode())), io.StringIO(text, newline="\n")
    assert [stream.readline(limit) for _ in text] == [file.readline(limit) for _ in text]


def test_memory_does_not_grow_with_the_file(tmp_path):
    path = tmp_path / "long.csv"
    peaks = []
    for rows in (4_000, 16_000):
        with path.open("w") as file:
            file.write(HEAD)
            file.writelines([ROW] * rows)
        tracemalloc.start()
        with readings(str(path)) as source:
            assert sum(len(b.rows) for b in source.blocks(2048)) == rows
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


def test_sweeps_of_an_lcr_meter_are_samples(tmp_path):
    path = tmp_path / "lcr.csv"
    path.write_text("Frequency [kHz];Cp [pF];D\n" + "100;60;0.02\n1;61;0.01\n" * 3)
    with readings(str(path)) as source:
        (block,) = source.blocks()
    assert (source.frequency_hz.tolist(), source.kept) == ([1e3, 1e5], [])
    omega = 2 * np.pi * source.frequency_hz
    admittance = omega * np.array([61e-12, 60e-12]) * (np.array([0.01, 0.02]) + 1j)
    np.testing.assert_allclose(block.impedance_ohm, [1 / admittance] * 3)
    path.write_text("Frequency [kHz];Cp [pF]\n100;60\n")
    with pytest.raises(BadInput, match=r"lcr.csv: no two quantities .* as Cp and D"), readings(str(path)):
        pass


def test_of_readings_that_wait_the_newest_is_left_and_those_at_rest():
    """A pipe that brought seven rows while the first were worked off."""
    head = "time_s,re_ohm_1kHz,im_ohm_1kHz,rest\n"
    rest = [1, 0, 0, 1, 0, 0, 0]
    text = head + "".join(f"{k},{100 + k},-5,{at_rest}\n" for k, at_rest in enumerate(rest))
    source = Readings(CsvTable("pipe", Waiting(io.BytesIO(text.encode()))), ("rest",), newest=True)
    (block,) = source.blocks()
    assert block.rows == [2, 5, 8]
    assert block.impedance_ohm[:, 0].real.tolist() == [100, 103, 106]
    assert block.text == [["0"], ["3"], ["6"]]
    assert source.dropped == 4
    (whole,) = Readings(CsvTable("pipe", Waiting(io.BytesIO(text.encode()))), ("rest",)).blocks()
    assert len(whole.rows) == 7
