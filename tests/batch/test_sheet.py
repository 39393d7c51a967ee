"""The page of labels: every code read back by another program's eye."""

import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import make
from sensorgen.design.specimen_name import named, parse
from sensorgen.workflows.batch import labelling
from sensorgen.workflows.batch.plan import PrintPiece, load, pieces

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "film-study.yaml"
DOTS = 4  # of the picture, per square of a code


def drawn(svg):
    """A code's picture from its SVG path, as an 8-bit image: strokes of one unit along rows."""
    root = ET.fromstring(svg)
    side = round(float(root.get("viewBox").split()[2]))
    path = next(e for e in root.iter() if e.tag.endswith("path"))
    image = np.full((side, side), 255, np.uint8)
    x = y = 0.0
    for kind, numbers in re.findall(r"([Mmh])([^Mmh]*)", path.get("d")):
        values = [float(v) for v in re.findall(r"-?[\d.]+", numbers)]
        if kind == "h":
            image[int(y), int(x) : int(x + values[0])] = 0
            x += values[0]
        else:
            x, y = (values[0], values[1]) if kind == "M" else (x + values[0], y + values[1])
    return np.kron(image, np.ones((DOTS, DOTS), np.uint8))


def codes(page):
    zxing = pytest.importorskip("zxingcpp")
    for svg in re.findall(r"<svg.*?</svg>", page, re.DOTALL):
        (found,) = zxing.read_barcodes(drawn(svg))
        yield found.text


def labels():
    return [labelling.Label(p, "film-study", k) for k, p in enumerate(pieces(load(EXAMPLE), EXAMPLE.parent), 1)]


def test_every_code_reads_as_its_label_says():
    made = labels()
    read = list(codes(labelling.page(made, "film-study")))
    assert len(read) == 20
    for label, text in zip(made, read, strict=True):
        name, batch, design_id = text.split("\n")
        assert parse(name).name == label.piece.name
        assert (batch, design_id) == ("film-study", label.piece.design_id)


def test_the_page_needs_nothing_else_and_holds_text_as_text():
    design = make({"shape": "tri"}).model_copy(update={"name": "<b>&"})
    label = labelling.Label(PrintPiece(named(design, 26, 1), design, "<i>"), "<i>", 1, "<i>")
    page = labelling.page([label], '<script>alert("x")</script>')
    assert "<script" not in page
    assert "<i>" not in page
    assert "&lt;b&gt;&amp;" in page
    assert not re.findall(r"(?:src|href)\s*=", page)
    assert set(re.findall(r"https?://[^\"' ]+", page)) <= {"http://www.w3.org/2000/svg"}


def test_without_the_library_of_codes_it_is_said_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "segno", None)
    with pytest.raises(MissingValue, match=r"pip install segno, or set 'labels: \{sheet: false\}'"):
        labelling.page(labels(), "a")
