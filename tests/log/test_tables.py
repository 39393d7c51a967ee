"""Tables that people keep: any names of columns, any separator; and what is no table."""

import math
import pickle
import zipfile

import pytest

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.measure.log import Log, exchange, prints
from sensorgen.measure.log.logbook import withdraw

HEAD = "specimen,y,z,remark\n"


@pytest.fixture
def take(log, tmp_path):
    """Import some bytes or text as a table."""

    def call(content, name="t.csv", **columns):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return exchange.import_file(log, path, columns)

    return call


@pytest.mark.parametrize(
    "text",
    [
        "specimen,y,z,remark\n23 triX,0.65k,40,small holes\n",
        "Design;Resistance in Y;Resistance in Z;Remarks\r\n23 triX;0,65k;40;small holes\r\n",
        "\ufeffNAME\tRY\tRZ\tComment\n23 triX\t650\t40\tsmall holes\n\n\n",
        'remark,z,y,sample\n"small holes"," 40 ",650,23 triX',
    ],
)
def test_every_way_to_write_the_same_table(take, log, text):
    assert take(text).new == 1
    (row,) = log.readings()
    assert (row.specimen, row.y_ohm, row.z_ohm, row.remark) == ("23 triX", (650.0,), (40.0,), "small holes")
    assert (row.source, row.source_row) == ("t.csv", 1)


def test_columns_can_be_named(take, log):
    done = take("what,R1,R2,who\n23 triX,650,40,me\n", specimen="what", y="r1", z="R2")
    assert list(done.document()) == ["1 of 1 rows logged", "columns left out: who"]
    assert log.readings()[0].z_ohm == (40.0,)


def test_columns_of_state_and_time(take, log):
    cells = ["yes", "no", "", "baked", "Unbaked", "TRUE"]
    take("specimen,y,baked,date\n" + "".join(f"23 triX,{k},{cell},May {k}\n" for k, cell in enumerate(cells, 1)))
    assert [r.baked for r in log.readings()] == [True, False, None, True, False, True]
    assert log.readings()[4].measured_at == "May 5"


def test_a_table_that_has_grown_adds_what_is_new(take, log):
    assert take(HEAD + "23 triX,650,40,\n23 triX,650,40,\n").new == 2  # twice the same is two readings
    done = take(HEAD + "23 triX,650,40,\n23 triY,1k,5,\n23 triX,650,40,\n", name="other.csv")
    assert (done.rows, done.new) == (3, 1)
    assert [r.specimen for r in log.readings()] == ["23 triX", "23 triX", "23 triY"]


def test_blank_cells_are_missing_and_doubtful(take, log):
    take(HEAD + "23 triX,650,,\n23 triY,,,\n23 sqXY,0,OL,\n")
    assert [(r.y_ohm, r.z_ohm, r.doubts) for r in log.readings()] == [
        ((650.0,), (), ("z blank: not measured, or an overload",)),
        ((), (), ("no measurement",)),
        ((0.0,), (float("inf"),), ("y: 0 ohm: a short circuit, or a reading below the meter's resolution",)),
    ]


WRONG = {
    "empty": (b"", "t.csv' is empty; expected a table as CSV"),
    "header alone": (HEAD, "no rows below the header"),
    "no specimen": ("y,z\n1,2\n", "row 1: no column specimen among 'y, z'; name it, as --column specimen=NAME"),
    "no value": ("specimen,x\n23 triX,2\n", "row 1: no column y or z"),
    "column twice": ("specimen,y,y\n23 triX,2,3\n", "row 1: column 'y' stands twice"),
    "short row": (HEAD + "23 triX,1,2,\n23 triX,1\n", "row 3: 2 cells, but the header has 4"),
    "open quote": (HEAD + '23 triX,"1,2\n', "row 2: this is no row of a CSV file"),
    "bad value": (HEAD + "23 triX,1,2,\n23 triX,1,about 2,\n", "row 3: resistance in Z: 'about 2' is no resistance"),
    "bad name": (HEAD + "23 triX,1,2,\n\n23 trj,1,2,\n", "row 4: '23 trj' is no specimen's name"),
    "bad state": ("specimen,y,baked\n23 triX,1,half\n", "row 2: column baked: 'half'; expected yes, no or nothing"),
    "zip": (b"PK\x03\x04" + b"\0" * 99, "is a zip archive, as .xlsx and .npz are; expected a table as CSV"),
    "latin-1": (f"{HEAD}23 triX,1,2,gr\xf6\xdfe\n".encode("latin-1"), "row 2, character 15: byte 0xf6 is not UTF-8"),
    "zero byte": (HEAD + "23 triX,1,2,\0\n", "row 2: a zero byte"),
    "long remark": (HEAD + "23 triX,1,2," + "x" * 20_000 + "\n", "row 2: a remark of 20000 characters"),
}


