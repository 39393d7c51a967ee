"""What comes of the thesis's numbers: the known misprints, nothing unexplained, and the page in the documents."""

import json
import math
from collections import Counter
from pathlib import Path

import pytest

from sensorgen.verification import thesis
from sensorgen.verification.thesis.checks import press
from sensorgen.verification.thesis.items import (
    DIFFERS,
    JUDGED,
    LOST,
    MISPRINT,
    NOT_COVERED,
    TRANSCRIBED,
    UNEXPLAINED,
    ItemPart,
    ReproducedItem,
    ThesisItem,
    compared,
    row,
)

from .conftest import RECT, solved

DOCS = Path(__file__).parents[2] / "docs"

# Found by derivation, some by computer algebra, before any of this was written; 3.26 when it was.
MISPRINTS = {
    "Eq. 2.1", "Eq. 2.12", "Eq. 2.13", "Eq. 2.14", "Eq. 2.15", "Eq. 2.16", "Eq. 2.17", "Eq. 2.20",
    "Eq. 2.22", "Eq. 3.26", "Eq. 3.33", "Eq. 3.34", "Eq. 3.53", "Eq. 6.3", "Eq. B.5",
    "Eq. B.12", "Eq. B.14", "Eq. B.15", "Eq. B.16", "Eq. B.18", "Eq. B.19", "Eq. B.26", "Eq. B.39", "Eq. B.42",
    "Eq. B.48", "Eq. B.49", "Eq. C.2", "Eq. C.3", "Eq. C.5", "Table 3.1", "Table 3.2", "Table 5.1",
}  # fmt: skip
DIFFERENCES = {
    "Eq. 2.25", "Eq. 3.35", "Eq. 3.49", "Eq. 3.54", "Eq. C.1", "Eq. C.4", "Figure 5.6", "Figure 6.5", "Figure 6.8",
    "Figure 6.9", "Figure 6.10", "Figure 6.11", "Figure 6.12", "Figure 7.2", "Table 4.1", "Table C.1", "Table D.1",
    "Claim 2.4.1a", "Claim 4.2.2a", "Claim 5.1.3a", "Claim 6.1.2a", "Claim 6.1.2b", "Claim 7.1.1a", "Claim 7.1.1b",
    "Claim 7.1.2b",
}  # fmt: skip
# Words only: slips that no number of the item itself shows.
IN_WORDS = {"Eq. 2.10", "Eq. 2.24"}


def of(rows, word):
    return {row.name() for row in rows if row.verdict.word == word}


def test_nothing_is_unexplained(rows):
    assert not [(row.name(), row.verdict.why) for row in rows if row.verdict.word == UNEXPLAINED]


def test_the_known_misprints_and_differences_and_no_others_are_found(rows):
    """Every misprint has its words, and every erratum its verdict."""
    assert of(rows, MISPRINT) == MISPRINTS
    assert of(rows, DIFFERS) == DIFFERENCES
    said = {row.name() for row in rows if row.item.erratum}
    assert said >= MISPRINTS
    assert said - MISPRINTS - DIFFERENCES == IN_WORDS


def test_what_is_judged_has_both_numbers(rows):
    for found in rows:
        if found.verdict.word not in (LOST, NOT_COVERED):
            assert found.parts
            assert any(part.printed is not None for part in found.parts), found.name()
        assert bool(compared(found.parts)) or found.verdict.word not in JUDGED, found.name()


def test_the_page_in_the_documents_is_what_the_command_writes(rows):
    assert (DOCS / "thesis.md").read_text("utf-8") == thesis.markdown(rows), "run `make docs`"


def test_the_first_screen_counts_what_is_confirmed_and_what_is_only_transcribed(rows):
    """Before the first table, on the page and in Markdown: by a count of the rows themselves."""
    words = Counter(row.verdict.word for row in rows)
    judged = [row for row in rows if row.verdict.word in JUDGED]
    said = [
        f"Of {len(rows)} items {len(judged)} are compared with", f"{words['agrees']} agree, {words[MISPRINT]} are",
        f"{words[DIFFERS]} differ", f"Transcribed only: {words[TRANSCRIBED]}; not covered: {words[NOT_COVERED]}",
    ]  # fmt: skip
    for first in (thesis.markdown(rows).partition("|")[0], thesis.html(rows).partition("<table")[0]):
        assert all(text in first for text in said)


