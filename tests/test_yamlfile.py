"""YAML: plain values without surprises, and nothing else."""

import math

import pytest

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput

PLAIN = {
    "1": 1, "-3": -3, "+3": 3, "0": 0, "1.5": 1.5, "1.": 1.0, ".5": 0.5, "-.5": -0.5, "1e3": 1000.0, "1e-3": 0.001,
    "6.0e6": 6e6, "2E+2": 200.0, ".inf": math.inf, "-.inf": -math.inf, "true": True, "False": False, "null": None,
    "~": None, "": None, "yes": "yes", "no": "no", "on": "on", "y": "y", "010": "010", "0x10": "0x10", "0o7": "0o7",
    "1_000": "1_000", "1:30": "1:30", "2024-01-01": "2024-01-01", "00.5": "00.5", ".": ".", "+": "+", "e3": "e3",
    "0.2mm": "0.2mm", "'1'": "1", '"no"': "no", "1e999": math.inf, "1e99999": "1e99999", "=": "=", "<<": "<<",
    "9" * 18: int("9" * 18), "1" + "0" * 40: 1e40, "1" + "0" * 400: math.inf,
}  # fmt: skip


@pytest.mark.parametrize(("text", "value"), PLAIN.items(), ids=[text[:40] or "nothing" for text in PLAIN])
def test_plain_values(text, value):
    found = yamlfile.parse(f"a: {text}", "f")["a"]
    assert (type(found), found) == (type(value), value)


def test_depth_at_its_limit():
    deepest = "{a: " * (yamlfile.MAX_DEPTH - 1) + "1" + "}" * (yamlfile.MAX_DEPTH - 1)
    assert yamlfile.parse(f"a: {deepest}", "f")
    with pytest.raises(BadInput, match="f: line 1: nested deeper than 20 levels"):
        yamlfile.parse(f"a: {{a: {deepest}}}", "f")


def test_size_at_its_limit(tmp_path):
    path = tmp_path / "f.yaml"
    path.write_bytes(b"a: 1\n#" + b"x" * (yamlfile.MAX_BYTES - 6))
    assert yamlfile.read(path) == {"a": 1}
    path.write_bytes(path.read_bytes() + b"x")
    with pytest.raises(BadInput, match="100001 bytes; expected at most 100000"):
        yamlfile.read(path)


@pytest.mark.parametrize("tag", ["!!str", "!", "!own", "!!python/name:os.system", "!<x>"])
@pytest.mark.parametrize("text", ["a: {} 1", "{} {{a: 1}}", "a: {} [1]"])
def test_tags_are_refused_wherever_they_stand(tag, text):
    with pytest.raises(BadInput, match=r"f: line 1: tags \(!name\) are not taken"):
        yamlfile.parse(text.format(tag), "f")


def test_not_a_number_and_an_anchor_that_nobody_uses():
    assert math.isnan(yamlfile.parse("a: &x .nan", "f")["a"])


def test_a_path_with_a_zero_byte(tmp_path):
    with pytest.raises(BadInput, match="embedded null byte"):
        yamlfile.read(tmp_path / "a\0b.yaml")
