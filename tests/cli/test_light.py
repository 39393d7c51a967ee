"""Light to start: what each command loads, seen in fresh interpreters."""

import os

import pytest

HEAVY = ("numpy", "pydantic", "yaml", "build123d", "trimesh", "OCP", "manifold3d")
CAD = ("build123d", "trimesh", "OCP", "matplotlib", "scipy", "plotly", "sensorgen.analysis.plots", "ngsolve", "netgen")
LOADED = "import atexit; atexit.register(lambda: print('loaded:', *sys.modules))"


@pytest.mark.parametrize(
    ("words", "never"),
    [
        (["--help"], HEAVY),
        (["--version"], HEAVY),
        (["build", "--help"], HEAVY),
        (["build", "tri", "--help"], HEAVY),
        (["batch", "--help"], HEAVY),
        (["completion", "zsh"], HEAVY),
        (["check", "tri"], CAD),
        (["predict", "tri"], CAD),
        (["predict", "tri", "--force", "0:6:1"], CAD),
        (["cell", "tri", "--help"], HEAVY),
        (["log", "--help"], HEAVY),
        (["log", "multimeter", "--help"], HEAVY),
        (["chart", "--help"], HEAVY),
        (["gcode", "check", "--help"], HEAVY),
        (["slice", "tri", "--help"], HEAVY),
        (["thesis", "--help"], HEAVY),
        (["cell", "reference"], CAD),
        (["draw", "tri", "-o", "-"], CAD),
        (["build", "tri", "--no-cad"], tuple(name for name in CAD if not name.startswith("sensorgen"))),
        (["list", "materials"], CAD),
        (["schema"], CAD),
    ],
    ids=lambda x: " ".join(x) if isinstance(x, list) else "",
)
def test_modules_that_are_not_loaded(real, words, never):
    said = real(*words, before=LOADED)
    assert said.code in (0, 1)  # 1: tri loses its tips
    loaded = said.out.rpartition("loaded: ")[2].split()
    assert "click" in loaded
    assert not set(never) & set(loaded)


def test_build_with_a_stored_prediction_enters_few_modules(real):
    real("build", "reference", "--no-cad")
    said = real("build", "reference", "--no-cad", before=LOADED)
    loaded = [name for name in said.out.rpartition("loaded: ")[2].split() if name.startswith("sensorgen")]
    # 105, and the report of a slice with the check of its G-code, which verdicts are made of
    assert len(loaded) <= 133
    assert not [name for name in loaded if name.startswith(("sensorgen.models", "sensorgen.solvers"))]


def test_no_other_package_has_a_say_in_how_designs_are_read(real, monkeypatch, tmp_path):
    """Pydantic would look through all that is installed for plugins; here is one."""
    (tmp_path / "meddler.py").write_text("plugin = None\n")
    (tmp_path / "meddler-1.0.dist-info").mkdir()
    (tmp_path / "meddler-1.0.dist-info" / "METADATA").write_text("Name: meddler\nVersion: 1.0\n")
    (tmp_path / "meddler-1.0.dist-info" / "entry_points.txt").write_text("[pydantic]\nmeddler = meddler:plugin\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH")))))
    said = real("check", "reference", before=LOADED)
    assert said.code == 0
    assert {"pydantic"} == {"pydantic", "meddler"} & set(said.out.rpartition("loaded: ")[2].split())
