"""The documents say what the program does."""

import importlib.util
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import virtual_specimen
from sensorgen.cli import COMMANDS, cli

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "docs" / "tutorial.md"]
READINGS = "re_ohm_1.1kHz,im_ohm_1.1kHz,re_ohm_99.7kHz,im_ohm_99.7kHz\n3000,-2.1e6,2997,-23435\n"
DESIGN = re.compile(r"```yaml\n# (\S+\.yaml)\n(.*?)```", re.DOTALL)


def commands():
    """Every sensorgen command of the pages that does not need the CAD kernel or write elsewhere."""
    for page in PAGES:
        for block in re.findall(r"```sh\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            for line in block.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["sensorgen"] and ">" not in words:
                    yield pytest.param(words[1:], id=" ".join(words[1:]))


def test_the_reference_is_what_the_help_texts_say():
    generate = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    assert (ROOT / "docs" / "reference.md").read_text("utf-8") == generate["reference"](), "run `make docs`"


def test_the_first_screen_of_the_readme_is_what_the_command_prints():
    generate = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    assert (ROOT / "README.md").read_text("utf-8") == generate["first_screen"](), "run `make docs`"


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_has_help_and_is_in_the_documents(name):
    assert cli.get_command(None, name).get_short_help_str()
    assert any(
        f"sensorgen {name}" in page.read_text("utf-8")
        for page in [*PAGES, ROOT / "docs" / "lab.md", ROOT / "docs" / "reference.md"]
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The cache of one who follows the pages: what a command has solved, the next one knows."""
    return tmp_path_factory.mktemp("cache")


def specimen_on_a_bench(command, folder):
    """What ``calibrate S1`` and ``invert S1`` start from: known presses in the log, readings beside it."""
    if command not in ("calibrate", "invert"):
        return
    lcr, rig = virtual_specimen.recorded(virtual_specimen.drawn(1), folder, 12)
    sofar = [["log", "specimen", "S1", "--design", "flat-tri.yaml"], ["log", "bench", "S1", lcr, rig]]
    for words in [*sofar, *([["calibrate", "S1"]] if command == "invert" else [])]:
        subprocess.run([sys.executable, "-m", "sensorgen", *words], cwd=folder, check=True, capture_output=True)
    readings = virtual_specimen.Truth().impedance([0.0, 2.0], [0.05, 0.05])
    virtual_specimen.write_csv(folder / "measured.csv", range(2), readings, virtual_specimen.TONES_HZ, rest=[1, 0])


@pytest.mark.parametrize("words", list(commands()))
def test_every_command_of_the_pages_works(words, tmp_path, program, kept, monkeypatch):
    monkeypatch.setenv("SENSORGEN_CACHE", str(kept))
    if words[0] == "slice":
        program("prusa-slicer", "prusa-slicer")
    for page in PAGES:
        for name, text in DESIGN.findall(page.read_text("utf-8")):
            (tmp_path / name).write_text(text, "utf-8")
    for name in ("measured.csv", "flat-tri.csv"):
        (tmp_path / name).write_text(READINGS, "utf-8")
    for name in ("designs", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    if words[:2] == ["gcode", "check"]:
        (tmp_path / words[2]).parent.mkdir(parents=True)
        (tmp_path / words[2]).write_text(runpy.run_path(str(ROOT / "tests" / "gcode" / "good.py"))["MAKER"], "utf-8")
    if words[0] in ("report", "fit") or words[:2] == ["log", "list"]:
        subprocess.run(
            [sys.executable, "-m", "sensorgen", "log", "import", "--thesis"], check=True, capture_output=True
        )
    (tmp_path / "lcr.csv").write_text("Frequency,Cp,D\n10100,63e-12,0.02\n", "utf-8")
    if words[:2] == ["log", "import"] and "S1" in words:
        of = ["log", "specimen", "S1", "--design", "flat-tri.yaml"]
        subprocess.run([sys.executable, "-m", "sensorgen", *of], cwd=tmp_path, check=True, capture_output=True)
    if "S1" in words:
        specimen_on_a_bench(words[0], tmp_path)
    extra = ["--no-cad"] if words[0] == "build" else []
    done = subprocess.run(
        [sys.executable, "-m", "sensorgen", *words, *extra], cwd=tmp_path, capture_output=True, encoding="utf-8"
    )
    finds_faults = words[0] in ("build", "check", "slice", "batch")  # and says so by its exit code
    assert done.returncode in ({0, 1} if finds_faults else {0}), done.stderr


def test_links_between_the_pages_lead_somewhere():
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_pages_stay_short():
    """Words as `wc -w` counts them; generated parts left out."""
    readme, _, rest = (ROOT / "README.md").read_text("utf-8").partition("<!-- first screen")
    assert len((readme + rest.partition("<!-- end of first screen -->")[2]).split()) < 700
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page.name not in ("reference.md", "thesis.md")]
    assert sum(len(page.read_text("utf-8").split()) for page in [*ROOT.glob("*.md"), *pages]) < 25_000


def test_modules_and_files_that_the_pages_name_exist():
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page.name not in ("reference.md", "thesis.md")]
    missing = []
    for page in [*ROOT.glob("*.md"), *pages]:
        text = page.read_text("utf-8")
        for name in re.findall(r"\bsensorgen(?:\.[a-z]\w*)+(?=[\s`(])", text):
            module, _, last = name.rpartition(".")
            if not _importable(name) and not hasattr(importlib.import_module(module), last):
                missing.append(f"{page.name}: {name}")
        files = re.findall(r"`((?:\w+/)+\w+\.(?:py|yaml))", text)
        missing += [f for f in files if not any((ROOT / top / f).is_file() for top in (".", "src/sensorgen"))]
    assert not missing


def _importable(name):
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False


def test_packages_are_named_in_the_contributing_guide():
    guide = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    packages = {p.stem for p in (ROOT / "src" / "sensorgen").iterdir() if not p.name.startswith(("_", "."))} - {"py"}
    drawing = re.search(r"```text\n(.*?)```", guide, re.DOTALL)[1]
    assert {p for p in packages if f"| `{p}` |" not in guide or p not in drawing} == set()


def test_ten_places_to_change_something_are_where_the_contributing_guide_says():
    _, _, after = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## Where would I change")
    paths = re.findall(r"^\|.*\| `(\S+)` \|$", after.partition("\n## ")[0], re.MULTILINE)
    assert len(paths) == 10
    assert [path for path in paths if not (ROOT / path).is_file()] == []
