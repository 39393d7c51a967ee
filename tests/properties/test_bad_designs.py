"""A thousand bad designs and bad command lines: an error of ours or a design, and never a traceback."""

import copy
import subprocess
import sys
from contextlib import nullcontext

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from no_numbers import roughly_at_rest
from sensorgen import cli
from sensorgen.core import lazy as registry
from sensorgen.core import yamlfile
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design, shapes


def many(n):
    return settings(
        max_examples=n, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )


def counts(few, every):
    """So many examples each time, and so many nightly."""
    return pytest.mark.parametrize("count", [few, pytest.param(every, marks=pytest.mark.nightly)])


WORDS = st.sampled_from(
    [
        "tri", "rect", "reference", "x60", "etpu", "air", "bvoh", "x60@thesis-4.1", "x60@", "@", "etpu@thesis-c.1-top",
        "x", "y", "xy", "fine", "extrafine", "prusa-xl5", "grid", "upside-down", "5-width", "none", "a.yaml", "/", "..",
        "period_mm", "dielectric_mm", "along", "percent", "pattern", "film", "support", "rule", "reason", "body",
    ]
)  # fmt: skip
NUMBERS = st.floats() | st.integers() | st.integers(min_value=-(10**6000), max_value=10**6000) | st.booleans()
SCALARS = st.none() | NUMBERS | st.text(max_size=8) | WORDS
KEYS = st.sampled_from(list(design.Design.model_fields)) | WORDS | st.text(max_size=8)
NESTED = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS | SCALARS, inner, max_size=4),
    max_leaves=12,
)
VALID = {
    "name": "whole",
    "shape": "tri",
    "parameters": {"period_mm": 2.5, "along": "y", "dielectric_mm": 0.1},
    "materials": {"film": "x60@thesis-4.1", "support": "bvoh"},
    "printer": "prusa-xl5",
    "quality": "extrafine",
    "nozzle_mm": 0.25,
    "tools": {"x60": 3},
    "infill": {"x60": {"percent": 80, "pattern": "grid"}},
    "orientation": "upside-down",
    "shrinkage": 0.02,
    "waivers": [{"rule": "5-width", "body": "film", "reason": "seen on the bench"}],
}


def assert_says_where(error):
    assert str(error).startswith("some.yaml: ")
    assert len(str(error)) < 1_000


def makes_sense_or_says_why(data):
    try:
        made = design.make(data, "some.yaml")
    except SensorgenError as error:
        assert_says_where(error)
        return
    assert design.make(made.model_dump(mode="json")).id() == made.id()
    assert made.name


def places(data, path=()):
    """Paths to everything inside plain data."""
    yield path
    inside = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in inside:
        yield from places(value, (*path, key))


@st.composite
def mutants(draw):
    """The valid design with one to three of its values or keys exchanged, dropped or added."""
    data = copy.deepcopy(VALID)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from([p for p in places(data) if p]))
        holder = data
        for key in path[:-1]:
            holder = holder[key]
        match draw(st.sampled_from(["value", "key", "drop"])):
            case "value":
                holder[path[-1]] = draw(NESTED)
            case "key" if isinstance(holder, dict):
                holder[draw(KEYS)] = draw(NESTED)
            case _:
                del holder[path[-1]]
        if not data:
            break
    return data


def test_the_valid_design_is_valid():
    assert design.make(VALID).name == "whole"


@counts(40, 400)
def test_random_data(count):
    many(count)(given(st.dictionaries(KEYS, NESTED, max_size=5) | NESTED)(makes_sense_or_says_why))()


@counts(40, 600)
def test_random_changes_of_a_valid_design(count):
    many(count)(given(mutants())(makes_sense_or_says_why))()


PIECES = st.sampled_from(
    [
        "shape", "tri", ":", ": ", "\n", " ", "  ", "- ", "{", "}", "[", "]", ",", "'", '"', "#", "&a ", "*a", "!!int ",
        "!", "|", ">", "?", "? ", "%", "@", "`", "---", "...", "\t", "\0", "\x85", "\ufeff", "\\", '"\\x', "<<", "1e3",
        "0o7", "~", "null", "\ud800", "\U0001f600", "\r", "2024-01-01", ".inf", "parameters:\n  ", "period_mm: ",
    ]
)  # fmt: skip


@counts(60, 600)
def test_random_yaml(count):
    many(count)(given(st.lists(PIECES, max_size=25).map("".join) | st.text(max_size=60))(is_read_or_refused))()


@example('"\\UFFFFFFFF": 1')
@example("!!timestamp x")
@example("? [a]\n: 1")
@example("[" * 100_000)
def is_read_or_refused(text):
    try:
        data = yamlfile.parse(text, "some.yaml")
    except SensorgenError as error:
        assert_says_where(error)
        return
    makes_sense_or_says_why(data)


OPTIONS = sorted(
    {
        opt
        for shape in registry.names(shapes)
        for p in cli.cli.get_command(None, "check").get_command(None, shape).params
        for opt in p.opts
    }
)
VALUES = (
    st.sampled_from(
        [
            "0", "1", "-1", "0.1", "2mm", "1e400", "nan", "50x20", "1x", "x", "y", "xy", "x60=2", "x60=", "=",
            "etpu=x60", "film=x60", "electrode=etpu", "x60=80", "80%", "bvoh", "none", "a.b.c.d=1", "materials=1",
            "tools.x60=1", "infill.x60.percent=80", "waivers=1", "parameters.period_mm=3um", "name=a", "shape=rect",
            "prusa-xl5", "extrafine", "upside-down", "no.yaml", "/", "..", "²", "x60=²",
        ]
    )
    | st.text(st.characters(exclude_characters="\0"), max_size=6)
)  # fmt: skip


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """The command line in this process: its exit code and stderr; anything but an exit is a fault."""
    monkeypatch.chdir(tmp_path)

    def run(words):
        monkeypatch.setattr(sys, "argv", ["sensorgen", *words])
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            cli.main()
        return left.value.code, capsys.readouterr().err

    return run


@counts(8, 400)
def test_random_command_lines(count, command):
    """The few are predicted at rest and by closed forms: more takes seconds for each design that is valid."""

    @many(count)
    @given(
        shape=st.sampled_from(["tri", "rect", "reference", "trj", "no.yaml"]),
        words=st.lists(st.tuples(st.sampled_from(OPTIONS) | st.text(min_size=1, max_size=5), VALUES), max_size=4),
    )
    def is_answered_or_refused(shape, words):
        code, err = command(["predict", shape, *(word for pair in words for word in pair)])
        assert code in (0, 1, 2)
        if code and not err.startswith("Usage"):
            assert err.startswith("sensorgen: ")
            assert err.count("\n") == 1

    with roughly_at_rest() if count < 100 else nullcontext():
        is_answered_or_refused()


def test_some_in_processes_of_their_own(tmp_path):
    for text in ("{", "shape: trj"):
        (tmp_path / "bad.yaml").write_text(text)
        done = subprocess.run(
            [sys.executable, "-m", "sensorgen", "build", "bad.yaml"],
            capture_output=True,
            encoding="utf-8",
            cwd=tmp_path,
        )
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith("sensorgen: bad.yaml: ")
        assert done.stderr.count("\n") == 1
        assert [p.name for p in tmp_path.iterdir()] == ["bad.yaml"]
