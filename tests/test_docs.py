"""The documents say what the program does."""

import importlib.util
import re
import runpy
import shlex
from pathlib import Path

import click
import pytest

import virtual_specimen
from in_process import captured
from sensorgen.cli import COMMANDS, cli

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "docs" / "tutorial.md"]
READINGS = "re_ohm_1.1kHz,im_ohm_1.1kHz,re_ohm_99.7kHz,im_ohm_99.7kHz\n3000,-2.1e6,2997,-23435\n"
DESIGN = re.compile(r"```yaml\n# (\S+\.yaml)\n(.*?)```", re.DOTALL)


NIGHTLY = {  # each guarded by a test of that command, at a smaller design
    "predict flat-tri.yaml",
    "predict flat-tri.yaml --accuracy 5e-3 --explain",
    "batch docs/examples/film-study.yaml --no-gcode",
    "build tri --dielectric 0.2 --compensate print --no-cad",
    "calibrate S1",
    "chart tri --quantity line",
    "compress flat-tri.yaml --stress 0:60:20",
    "compress tri --stress 0:100:10",
    "fit --iteration 23",
    "invert S1 measured.csv",
    "predict flat-tri.yaml --force 0:6:0.1 --position 0:100:1 --csv -o flat-tri.csv",
    "predict flat-tri.yaml --force 0:6:0.1 --position 0:100:1 --plot plots",
    "predict tri --dielectric 0.1 --slicer prusa",
    "report --iteration 23",
    "slice flat-tri.yaml",
    "slice tri --dielectric 0.2",
    "thesis",
}


def commands(nightly=frozenset(), pages=PAGES):
    """Every sensorgen command of the pages once, that writes to no other program."""
    blocks = [block for page in pages for block in re.findall(r"```sh\n(.*?)```", page.read_text("utf-8"), re.DOTALL)]
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    words = [shlex.split(line, comments=True) for line in lines]
    found = dict.fromkeys(shlex.join(each[1:]) for each in words if each[:1] == ["sensorgen"] and ">" not in each)
    assert nightly <= set(found)
    return [pytest.param(line, marks=[pytest.mark.nightly] if line in nightly else [], id=line) for line in found]


def test_the_reference_is_what_the_help_texts_say():
    generate = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    assert (ROOT / "docs" / "reference.md").read_text("utf-8") == generate["reference"](), "run `make docs`"


def test_the_first_screen_of_the_readme_is_what_the_command_prints():
    generate = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    texts = (ROOT / "README.md").read_text("utf-8"), generate["first_screen"]()
    vary = r"line [0-9]+|(?<=[0-9])[0-9] mN"  # with a slicer's order of lines, which differs from run to run
    readme, printed = (re.sub(vary, "", text) for text in texts)
    assert readme == printed, "run `make docs`"


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_has_help_and_is_in_the_documents(name):
    assert cli.get_command(None, name).get_short_help_str()
    pages = [*PAGES, ROOT / "docs" / "lab.md", ROOT / "docs" / "reference.md"]
    assert any(f"sensorgen {name}" in page.read_text("utf-8") for page in pages)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with the designs that the pages write, and the repository's own."""
    for page in PAGES:
        for name, text in DESIGN.findall(page.read_text("utf-8")):
            (tmp_path / name).write_text(text, "utf-8")
    for name in ("designs", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def sensorgen(here, monkeypatch, capfd):
    """Run a command there; fails if it ends otherwise than it may."""

    def run(*words, codes=(0,)):
        said = captured(capfd, monkeypatch, *words)
        assert said.code in codes, said.err

    return run


@pytest.mark.parametrize("line", commands(pages=[*PAGES, ROOT / "docs" / "lab.md"]))
def test_every_command_of_the_pages_has_its_options(line, here, monkeypatch):
    """Words are read, and nothing is done."""
    monkeypatch.setattr(click.Command, "invoke", lambda *_: None)
    cli.main(shlex.split(line), prog_name="sensorgen", standalone_mode=False)


def specimen_on_a_bench(command, folder, sensorgen):
    """Start of ``calibrate S1`` and ``invert S1``: known presses in the log, readings beside it."""
    lcr, rig = virtual_specimen.recorded(virtual_specimen.drawn(1), folder, 12)
    sensorgen("log", "specimen", "S1", "--design", "flat-tri.yaml")
    sensorgen("log", "bench", "S1", lcr, rig)
    if command == "invert":
        sensorgen("calibrate", "S1")
    readings = virtual_specimen.Truth().impedance([0.0, 2.0], [0.05, 0.05])
    virtual_specimen.write_csv(folder / "measured.csv", range(2), readings, virtual_specimen.TONES_HZ, rest=[1, 0])


@pytest.mark.usefixtures("shared_cache")
@pytest.mark.parametrize("line", commands(NIGHTLY))
def test_every_command_of_the_pages_works(line, here, sensorgen, program, monkeypatch, request):
    words = shlex.split(line)
    if words[0] in ("build", "slice", "batch", "report"):  # full numbers: predict
        request.getfixturevalue("roughly")
    elif words[0] not in ("compress", "thesis") and "--accuracy" not in words:
        request.getfixturevalue("unpressed")
    if words[0] == "slice":
        program("prusa-slicer", "prusa-slicer")
    for name in ("measured.csv", "flat-tri.csv"):
        (here / name).write_text(READINGS, "utf-8")
    if words[:2] == ["gcode", "check"]:
        (here / words[2]).parent.mkdir(parents=True)
        (here / words[2]).write_text(runpy.run_path(str(ROOT / "tests" / "gcode" / "good.py"))["MAKER"], "utf-8")
    if words[0] in ("report", "fit") or words[:2] == ["log", "list"]:
        sensorgen("log", "import", "--thesis")
    (here / "lcr.csv").write_text("Frequency,Cp,D\n10100,63e-12,0.02\n", "utf-8")
    if words[:2] == ["log", "import"] and "S1" in words:
        sensorgen("log", "specimen", "S1", "--design", "flat-tri.yaml")
    if words[0] in ("calibrate", "invert") and "S1" in words:
        specimen_on_a_bench(words[0], here, sensorgen)
    finds_faults = words[0] in ("build", "check", "slice", "batch")  # and says so by its exit code
    extra = ["--no-cad"] if words[0] == "build" else []
    sensorgen(*words, *extra, codes=(0, 1) if finds_faults else (0,))


def test_links_between_the_pages_lead_somewhere():
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_pages_stay_short():
    """Words as `wc -w` counts them; generated parts left out."""
    readme, _, rest = (ROOT / "README.md").read_text("utf-8").partition("<!-- first screen")
    assert len((readme + rest.partition("<!-- end of first screen -->")[2]).split()) < 700
    generated = ("reference.md", "thesis.md", "validation.md")
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page.name not in generated]
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
    assert {p for p in packages if f"| `{p}` |" not in guide} == set()


def test_ten_places_to_change_something_are_where_the_contributing_guide_says():
    _, _, after = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## Where would I change")
    paths = re.findall(r"^\|.*\| `(\S+)` \|$", after.partition("\n## ")[0], re.MULTILINE)
    assert len(paths) == 10
    assert [path for path in paths if not (ROOT / path).is_file()] == []
