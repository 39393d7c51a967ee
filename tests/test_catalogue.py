"""What there is to choose from."""

import json

import pytest

from sensorgen.cli import catalogue
from sensorgen.design import design


@pytest.mark.parametrize("kind", ["shapes", "materials", "printers", "qualities", "models", "sources"])
def test_every_entry_says_what_it_is(kind):
    found = getattr(catalogue, kind)()
    assert found.entries
    assert all(entry.about.strip() and "\n" not in entry.about for entry in found.entries.values())
    assert set(json.loads(found.to_json())) == set(found.entries)


@pytest.mark.parametrize("shape", catalogue.shapes().entries)
def test_every_parameter_is_listed_with_its_range_and_default(shape):
    lines = catalogue.shapes().entries[shape].values
    for line, (name, field) in zip(lines, design.fields(shape).items(), strict=True):
        assert line.startswith(f"{name}: {field.metadata['help']}")
        default = f"{field.default:g}" if isinstance(field.default, float) else field.default
        assert line.endswith(f"default {default})")


def test_the_schema_has_every_key_and_every_parameter():
    made = catalogue.schema()
    assert set(made["properties"]) == set(design.Design.model_fields)
    per_shape = {rule["if"]["properties"]["shape"]["const"]: rule["then"] for rule in made["allOf"]}
    for shape in catalogue.shapes().entries:
        assert set(per_shape[shape]["properties"]["parameters"]["properties"]) == set(design.fields(shape))
