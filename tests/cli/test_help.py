"""Help, lists, schema and completion: what a user can find out without the manual."""

import dataclasses
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import jsonschema
import pytest
import yaml
from click.shell_completion import ShellComplete
from click.testing import CliRunner

import in_process
from sensorgen import models
from sensorgen.cli import COMMANDS, cli
from sensorgen.cli.commands import command as command_of
from sensorgen.cli.commands import flag_of as option_of
from sensorgen.cli.designs import of_design
from sensorgen.core import lazy as registry
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design, materials, printer, shapes
from sensorgen.design.design import Design

DESIGNS = Path(__file__).parents[2] / "designs"
ON_DESIGNS = ("build", "check", "draw", "predict", "slice")


def options_of_help(text):
    return set(re.findall(r"--[a-z0-9-]+", text.partition("Options:")[2]))


@pytest.mark.parametrize("words", [[], *([c] for c in COMMANDS)], ids=str)
def test_help_of_every_command(run, words):
    said = run(*words, "--help").clean
    assert max(map(len, said.out.splitlines())) <= 80
    assert "..." not in said.out.partition("Commands:")[2]  # no help is cut short


def test_a_command_called_alone_has_both_names_of_its_help():
    """Click keeps the option that a first call made: a call without the command line's group once took -h away."""
    for alone in (command_of("alone")(lambda: 0), of_design("alone")(lambda _: 0)):
        assert "-h, --help" in CliRunner().invoke(alone, ["--help"]).output


@pytest.mark.parametrize("shape", registry.names(shapes))
def test_help_of_every_shape_names_every_parameter(run, shape):
    said = run("check", shape, "-h").clean
    fields = dataclasses.fields(registry.load(shapes, shape).Params)
    assert {option_of(f.name) for f in fields} <= options_of_help(said.out)
    assert max(map(len, said.out.partition("Options:")[2].splitlines())) <= 80
    for field in fields:
        assert field.metadata["help"].split()[0] in said.out


def test_the_picture_of_a_shape_is_not_wrapped(run):
    picture = "compared with.\n\n      ================  top electrode\n      ................  dielectric\n"
    assert picture in run("build", "reference", "-h").out
    assert "(e: conductor, x: dielectric, blank: air):\n\n      eeee" in run("build", "tri", "-h").out


def test_every_option_has_help_and_every_command_its_line(run):
    context = click.Context(cli)
    for name in COMMANDS:
        command = cli.get_command(context, name)
        assert command.get_short_help_str(100)
        of_shapes = registry.names(shapes) if name in ON_DESIGNS else ()
        inner = [command.get_command(context, shape) for shape in of_shapes] or [command]
        for each in inner:
            assert all(p.help for p in each.params if p.param_type_name == "option"), each.name


def test_defaults_in_the_help_are_those_of_the_design(run):
    said = " ".join(run("build", "tri", "-h").out.split())
    for key in ("printer", "quality", "orientation"):
        assert f"{Design.model_fields[key].default} if not given" in said


def test_bare_commands_show_their_help(run):
    for words in ([], ["build"]):
        said = run(*words)
        assert said.code == 2
        assert said.err.startswith("Usage: sensorgen")


def test_version(run):
    assert run("--version").out.startswith("sensorgen, version ")


def test_python_dash_m(tmp_path):
    words = [sys.executable, "-m", "sensorgen", "--version"]
    done = subprocess.run(words, capture_output=True, encoding="utf-8", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_list_materials_shows_every_value_with_its_source(run):
    said = run("list", "materials")
    assert max(map(len, said.out.splitlines())) <= 80
    text = said.words
    for name in materials.names():
        material = materials.load(name)
        for group in (material.properties, material.print):
            for quantity, values in group.items():
                for value in values:
                    assert f"{quantity}: {value.value:.7g} [{value.source}]" in text
    flagged = re.findall(r"resistivity_ohm_m: 0\.76923\d+ \[thesis-3\.2\] IMPLAUSIBLE, never a default", text)
    assert len(flagged) == 1


def test_every_source_is_explained(run):
    said = run("list", "sources", "--json").json
    assert {source for name in materials.names() for source in materials.load(name).sources()} <= set(said)
    assert all(entry["about"] for entry in said.values())


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("shapes", registry.names(shapes)),
        ("materials", materials.names()),
        ("printers", printer.printer_names()),
        ("qualities", printer.quality_names()),
        ("models", list(models.names())),
    ],
)
def test_lists_are_complete(run, kind, names):
    said = run("list", kind).clean
    assert [line.split()[0] for line in said.out.splitlines() if line[0] != " "] == names
    data = run("list", kind, "--json").json
    assert list(data) == names
    assert all(entry["about"] for entry in data.values())


