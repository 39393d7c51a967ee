"""Light to start: what each command loads, seen in fresh interpreters."""

import os

HEAVY = ("numpy", "pydantic", "yaml", "build123d", "trimesh", "OCP", "manifold3d")
CAD = ("build123d", "trimesh", "OCP", "matplotlib", "scipy", "plotly", "sensorgen.analysis.plots", "ngsolve", "netgen")
LOADED = "import atexit; atexit.register(lambda: print('loaded:', *sys.modules))"
COMMANDS = [  # and what they never load; those with fewest modules first, as modules stay
    *((words.split(), HEAVY) for words in (
        "--help", "--version", "build --help", "build tri --help", "batch --help", "completion zsh", "cell tri --help",
        "log --help", "log multimeter --help", "chart --help", "gcode check --help", "predict tri --help",
        "thesis --help",
    )),
    *((words.split(), CAD) for words in (
        "list materials", "schema", "check tri", "predict tri", "predict tri --force 0:6:1 --csv", "cell reference",
        "draw tri -o -",
    )),
    (["build", "tri", "--no-cad"], tuple(name for name in CAD if not name.startswith("sensorgen"))),
]  # fmt: skip


def test_modules_that_are_not_loaded(loaded):
    found = loaded(*(words for words, _ in COMMANDS))
    for (code, modules), (words, never) in zip(found, COMMANDS, strict=True):
        assert code in (0, 1), words  # 1: tri loses its tips
        assert "click" in modules
        assert not set(never) & set(modules), words


def test_build_with_a_stored_prediction_enters_few_modules(real):
    real("build", "reference", "--no-cad")
    said = real("build", "reference", "--no-cad", before=LOADED)
    loaded = [name for name in said.out.rpartition("loaded: ")[2].split() if name.startswith("sensorgen")]
    # 105, the report of a slice with the check of its G-code, which verdicts are made of, and the page of layers
    assert len(loaded) <= 140
    assert not [name for name in loaded if name.startswith(("sensorgen.models", "sensorgen.solvers"))]


def test_no_other_package_has_a_say_in_how_designs_are_read(real, monkeypatch, tmp_path):
    """Pydantic would look through all that is installed for plugins; here is one."""
    (tmp_path / "meddler.py").write_text("plugin = None\n")
    (tmp_path / "meddler-1.0.dist-info").mkdir()
    (tmp_path / "meddler-1.0.dist-info" / "METADATA").write_text("Name: meddler\nVersion: 1.0\n")
    (tmp_path / "meddler-1.0.dist-info" / "entry_points.txt").write_text("[pydantic]\nmeddler = meddler:plugin\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH")))))
    said = real("check", "reference", before=LOADED).ok
    assert {"pydantic"} == {"pydantic", "meddler"} & set(said.out.rpartition("loaded: ")[2].split())
