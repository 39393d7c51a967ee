"""Names to things, and the nearest name to a wrong one."""

import pytest

from sensorgen import models
from sensorgen.core import lazy as registry
from sensorgen.core.errors import UnknownName, Unprintable
from sensorgen.core.findings import Finding
from sensorgen.design import shapes


@pytest.mark.parametrize("name", ["__init__", "../errors", "tri.py", "", "os"])
def test_what_is_not_listed_does_not_load(name):
    with pytest.raises(UnknownName, match="unknown shape"):
        registry.load(shapes, name)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("trj", "unknown shape 'trj'; did you mean 'tri'? Known: rect, tri"),
        ("RECT", "unknown shape 'RECT'; did you mean 'rect'? Known: rect, tri"),
        ("sphere", "unknown shape 'sphere'. Known: rect, tri"),
    ],
)
def test_the_nearest_name_is_offered(given, said):
    assert str(UnknownName("shape", given, {"tri", "rect"})) == said
    assert len(str(UnknownName("shape", given * 100_000, ["tri"]))) < 200


def test_unprintable_names_its_first_finding_that_stands():
    findings = [
        Finding("1-short", "error", "a", "waived", "b", waiver="on purpose"),
        Finding("8-bed", "error", "a", "too large", "b"),
    ]
    refused = Unprintable(findings, findings[1:])
    assert str(refused).startswith("8-bed, too large; nothing was written")
    assert refused.findings == findings[::-1]


def test_modules_are_found_by_what_they_define(tmp_path):
    (tmp_path / "one.py").write_text("def speak(word):\n    def answer():\n        pass\n")
    (tmp_path / "two.py").write_text("# def answer(\nraise ImportError\n\n\ndef answer(\n    word): ...\n")
    (tmp_path / "_three.py").write_text("def answer(): ...\n")
    package = type("Package", (), {"__path__": [str(tmp_path)]})
    assert registry.stating(package, "def answer(") == ("two",)
    assert registry.stating(package, "def answ(") == ()
    assert tuple(models.capacitance_models()) == ("columns", "curved", "fem2d", "fem3d", "overlap", "prisms")
