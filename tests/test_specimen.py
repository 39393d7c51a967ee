"""Names of specimens: the thesis's whole table, slips and all; any text is read or refused."""

import csv
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.design import design
from sensorgen.design.specimen_name import MAX_LETTERS, SpecimenName, design_of, named, parse

HERE = Path(__file__).parent
DESIGNS = HERE.parent / "designs"
TABLE = list(csv.DictReader((HERE / "reference" / "specimen_names.csv").read_text("utf-8").splitlines()))

DOUBTS = {  # what the table's notes say of a name, and the word of ours that says it
    "upper case": "upper case",
    "OCR: \"SQYA\"": "YA read as YX",
    "OCR: saXY": "'sa' read as sq",
    "OCR: tri¥/triV": "read as Y",
    "no axes in name": "no axes",
    "film 0 by the naming rule": "no film named",
    "\"6mm\"": "too thick for a film",
    "\"2mm\" read as": "the point is lost",
    "replicate \"": "taken for a place",
    "spelling \"": "read as extrafine",
    "film written 0.Nmm": "written .",
}  # fmt: skip


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row['row']}: {row['name_raw']}")
def test_every_name_of_the_thesis(row):
    s = parse(row["name_raw"])
    assert s.raw == row["name_raw"]
    assert s.name == row["name_normal"].replace(" 0.", " .")  # the table keeps 0.1mm, the grammar has .1mm
    assert s.iteration == int(row["iteration"])
    assert (s.shape, s.axes) == (row["shape"], row["axes"])
    # "6mm" is no film; the table's column is empty there.
    assert s.film_mm == (float(row["film_mm"]) if row["film_mm"] else None)
    assert (str(s.replicate) if s.replicate else s.place) == row["replicate"]
    assert s.quality == row["slicing"]
    said = "; ".join(s.assumed)
    for note, word in DOUBTS.items():
        if note in row["notes"] and not (note.startswith("film 0") and "6mm" in row["notes"]):
            assert word in said, note


def test_no_two_prints_of_the_thesis_share_a_name():
    assert len({parse(row["name_raw"]).name for row in TABLE}) == len(TABLE)


@pytest.mark.parametrize(
    ("found", "name"),
    [
        ("23triX.1mm", "23 triX .1mm"),
        ("  23   TRIX  .1mm   2 ", "23 triX .1mm 2"),
        ("23 triX 2 .1mm", "23 triX .1mm 2"),
        ("23 triX\u00a0.1 mm 2", "23 triX .1mm 2"),
        ("23 tri￥.2mm", "23 triY .2mm"),
        ("23 triX 1mm", "23 triX .1mm"),
        ("23 triX xtra fine", "23 triX xtrafine"),
        ("23 triX 2 extrafine r", "23 triX 2 xtrafine r"),
        ("23-trix-d0.2-xtrafine-4", "23 triX .2mm 4 xtrafine"),
        ("23_sqxy_d0.1", "23 sqXY .1mm"),
        ("triX .2mm 3", "triX .2mm 3"),
        ("26 rectXY .15mm", "26 sqXY .15mm"),
        ("26 triX 2.0mm", "26 triX 2.0mm"),
        ("26 reference .6mm", "26 SX60 .6mm"),
    ],
)
def test_other_slips(found, name):
    assert parse(found).name == name


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("", "no shape"),
        ("23", "no shape"),
        ("23 trjX", "no shape"),
        ("23 triXY", "X or Y"),
        ("23 sqXX", "XY or YX"),
        ("23 SX60 X", "cannot read 'x'"),
        ("23 triX .1mm .2mm", "two words for its film"),
        ("23 triX fine x fine", "two words for its slicing"),
        ("23 triX 0", "cannot read '0'"),
        ("23 triX finest", "cannot read 'finest'"),
        ("23 triX 10.5mm", "at most 10 mm"),
        ("23 triX; DROP TABLE prints", "cannot read"),
        ("x" * (MAX_LETTERS + 1), "at most 100"),
    ],
)
def test_hopeless_names(wrong, said):
    with pytest.raises(BadInput, match="expected <iteration>") as error:
        parse(wrong)
    assert said in str(error.value)
    assert len(str(error.value)) < 400


PARTS = [*"0123456789.xyXY¥ -_rlmd,", "tri", "sq", "SX60", "mm", "fine", "xtra", "double", ".2mm", "\n", "٣"]
WORDISH = st.lists(st.sampled_from(PARTS), max_size=12).map("".join)


@given(st.one_of(st.text(), WORDISH, WORDISH.map("23 triX ".__add__)))
def test_any_text_is_read_or_refused(text):
    try:
        s = parse(text)
    except BadInput:
        return
    again = parse(s.format())
    assert again == s
    assert again.name == s.name
    assert not [a for a in again.assumed if "read as" in a and "extrafine" not in a]  # the normal form has no slip
    made = design_of(s)
    assert made is None or made.shape == s.shape


NAMES = st.builds(
    SpecimenName,
    iteration=st.one_of(st.none(), st.integers(0, 9999)),
    shape=st.just("tri"),
    axes=st.sampled_from(["X", "Y", ""]),
    film_mm=st.integers(0, 10_000_000).map(lambda k: k / 1e6),
    replicate=st.one_of(st.none(), st.integers(1, 9999)),
    slicing=st.sampled_from(["", "fine", "x fine", "xfine", "xtrafine"]),
    place=st.sampled_from(["", "r", "l", "m"]),
)


@given(NAMES)
def test_a_name_read_back_is_the_same_specimen(specimen):
    assert parse(specimen.format()) == specimen


@pytest.mark.parametrize("path", sorted((DESIGNS / "23").glob("*.yaml")), ids=lambda p: p.stem)
def test_names_lead_to_the_designs_of_the_thesis(path):
    film = {"0": "", "0.1": " .1mm", "0.2": " .2mm"}[path.stem.partition("-d")[2]]
    found = design_of(parse(f"23 {path.stem.partition('-d')[0]}{film} 3"))
    assert found.id() == design.load(path).id()


def test_extra_fine_names_lead_to_extra_fine_designs():
    assert design_of(parse("23 triY .1mm xfine")).layers.layer_mm == 0.06


@pytest.mark.parametrize("name", ["20 sqXY 6mm", "20 sq 1", "23 double .2mm"])
def test_names_that_do_not_tell_their_design(name):
    assert design_of(parse(name)) is None


@pytest.mark.parametrize(
    "data",
    [
        {"shape": "tri", "parameters": {"dielectric_mm": 0.125, "along": "y"}, "quality": "extrafine"},
        {"shape": "tri", "parameters": {"dielectric_mm": 0.0}},
        {"shape": "rect", "parameters": {"dielectric_mm": 2.0, "along": "yx"}},
        {"shape": "reference"},
        {"shape": "double"},
    ],
)
def test_the_name_of_a_design_leads_back_to_it(data):
    made = design.make(data)
    specimen = parse(named(made, 26, 7).name)
    assert (specimen.iteration, specimen.replicate) == (26, 7)
    assert design_of(specimen).id() == made.id()