def test_numbers_of_the_errata_come_out(rows):
    """Numbers that were worked out elsewhere: by hand, by 60 digits, by other programs' finite elements."""
    parts = {(r.name(), p.name): p for r in rows for p in r.parts}
    assert parts["Figure 6.9", "displacement at 100 kPa, film 0.1 mm"].ours == pytest.approx(6.6e-6, rel=0.02)
    assert parts["Eq. 2.25", "1/(2 pi R C), R of both tracks"].ours == pytest.approx(256e3, rel=2e-3)
    at = parts["Eq. 2.25", "where R and |X| of the line are alike"]  # coth is real there: twice its argument is pi
    assert at.ours == pytest.approx(math.pi**2 / 2 * parts["Eq. 2.25", "1/(2 pi R C), R of both tracks"].ours, rel=1e-9)
    assert at.printed == pytest.approx(at.ours * 6 / math.pi**2, rel=1e-3)  # of a third of R
    assert parts["Eq. 3.35", "of the exact cell"].ours == pytest.approx(159.65204e-12 / 2, rel=5e-4, abs=0)
    assert parts["Eq. 3.35", "of the exact cell"].off() == pytest.approx(-0.252, abs=5e-4)
    assert parts["Eq. 3.49", "of the exact cell"].ours == pytest.approx(0.812343e-12, rel=5e-4, abs=0)
    assert parts["Figure 6.5", "displacement at 100 kPa, film 0.1 mm"].ours == pytest.approx(33.12e-6, rel=0.01, abs=0)
    rise = parts["Figure 6.12", "(a) rise at 100 kPa, 2 mm by 20 mm"].ours
    assert rise == pytest.approx(52.5e-12 * 0.02, rel=0.011, abs=0)


@pytest.mark.nightly
def test_the_stored_curve_of_the_rectangular_cell_is_that_of_the_solver(monkeypatch):
    monkeypatch.setattr(press.compressed, "answer", solved)
    found = press._pressed("rect", parameters={"dielectric_mm": 0.1})
    for name in ("displacement_um", "lower_f_per_m2", "upper_f_per_m2"):
        assert getattr(found, name) == pytest.approx(getattr(RECT, name), rel=1e-6, abs=0)


def test_a_confined_plate_gives_way_by_its_bulk(rows):
    """E (1 - nu) / ((1 + nu) (1 - 2 nu)) of both materials, 0.6 mm of each."""
    nu = 0.4999
    stiffness = [e * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) for e in (6e6, 22e6)]
    expected = sum(1e5 / m * 0.6e-3 for m in stiffness)
    found = next(r for r in rows if r.name() == "Figure 6.11").parts[0].ours
    assert found == pytest.approx(expected, rel=1e-3, abs=0)


def test_a_missing_solver_leaves_uncovered_and_any_other_refusal_is_unexplained(monkeypatch):
    from sensorgen.core.errors import MissingValue, OutOfRange
    from sensorgen.verification.thesis.checks import triangles

    item = ThesisItem(number="3.35", says="x", check="triangles.whole", because="y", off={"x": 1.0}, within=0.1)
    for error, expected in ((MissingValue("no solver"), NOT_COVERED), (OutOfRange("strain"), UNEXPLAINED)):

        def refuse(_, error=error):
            raise error

        monkeypatch.setattr(triangles, "exact_f_per_m2", refuse)
        found = row("3", "equation", item).verdict
        assert found.word == expected
        assert str(error) in found.text()


def test_json_holds_every_value(rows):
    text = json.dumps(thesis.plain(rows), allow_nan=False)
    data = json.loads(text)
    assert len(data) == len(rows)
    by = {(d["kind"], d["number"]): d for d in data}
    z = by["equation", "B.53"]["parts"][0]
    assert z["printed"] == pytest.approx(z["ours"])
    part = ItemPart("x", "m", [1.0, 2.0], [1.0, float("nan")])
    nowhere = [ReproducedItem("2", "equation", rows[0].item, (part,), rows[0].verdict)]
    assert thesis.plain(nowhere)[0]["parts"][0]["printed"] == [1.0, None]
    pair = by["equation", "2.20"]["parts"][0]
    assert pair["printed"][1] == 0
    assert pair["ours"][0] == pytest.approx(115.71, rel=1e-4)
    assert Counter(d["verdict"] for d in data) == Counter(r.verdict.word for r in rows)
