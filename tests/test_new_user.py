"""From an empty folder with a wheel: own material, printer, shape and CAD, to G-code and page, each by its command."""

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from forks import Forks

UNPRESSED = (  # by the package of the wheel, not by that of the repository
    "import os, sys; sys.modules['netgen'] = None; import sensorgen; "
    "assert sensorgen.__file__.startswith(os.environ['PYTHONPATH']), sensorgen.__file__"
)
ROOT = Path(__file__).parents[1]
HERE = Path(__file__).parent
DESIGN = """\
shape: zig
parameters: {length_mm: 16, width_mm: 8, electrode_mm: 0.3, period_mm: 4, height_mm: 0.4, film_mm: 0.2}
materials: {electrode: eel, film: x60, dielectric: x60}
printer: mine
tools: {eel: 0}
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder with nothing but what the wheel holds."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    assert {p.name for p in (folder / "site").iterdir() if p.suffix != ".dist-info"} == {"sensorgen"}
    return folder / "site"


@pytest.fixture
def sensorgen(site, tmp_path):
    """Runs a command in an empty folder, by the wheel's package, which presses no cross-section; its output."""
    home = {"HOME": str(tmp_path / "home"), "PYTHONPATH": str(site), "XDG_CONFIG_HOME": str(tmp_path / "home/config"),
            "SENSORGEN_CACHE": str(tmp_path / "cache")}  # fmt: skip
    (tmp_path / "work").mkdir()
    forks = Forks(home)

    def run(*words, code=0):
        done = forks(*words, cwd=tmp_path / "work", before=UNPRESSED, env=home)
        assert done.code == code, f"{words}: {done.out}{done.err}"
        assert "Traceback" not in done.err
        return done.out

    yield run
    forks.close()


def test_own_material_printer_and_shape_to_gcode_and_page(sensorgen, tmp_path, program):
    program("prusa-slicer", "prusa-slicer")
    work = tmp_path / "work"
    for what, name in (("material", "eel"), ("printer", "mine"), ("shape", "zig")):
        sensorgen("new", what, name)
    sensorgen("pack", "trust", ".")
    assert "no findings" in sensorgen("pack", "test", ".")
    (work / "own.yaml").write_text(DESIGN)
    assert re.match(r"PRINT( WITH WARNINGS)?  own", sensorgen("check", "own.yaml", "--budget", "0"))
    assert "capacitance" in sensorgen("predict", "own.yaml")
    sensorgen("build", "own.yaml", "--no-cad")
    sensorgen("slice", "own.yaml")
    assert "own.prusa.gcode" in sensorgen("predict", "own.yaml")
    sensorgen("show", "own.yaml", "--no-open", "-o", "own.html")
    page = (work / "own.html").read_text("utf-8")
    assert "eel" in page
    assert len(page) < 3_000_000


@pytest.mark.nightly  # tests/cli/test_import_command.py walks the same way, but for the wheel and the page
def test_own_cad_to_gcode_and_page(sensorgen, tmp_path, program):
    program("prusa-slicer", "prusa-slicer")
    work = tmp_path / "work"
    subprocess.run([sys.executable, HERE / "cad_models.py", work], check=True, capture_output=True)
    sensorgen("new", "material", "eel")
    sensorgen("import", "filleted.step", "--map", "pad=x60@1", "--map", "*=eel@2")
    assert sensorgen("check", "filleted.yaml", "--budget", "0").startswith("PRINT")
    sensorgen("predict", "filleted.yaml")  # no model bounds electrodes of different size: it says so
    sensorgen("slice", "filleted.yaml")
    sensorgen("show", "filleted.yaml", "--no-open", "-o", "own.html")
    assert len((work / "own.html").read_text("utf-8")) < 3_000_000
