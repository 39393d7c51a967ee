"""Light to start: what each command loads, seen in fresh interpreters."""

import pytest

HEAVY = ("numpy", "pydantic", "yaml", "build123d", "trimesh", "OCP", "manifold3d")
CAD = ("build123d", "trimesh", "OCP", "matplotlib", "scipy", "plotly", "sensorgen.plots", "ngsolve", "netgen")
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
        (["cell", "reference"], CAD),
        (["draw", "tri", "-o", "-"], CAD),
        (["build", "tri", "--no-cad"], CAD),
        (["list", "materials"], CAD),
        (["schema"], CAD),
    ],
    ids=lambda x: " ".join(x) if isinstance(x, list) else "",
)
def test_modules_that_are_not_loaded(real, words, never):
    said = real(*words, before=LOADED)
    assert said.code == 0
    loaded = said.out.rpartition("loaded: ")[2].split()
    assert "click" in loaded
    assert not set(never) & set(loaded)