@pytest.fixture(scope="module")
def schema(tmp_path_factory):
    return json.loads(in_process.run(tmp_path_factory.mktemp("schema"), "schema")[1])


def test_the_schema_is_one_and_takes_the_designs(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    for path in DESIGNS.rglob("*.yaml"):
        jsonschema.Draft202012Validator(schema).validate(yaml.safe_load(path.read_text("utf-8")))


FAULTS = [
    "{}", "{shape: trj}", "{shape: tri, colour: red}", "{shape: tri, parameters: {perod_mm: 2}}",
    "{shape: tri, parameters: {period_mm: -2}}", "{shape: tri, parameters: {period_mm: two}}",
    "{shape: tri, parameters: {along: xy}}", "{shape: rect, parameters: {period_mm: 2}}",
    "{shape: tri, materials: {flm: x60}}", "{shape: tri, materials: {film: X 60}}",
    "{shape: tri, infill: {x60: {percent: 0}}}", "{shape: tri, infill: {x60: {pattern: wavy}}}",
    "{shape: tri, tools: {x60: four}}", "{shape: tri, orientation: up}", "{shape: tri, shrinkage: 1}",
    "{shape: tri, nozzle_mm: 0}", "{shape: tri, waivers: [{rule: 5-width}]}", "{shape: tri, name: ''}",
    "{shape: tri, name: ../x}",
]  # fmt: skip


@pytest.mark.parametrize("text", FAULTS)
def test_schema_refuses_what_the_design_refuses(schema, text):
    with pytest.raises(SensorgenError):
        design.make(yaml.safe_load(text))
    assert not jsonschema.Draft202012Validator(schema).is_valid(yaml.safe_load(text))


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_script(run, shell):
    said = run("completion", shell).ok
    assert "_SENSORGEN_COMPLETE" in said.out


COMPLETE = """
eval "$(sensorgen completion bash)"
compopt() { :; }
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
_sensorgen_completion sensorgen
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(not shutil.which("bash"), reason="bash is not installed")
def test_bash_completes(tmp_path):
    (tmp_path / "sensorgen").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sensorgen "$@"\n')
    (tmp_path / "sensorgen").chmod(0o755)
    done = subprocess.run(
        ["bash", "-c", COMPLETE, "complete", "sensorgen", "build", "tri", "--diel"],
        capture_output=True, encoding="utf-8", cwd=tmp_path, env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
    )  # fmt: skip
    assert (done.stderr, done.stdout.split()) == ("", ["--dielectric"])


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("bu", {"build"}), ("build t", {"tri"}), ("build rect --air", {"--air-width"}),
        ("build d.yaml --air", {"--air-width"}), ("build tri --along ", {"x", "y"}), ("build no.yaml --air", set()),
        ("build trj --air", set()), ("list m", {"materials", "models"}), ("build tri --printer dia", {"diabase-h5"}),
        ("build tri --quality ext", {"extrafine"}), ("build tri --support bvo", {"bvoh"}),
    ],
)  # fmt: skip
def test_the_shell_is_offered_what_fits(typed, offered, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("d.yaml").write_text("shape: rect", "utf-8")
    *words, begun = typed.split(" ")
    items = ShellComplete(cli, {}, "sensorgen", "_SENSORGEN_COMPLETE").get_completions(words, begun)
    assert {item.value for item in items if item.type == "plain"} == offered
