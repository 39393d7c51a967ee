"""Out and in again: everything that was logged is the very same, in CSV, in Parquet and in spreadsheets' hands."""

import csv
import dataclasses
import io
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput, MissingValue, Unwritable
from sensorgen.measure.csv_table import CsvTable
from sensorgen.measure.log import Batch, BenchRun, Log, Print, RawFile, Reading, entries, exchange, files, verify
from sensorgen.measure.log.entries import ROWS, DesignRow, Withdrawal
from sensorgen.measure.log.notes import reading
from sensorgen.measure.log.prints import prediction

TRI_X = {"shape": "tri", "axes": "X", "film_mm": 0.0}
FACTS = '{"n": 1}'
REMARKS = [
    "=1+1", "+1", "-1", "@x", "'quoted", "''=1", "\tx", "x\r\ny", "\r", "x\ry", "\nx", "＝1", '"a","b"', "a;b", "",
    " x ", "∞", "ü\u2028",
]  # fmt: skip


PREDICTED = {"capacitance_f": {"lower": 1e-11, "upper": 2e-11}}


def everything(log):
    return {kind: list(log.entries(kind, superseded=True)) for kind in ROWS}


def as_imported(rows):
    """Rows as an import shows them: logged when they were imported; the time that the export states is a claim."""
    return {k: [dataclasses.replace(r, claimed_at="", logged_at="") for r in of] for k, of in rows.items()}


@pytest.fixture
def full(log, tmp_path):
    """A log with rows of every kind, and every kind of value in them."""
    (tmp_path / "run.MAT").write_bytes(b"raw" * 99)
    raw = files.keep(log.files, tmp_path / "run.MAT")
    old = reading("26 triX", "0.1", remark=REMARKS[0], baked=True, source_row=3)
    log.add(
        [
            raw,
            reading("26 triX", "1", remark="before the print bed was known", uid="unbedded"),
            Batch(uid="b", batch="26", file=raw.uid),
            Print(uid="p", specimen="26 triX", iteration=26, batch_uid="b", design_id="d", design="trix", **TRI_X),
            old,
            *(reading("triX .3333mm 7", "1.23456789k / OL", "0", remark=remark, baked=False) for remark in REMARKS),
            reading("26 triX", "100", supersedes=old.uid),
            BenchRun(uid="run", specimen="26 triX", written="26 triX", file=raw.uid, facts=FACTS, source="=run.mat"),
            prediction("d", "trix", PREDICTED),
            DesignRow(uid="d", design="trix", data="{}"),
            Withdrawal(uid="w", of="reading", supersedes="unbedded", reason="=by mistake"),
        ]
    )
    return log


def test_the_whole_log_comes_back(full, tmp_path):
    rows = exchange.export(full, tmp_path / "out")
    assert rows == sum(map(len, everything(full).values())) == len(REMARKS) + 10
    with Log(tmp_path / "new.db", create=True) as new:
        done = exchange.import_file(new, tmp_path / "out", {})
        assert (done.rows, done.new) == (rows, rows)
        assert as_imported(everything(new)) == as_imported(everything(full))
        for kind, rows in everything(full).items():
            assert [row.claimed_at for row in new.entries(kind, superseded=True)] == [row.logged_at for row in rows]
        assert new.specimens() == full.specimens()
        assert list(verify.faults(new)) == []
        kept = next(new.entries(RawFile))
        assert files.place(new.files, kept).read_bytes() == b"raw" * 99
        assert files.place(new.files, kept).suffix == ".mat"
        assert exchange.import_file(new, tmp_path / "out", {}).new == 0


@pytest.mark.parametrize("form", exchange.FORMATS)
def test_readings_alone_come_back(full, tmp_path, form):
    exchange.export(full, tmp_path / f"r.{form}")
    with Log(tmp_path / "new.db", create=True) as new:
        exchange.import_file(new, tmp_path / f"r.{form}", {})
        alone, (unbedded, *others) = new.readings(superseded=True), full.readings(superseded=True)
        assert unbedded.uid == "unbedded"
        moved = [dataclasses.replace(one, number=one.number - 1) for one in others]
        assert as_imported({0: alone}) == as_imported({0: moved})
        assert [one.uid for one in new.readings()] == [one.uid for one in full.readings()]  # none that was withdrawn