@pytest.mark.parametrize(("content", "message"), WRONG.values(), ids=WRONG)
def test_a_bad_table_is_refused_as_a_whole_by_file_and_row(take, log, content, message):
    with pytest.raises(SensorgenError) as told:
        take(content)
    assert message in str(told.value)
    assert "t.csv" in str(told.value)
    assert len(str(told.value)) < 600
    assert log.readings() == log.specimens() == ()


def test_columns_that_are_not_there(take):
    with pytest.raises(SensorgenError, match=r"unknown column of .*t.csv 'Ry'. Known: RY .ohm., specimen"):
        take("specimen,RY (ohm)\n23 triX,1\n", y="Ry")
    with pytest.raises(SensorgenError, match="unknown column of --column 'yy'; did you mean 'y'"):
        take("specimen,RY\n23 triX,1\n", yy="RY")


@pytest.mark.parametrize("place", ["none.csv", "/dev/zero", "none.json", "none.parquet", "a\0b"])
def test_what_is_no_file(log, tmp_path, place):
    with pytest.raises(SensorgenError, match=r"cannot read|no file|no Parquet file"):
        exchange.import_file(log, tmp_path / place, {})


def test_a_zip_or_pickle_given_as_anything_is_not_executed(log, tmp_path):
    class Evil:
        def __reduce__(self):
            return (open, (str(tmp_path / "pwned"), "w"))

    with zipfile.ZipFile(tmp_path / "t.zip", "w") as archive:
        archive.writestr("t.csv", HEAD)
    for suffix in ("csv", "json", "parquet"):
        for content in (pickle.dumps(Evil()), (tmp_path / "t.zip").read_bytes()):
            (tmp_path / f"t.{suffix}").write_bytes(content)
            with pytest.raises(SensorgenError):
                exchange.import_file(log, tmp_path / f"t.{suffix}", {})
    assert not (tmp_path / "pwned").exists()
    assert log.readings() == ()


def test_a_table_as_log_and_a_log_as_table(log, path, tmp_path):
    with pytest.raises(SensorgenError, match="is a database; expected a table as CSV"):
        exchange.import_file(log, path, {})
    (tmp_path / "t.csv").write_text(HEAD + "x" * 200)
    with pytest.raises(SensorgenError, match="is no SQLite file; expected a log"):
        Log(tmp_path / "t.csv")


def used(log):
    return [(r.specimen, r.y_ohm[0], r.remark) for r in log.readings()]


SHEET = HEAD + "23 triX,650,40,\n23 triX,650,40,\n23 triY,1k,5,\n"
X, Y = ("23 triX", 650, ""), ("23 triY", 1e3, "")


@pytest.mark.parametrize(
    ("before", "after", "left"),
    [
        ("650,40,\n23 triY", "650,40,holes\n23 triY", [X, Y, ("23 triX", 650, "holes")]),
        ("1k,5,", "1.1k,5,", [X, X, ("23 triY", 1.1e3, "")]),
        ("1k,5,", "1k,5,odd", [X, X, ("23 triY", 1e3, "odd")]),
        ("23 triY,", "23 triY 2,", [X, X, ("23 triY 2", 1e3, "")]),
        ("remark\n", "remark\n23 triX 3,9,9,\n", [X, X, Y, ("23 triX 3", 9, "")]),
    ],
)
def test_an_edited_row_corrects_the_reading_that_it_came_from(take, log, before, after, left):
    assert take(SHEET).new == 3
    edited = SHEET.replace(before, after)
    done = take(edited)
    assert used(log) == left
    assert (done.new, done.corrections) == (1, len(left) == 3)
    assert take(edited).new == 0
    assert used(log) == left


def test_an_edit_that_is_taken_back_and_made_again(take, log):
    for remark in ("", "a", "", "b", "a", ""):
        assert take(HEAD + f"23 triX,650,40,{remark}\n23 triY,1k,5,\n").rows == 2
        assert sorted(used(log)) == [("23 triX", 650.0, remark), ("23 triY", 1e3, "")]


