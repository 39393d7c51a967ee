"""Lengths as typed."""

import pytest

from sensorgen.errors import BadInput
from sensorgen.units import length_mm


@pytest.mark.parametrize(
    ("text", "mm"),
    [
        ("0.2", 0.2), ("0.2mm", 0.2), (" 0.2 MM ", 0.2), ("200um", 0.2), ("200µm", 0.2), ("200μm", 0.2), ("2cm", 20.0),
        ("0.1m", 100.0), ("1e-1", 0.1), ("1e2 um", 0.1), ("-3", -3.0), ("+3", 3.0), (".5", 0.5), ("5.", 5.0),
    ],
)  # fmt: skip
def test_length(text, mm):
    assert length_mm(text) == pytest.approx(mm, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "",
        " ",
        "mm",
        "nan",
        "inf",
        "1.2.3",
        ".",
        "1,5",
        "1 inch",
        "1km",
        "0x1",
        "1e",
        "٣",
        "1_0",
        "--1",
        "1\n2",
        "1e5e5",
    ],
)
def test_no_length(text):
    with pytest.raises(BadInput, match="is not a length: write a number, with mm, um, cm or m if you like"):
        length_mm(text)