def test_parquet_holds_types_that_others_read(full, tmp_path):
    import pyarrow.parquet

    exchange.export(full, tmp_path / "r.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    assert table.column("y_ohm").to_pylist()[1] == [1234.56789, math.inf]
    assert table.column("baked").to_pylist()[:2] == [True, False]
    assert table.column("film_mm").to_pylist()[:2] == [0.0, 0.3333]
    assert table.column("remark").to_pylist()[1 : len(REMARKS) + 1] == REMARKS


def test_no_cell_is_a_formula(full, tmp_path):
    exchange.export(full, tmp_path / "out")
    for file in (tmp_path / "out").glob("*.csv"):
        with file.open(encoding="utf-8", newline="") as text:
            cells = [cell for row in csv.reader(text) for cell in row]
        assert len(cells) > 4
        assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@", "\t", "\r", "\n", "＝"))]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20), max_size=5))
def test_any_text_comes_back_from_csv(words):
    rows = [
        Reading(uid=f"u{k}", specimen=word, written=word, remark=word, doubts=(word, "="))
        for k, word in enumerate(words)
    ]
    text = "".join(exchange.csv_lines(Reading, rows))
    assert list(exchange.from_csv(Reading, CsvTable("x", io.StringIO(text, newline="")))) == rows


def test_a_terminal_obeys_no_cell_and_the_text_comes_back():
    bad = "a\x1b[31m\x9b2J\u202eb\x07"
    words = (bad, f"'\"{bad}", "'\"a")
    rows = [Reading(uid="u", specimen="S", written="S", remark=word, doubts=(word,)) for word in words]
    text = "".join(exchange.csv_lines(Reading, rows))
    assert not set("\x1b\x9b\u202e\x07") & set(text)
    assert list(exchange.from_csv(Reading, CsvTable("x", io.StringIO(text, newline="")))) == rows


@given(
    st.lists(st.floats(allow_nan=False), max_size=4).map(tuple),
    st.none() | st.booleans(),
    st.none() | st.integers(-5, 2**62),
)
def test_any_numbers_come_back(ohm, baked, number):
    for annotation, value in ((tuple[float, ...], ohm), (bool | None, baked), (int | None, number)):
        assert entries.from_cell(annotation, entries.to_cell(value)) == value


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("y_ohm", "[1, nan]"), ("y_ohm", "[1"), ("y_ohm", "1"), ("y_ohm", "[true]"), ("baked", "True"),
        ("film_mm", "nan"), ("iteration", "1.5"), ("doubts", "[1]"), ("doubts", "[" * 9000),
    ],
)  # fmt: skip
def test_a_cell_that_the_log_did_not_write_is_refused(full, tmp_path, column, cell):
    exchange.export(full, tmp_path / "r.csv")
    with (tmp_path / "r.csv").open(encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    rows[2][column] = cell
    with (tmp_path / "bad.csv").open("w", encoding="utf-8", newline="") as text:
        table = csv.DictWriter(text, rows[0])
        table.writeheader()
        table.writerows(rows)
    with Log(tmp_path / "new.db", create=True) as new:
        with pytest.raises(BadInput, match=f"bad.csv, row 4, column {column}: .* is not what the log writes there"):
            exchange.import_file(new, tmp_path / "bad.csv", {})
        assert new.readings() == ()


def test_raw_files_of_an_export_are_checked(full, tmp_path):
    exchange.export(full, tmp_path / "out")
    (file,) = (tmp_path / "out" / "files").iterdir()
    with Log(tmp_path / "new.db", create=True) as new:
        for content in (b"other", None):
            file.unlink()
            if content:
                file.write_bytes(content)
            with pytest.raises((BadInput, Unwritable), match=r"is not the file of that SHA-256|No such file"):
                exchange.import_file(new, tmp_path / "out", {})
        table = tmp_path / "out" / "raw-files.csv"
        table.write_text(table.read_text("utf-8").replace(file.name, "../../../etc/passwd"), "utf-8")
        with pytest.raises(BadInput, match="is no SHA-256 of a raw file"):
            exchange.import_file(new, tmp_path / "out", {})
        assert all(not rows for rows in everything(new).values())


def test_folders_that_are_no_export(full, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadInput, match=r"has no raw-files.csv; expected the folder of an exported log"):
        exchange.import_file(full, tmp_path / "empty", {})
    exchange.export(full, tmp_path / "out")
    (tmp_path / "out" / "readings.csv").replace(tmp_path / "out" / "batches.csv")
    with pytest.raises(BadInput, match="columns of another table; expected those of batches"):
        exchange.import_file(full, tmp_path / "out", {})
    for place in ("out", "r.xlsx"):
        with pytest.raises(BadInput, match=r"expected a .csv or .parquet file, or a folder that is not there"):
            exchange.export(full, tmp_path / place)
    assert not [p for p in tmp_path.iterdir() if p.name.endswith(".part")]


def test_without_pyarrow_parquet_is_refused_and_csv_is_not(full, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    with pytest.raises(MissingValue, match=r"pip install 'sensorgen\[parquet\]', or export CSV"):
        exchange.export(full, tmp_path / "r.parquet")
    assert exchange.export(full, tmp_path / "r.csv") == len(REMARKS) + 2