def test_another_table_of_the_same_name_is_refused_with_the_way_out(take, log):
    take(HEAD + "23 triX,650,40,\n")
    with pytest.raises(SensorgenError, match=r"row 2: .*withdraw reading 1 .*another name"):
        take(HEAD + "23 triX,700,40,\n")
    assert take(HEAD + "23 triX,700,40,\n", name="tuesday.csv").new == 1
    assert take(HEAD + "23 triY,700,40,\n").new == 1  # another specimen: another reading
    withdraw(log, "reading", 1, "corrected")
    assert take(HEAD + "23 triX,710,40,\n").new == 1
    assert [r.y_ohm[0] for r in log.readings()] == [700.0, 700.0, 710.0]


def test_a_fault_in_the_last_row_logs_none_of_those_before(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("\n".join(["specimen,y", *["23 triX,0.6k"] * 300, "23 triX,hello"]) + "\n")
    with Log(tmp_path / "log.db", create=True) as log:
        with pytest.raises(BadInput, match=r"row 302"):
            exchange.import_file(log, path, {})
        assert log.head() == (0, "")
        assert exchange.thesis(log).new == 69  # no transaction is left open


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        ("Y (kohm);Z [MΩ]", {}),
        ("Y / kohm;z_Mohm", {}),
        ("R along (kOhm);R2 (M)", {"y": "R along (kOhm)", "z": "R2 (M)"}),
    ],
)
def test_units_in_the_header_scale_bare_numbers(take, log, head, columns):
    take(f"Specimen;{head}\n23 triX;1,7 / 2 ;>20\n23 triX;650 ohm;9.9E37\n", **columns)
    assert [row.y_ohm for row in log.readings()] == [(1700.0, 2000.0), (650.0,)]
    assert [row.z_ohm for row in log.readings()] == [(math.inf,)] * 2


def test_units_of_something_else_in_the_header_are_refused(take, log):
    with pytest.raises(BadInput, match=r"t.csv, row 1: unit of column 'Y \(V\)'; expected ohm, kohm or Mohm"):
        take("Specimen,Y (V)\n23 triX,1\n", y="Y (V)")
    assert take("Specimen,R along (ohm)\n23 triX,650\n", y="R along (ohm)").new == 1
    assert log.readings()[0].y_words == "650"  # as in logs of before: the same row


def test_points_of_thousands_are_doubted_where_commas_are_decimal(take, log):
    take("Specimen;y;z\n23 triX;1.300;0.650 / 45,1\n")
    (row,) = log.readings()
    assert row.y_ohm == (1.3,)
    assert [doubt for doubt in row.doubts if "thousands" in doubt] == [
        "1.300: point read as the decimal one; thousands would be 1300 ohm"
    ]
    take("Specimen,y,z\n23 triX,1.300,45\n", name="other.csv")
    assert not any("thousands" in doubt for doubt in log.readings()[1].doubts)


def test_a_table_may_name_specimens_that_are_bound_to_a_design(take, log, tmp_path):
    (tmp_path / "mine.yaml").write_text("shape: reference\nparameters: {length_mm: 60}\n")
    prints.bind(log, ["F0", "F1"], str(tmp_path / "mine.yaml"))
    assert take("specimen;y;z\nF0;1,70k;OL\n F1 ;2k;OL\n23 triX;3k;OL\n").new == 3
    assert [row.specimen for row in log.readings()] == ["F0", "F1", "23 triX"]
    assert log.readings()[0].design_id == log.bound("F0").design_id
    with pytest.raises(BadInput, match=r"t.csv, row 2: .*log specimen NAME --design FILE"):
        take("specimen;y;z\nF2;1,70k;OL\n")


def test_rows_that_another_table_had_are_told(take):
    take(HEAD + "23 triX,650,40,\n23 triY,1k,5,\n", name="monday.csv")
    done = take(HEAD + "23 triX,650,40,\n23 triY,2k,5,\n", name="friday.csv")
    assert list(done.document()) == [
        "1 of 2 rows logged, 1 were there",
        "1 were there as rows of monday.csv: if they were measured anew, give them a date or a remark",
    ]
    again = take(HEAD + "23 triX,650,40,\n23 triY,1k,5,\n", name="monday.csv")
    assert (again.new, again.elsewhere) == (0, {})
