"""Table D.1: 69 rows in, the same 69 out, held against a table that was parsed by hand."""

import csv
from pathlib import Path

import pytest

from sensorgen.measure.log.exchange import thesis_readings

TABLE = list(csv.DictReader((Path(__file__).parents[1] / "reference" / "table_d1.csv").read_text("utf-8").splitlines()))
OURS = {  # what the notes say, and the word of ours that says it
    "upper case": "upper case",
    "SQYA": "axes YA read as YX",
    "saXY": "'sa' read as sq",
    "tri¥/triV": "read as Y",
    '"2mm" read as': "the point is lost",
    '"6mm"': "too thick for a film",
    "film written 0": "written .",
    '"xtrafine"': "'xtrafine' read as extrafine",
    '"xfine"': "'xfine' read as extrafine",
    "not explained in the thesis": "not explained",
    "no axes in name": "no axes",
    "upper-case K": "K read as kilo",
    "m read as mega": "m read as mega",
    "rz 0": "a short circuit, or a reading below",
    "several values": "readings: repeats",
    "one column blank": "blank: not measured, or an overload",
    "no measurement": "no measurement",
    "k lost": "a k lost?",
    "lost k": "a k lost?",
    "film 0 by the naming rule": "no film named",
}


def numbers(cell):
    return tuple(float(number) for number in cell.split(";") if number)


@pytest.fixture(scope="module")
def rows():
    return thesis_readings()


def test_every_row_means_what_it_says(rows):
    for k in range(69):
        row, truth = rows[k], TABLE[k]
        assert row.written == truth["name_raw"]
        assert (row.iteration, row.shape, row.axes) == (int(truth["iteration"]), truth["shape"], truth["axes"])
        assert row.film_mm == (float(truth["film_mm"]) if truth["film_mm"] else None)
        assert (row.y_ohm, row.z_ohm) == (numbers(truth["ry_ohm"]), numbers(truth["rz_ohm"]))
        assert row.remark == truth["remark"]
        assert row.baked is (False if truth["remark"] == "not baked" else None)
        assert row.source_row == k + 1
        assert bool(row.design_id) == bool(row.axes and row.film_mm is not None)


def test_every_doubt_of_the_notes_is_flagged_and_no_other(rows):
    for k in range(69):
        said, notes = "; ".join(rows[k].doubts), TABLE[k]["notes"]
        for note, word in OURS.items():
            if note in notes and not (note.startswith("film 0") and rows[k].size_mm):
                assert word in said, (k, note)
        assert bool(rows[k].doubts) == bool(notes), k


def test_the_words_are_the_thesis_s_own(rows):
    words = {(r.written, r.y_words, r.z_words) for r in rows}
    assert {("23 triX", "0.68k", "45"), ("22 triX", "2.3k / 3.8k", "3.3k / 1.3k"), ("19 SQXY", "0.9K", "0")} <= words
    assert {("23 triY .1mm xfine", "75k", "1.1m"), ("23 sqYX 0.2mm 3", "1.6k / 1k", "0.5k / 1k / 1.3k")} <= words
    assert sum(not r.y_words and not r.z_words for r in rows) == 2


def test_in_and_out_again(run, tmp_path):
    assert "69 of 69 rows logged" in run("import", "--thesis").out
    assert "0 of 69 rows logged, 69 were there" in run("import", "--thesis").out
    for place in ("d1.csv", "d1.parquet", "whole"):
        assert run("export", place).out.startswith("69 rows in")
        assert "69 of 69 rows logged" in run("import", place, "--log", f"{place}.db").out
        assert "69 were there" in run("import", place).out
    assert len(list(csv.DictReader((tmp_path / "d1.csv").read_text("utf-8").splitlines()))) == 69
