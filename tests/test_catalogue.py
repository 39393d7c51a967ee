"""What there is to choose from."""

import json

import pytest

from sensorgen.cli import catalogue
from sensorgen.design import design, printer


@pytest.mark.parametrize("kind", ["shapes", "materials", "printers", "qualities", "models", "sources"])
def test_every_entry_says_what_it_is(kind):
    entries = getattr(catalogue, kind)()
    assert entries
    assert all(entry["about"].strip() and "\n" not in entry["about"] for entry in entries.values())
    json.dumps(entries, allow_nan=False)


@pytest.mark.parametrize("shape", catalogue.shapes())
def test_every_parameter_is_listed_with_its_range_and_default(shape):
    lines = catalogue.shapes()[shape]["values"]
    for line, (name, field) in zip(lines, design.fields(shape).items(), strict=True):
        assert line.startswith(f"{name}: {field.metadata['help']}")
        default = f"{field.default:g}" if isinstance(field.default, float) else field.default
        assert line.endswith(f"default {default})")


def test_printers_show_their_beds():
    for name, entry in catalogue.printers().items():
        x, y = printer.load_printer(name).bed_mm
        assert f"bed {x:g} x {y:g} mm" in entry["values"][0]


def test_the_schema_has_every_key_and_every_parameter():
    made = catalogue.schema()
    assert set(made["properties"]) == set(design.Design.model_fields)
    per_shape = {rule["if"]["properties"]["shape"]["const"]: rule["then"] for rule in made["allOf"]}
    for shape in catalogue.shapes():
        assert set(per_shape[shape]["properties"]["parameters"]["properties"]) == set(design.fields(shape))
