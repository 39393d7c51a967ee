"""Plain data against records: messages in plain English, whatever is wrong."""

import itertools
import re
from pathlib import Path

import pytest

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.records import checked
from sensorgen.design import materials, packs, printer
from sensorgen.design.design import make
from sensorgen.measure import accuracy
from sensorgen.measure.log import bench
from sensorgen.workflows.batch.plan import BatchPlan
from sensorgen.workflows.optimise.target import Target

TEMPLATES = Path(packs.__file__).parent / "templates"
OF_PYDANTIC = re.compile(
    r"[Ii]nput should|valid (number|string|dictionary|list|integer|tuple|boolean)|function-after|literal\[|dict\[|"
    r"list\[|tuple\[|union\[|NoneType|validation error|pydantic|Range\b|Near\b"
)
WRONG = [None, True, 5, -1e9, float("inf"), float("nan"), "x", "5", [], [1], ["x", None], {}, {"a": 1}, [[1]], [{}]]
TARGET = {"design": "a", "parameters": {"x": [1]}, "objectives": {"capacitance_pf": "maximise"}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objectives": {"capacitance_pf": {"near": "x"}}}, "objectives.capacitance_pf.near is 'x'; expected a number"),
        ({"objectives": {"capacitance_pf": {"neer": 4}}}, "unknown key of objectives.capacitance_pf 'neer'; did you "
         "mean 'near'? Known: near"),
        ({"objectives": {"capacitance_pf": {}}}, "objectives.capacitance_pf.near is missing"),
        ({"objectives": {"capacitance_pf": "best"}}, "objectives.capacitance_pf is 'best'; expected 'minimise' or "
         "'maximise', or a mapping with near"),
        ({"parameters": {"x": {"from": "a", "to": 3}}}, "parameters.x.from is 'a'; expected a number"),
        ({"parameters": {"x": [1, [2]]}}, "parameters.x.1 is [2]; expected a number, or text"),
        ({"parameters": {"x": {"from": 3, "to": 1}}}, "parameters.x: from 3 to 1 is empty; expected numbers that rise"),
        ({"load": {"pressures_kpa": [1, "a"]}}, "load.pressures_kpa.1 is 'a'; expected a number"),
        ({"slicer": 5}, "slicer is 5; expected '', 'prusa' or 'cura'"),
    ],
)  # fmt: skip
def test_alternatives_for_one_value(changes, message):
    with pytest.raises(BadInput) as caught:
        checked(Target, TARGET | changes)
    assert str(caught.value) == message


def leaves(data, place=()):
    """Places of all values, those of mappings and lists too."""
    yield place
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from leaves(value, (*place, key))


def put(data, place, value):
    if not place:
        return value
    changed = data.copy()
    changed[place[0]] = put(data[place[0]], place[1:], value)
    return changed


def as_text(data):
    import yaml

    return yaml.safe_dump(data)


READERS = {
    "material": lambda data: materials.parse("m", as_text(data)),
    "printer": lambda data: printer.load_printer("p", as_text(data)),
    "quality": lambda data: printer.load_quality("q", as_text(data)),
    "instrument": lambda data: accuracy.parse(as_text(data), "i.yaml"),
    "target": lambda data: checked(Target, data),
    "plan": lambda data: checked(BatchPlan, data),
    "design": lambda data: make(data),
}
PLAN = {"iteration": 1, "printer": "diabase-h5", "designs": [{"design": {"shape": "tri"}, "copies": 2}]}


@pytest.mark.parametrize(("what", "every"), [
    *((what, 4 if what == "material" else 2) for what in READERS),  # of many values of few kinds
    *(pytest.param(what, 1, marks=pytest.mark.nightly) for what in READERS),
])  # fmt: skip
def test_no_message_is_in_the_words_of_the_library(what, every):
    """Every value of every template in turn is something else, a key more or a key less."""
    text = "" if what == "plan" else (TEMPLATES / f"{what}.yaml").read_text("utf-8").replace("NAME", "x")
    whole = yamlfile.parse(text, what) if text else PLAN
    refused = 0
    for place, wrong in itertools.product([*leaves(whole)][::every], WRONG):
        try:
            READERS[what](put(whole, place, wrong))
        except SensorgenError as error:
            refused += 1
            message = str(error)
            assert not OF_PYDANTIC.search(message), (place, wrong, message)
            assert "\n" not in message
    assert refused > 30


def test_damaged_facts_of_a_recording():
    wrong = {"{": "all of it is '{'; expected JSON", "[]": "expected a mapping", '{"lockins": 5}': "lockins is 5"}
    for text, message in wrong.items():
        with pytest.raises(BadInput, match="the facts of a recording are damaged: ") as caught:
            bench.from_json(text)
        assert message in str(caught.value)
        assert not OF_PYDANTIC.search(str(caught.value))


@pytest.mark.parametrize(
    ("message", "where", "expected"),
    [
        ("bad.yaml: holds nothing", "bad.yaml", "bad.yaml: holds nothing"),
        ("zig.py, line 3: no colon", "zig.py", "zig.py, line 3: no colon"),
        ("cannot read 'a.yaml': No such file", "a.yaml", "cannot read 'a.yaml': No such file"),
        ("tool 3 is there twice", "t", "t: tool 3 is there twice"),
        ("designs.12: no shape", "designs.1", "designs.1: designs.12: no shape"),
    ],
)
def test_a_message_names_its_file_once(message, where, expected):
    """A file named t was left out where the message began with a t."""
    assert str(BadInput(message).within(where)) == expected
