"""The picture of a plate: every specimen where it lies, as large as it is, its name readable and inside."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from sensorgen.workflows.batch import arranged, layout

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "film-study.yaml"
SVG = "{http://www.w3.org/2000/svg}"


def text_of(found):
    return layout.svg(found.plan.name, found.pieces[0].design.machine, found.room, found.plate, found.pieces)


def drawn(found):
    return ET.fromstring(text_of(found))


def numbers(element, *keys):
    return [float(element.get(key)) for key in keys]


@pytest.mark.parametrize("printer", ["diabase-h5", "prusa-xl5"])
def test_every_specimen_is_where_it_lies(tmp_path, printer):
    plan = tmp_path / "plan.yaml"
    designs = "designs: [{shape: tri, replicates: 7}, {shape: reference, replicates: 4}]"
    plan.write_text(f"iteration: 1\nprinter: {printer}\n{designs}\n")
    found = arranged(plan)
    machine = found.pieces[0].design.machine
    boxes = [
        r for r in drawn(found).iter(f"{SVG}rect") if (r.get("stroke-width"), r.get("fill")) == (".25", r.get("fill"))
    ]
    assert len(boxes) == 11
    (x, y), (wide, deep) = machine.bed_centre_mm(), machine.bed_mm
    for box, place in zip(boxes, found.plate.values(), strict=True):
        left, top, length, width = numbers(box, "x", "y", "width", "height")
        # From the back left corner, downwards.
        assert left == pytest.approx(place.x0 - (x - wide / 2), abs=1e-3)
        assert deep - top - width == pytest.approx(place.y0 - (y - deep / 2), abs=1e-3)
        assert (length, width) == pytest.approx((place.x1 - place.x0, place.y1 - place.y0), abs=1e-3)
    assert len({box.get("fill") for box in boxes}) == 2


def test_names_fit_their_specimens():
    root = drawn(arranged(EXAMPLE))
    texts = [t for t in root.iter(f"{SVG}text") if t.get("text-anchor") and t.text != "tower"]
    assert len(texts) == 20
    for text in texts:
        assert "26 " in text.text
        assert 0.62 * float(text.get("font-size")) * len(text.text) <= 100
    listed = [t.text for t in root.iter(f"{SVG}text") if not t.get("text-anchor")]
    assert sum(line.split(":")[0].isdigit() for line in listed) == 20


def test_the_page_shows_the_plate_of_the_example():
    shown = EXAMPLE.parents[1] / "pictures" / "film-study-plate.svg"
    assert shown.read_text("utf-8") == text_of(arranged(EXAMPLE)), "run `make docs`"


def test_small_specimens_have_their_number_alone(tmp_path):
    plan = tmp_path / "plan.yaml"
    plan.write_text("iteration: 1\ndesigns: [{shape: tri, replicates: 30, parameters: {length_mm: 6, width_mm: 6}}]\n")
    texts = [t.text for t in drawn(arranged(plan)).iter(f"{SVG}text") if t.get("text-anchor") and t.text != "tower"]
    assert texts == [str(k) for k in range(1, 31)]
