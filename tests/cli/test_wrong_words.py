"""Wrong words: the nearest right one is offered, in one line, and nothing is written."""

import pytest

NAMES = [
    (["bild", "tri"], "unknown command 'bild'; did you mean 'build'?"),
    (["build", "trj"], "unknown shape 'trj'; did you mean 'tri'?"),
    (["build", "TRI"], "unknown shape 'TRI'; did you mean 'tri'?"),
    (["build", "tri", "--dielectrik", "0.2"], "unknown option '--dielectrik'; did you mean '--dielectric'?"),
    (["list", "material"], "did you mean 'materials'?"),
    (["list"], "Missing argument '{shapes|materials|printers|"),
    (["list", "shapes", "--jsn"], "did you mean '--json'?"),
    (["completion", "zhs"], "did you mean 'zsh'?"),
    (["schema", "--csv"], "unknown option '--csv'"),
    (["check", "--strict", "tri"], "--strict stands before the shape; write sensorgen check {SHAPE|"),
    (["check", "tri", "rect"], "unexpected extra argument (rect)"),
    (["check", "tri", "--along", "xx"], "unknown --along 'xx'; did you mean 'x'? Known: x, y"),
    (["check", "tri", "--orientation", "upsidedown"], "did you mean 'upside-down'?"),
    (["check", "tri", "--material", "film=x61"], "unknown material 'x61'; did you mean 'x60'?"),
    (["check", "tri", "--material", "flm=x60"], "unknown key of materials 'flm'; did you mean 'film'?"),
    (["check", "tri", "--material", "film=x60@thesis-41"], "source of x60 'thesis-41'; did you mean 'thesis-4.1'?"),
    (["check", "tri", "--material", "film=X 60"], "materials.film is 'X 60'; expected text such as x60 or x60@"),
    (["check", "tri", "--material", "film=etpu"], "materials.film: etpu conducts"),
    (["check", "tri", "--material", "electrode=x60"], "materials.top_electrode: x60 does not conduct"),
    (["check", "tri", "--material", "film"], "--material 'film': expected KEY=VALUE"),
    (["check", "tri", "--support", "bvho"], "unknown material 'bvho'; did you mean 'bvoh'?"),
    (["check", "tri", "--support", "x60"], "materials.support: the sensor itself is made of x60"),
    (["check", "tri", "--printer", "diabase"], "unknown printer 'diabase'; did you mean 'diabase-h5'?"),
    (["check", "tri", "--printer", "own.yaml"], "cannot read 'own.yaml': No such file"),
    (["check", "tri", "--quality", "fin"], "unknown quality 'fin'; did you mean 'fine'?"),
    (["check", "tri", "--tool", "x60=9"], "tools.x60: diabase-h5 has no tool 9; it has [1, 2, 3, 4, 5]"),
    (["check", "tri", "--tool", "x60=²"], "--tool: '²' is not a whole number"),
    (["check", "tri", "--tool", "x61=2"], "unknown material 'x61'"),
    (["check", "tri", "--tool", "x60=3"], "tool 3 is given to both etpu and x60: choose with --tool"),
    (["check", "tri", "--infill", "lots"], "--infill: 'lots' is not a number"),
    (["check", "tri", "--infill", "x61=80"], "unknown material 'x61'"),
    (["check", "tri", "--infill", "0"], "infill.x60.percent is 0.0; expected a number above 0"),
    (["check", "tri", "--infill", "120"], "infill.x60.percent is 120.0; expected 100 or less"),
    (["check", "tri", "--infill-pattern", "gird"], "infill.x60.pattern is 'gird'; expected 'rectilinear', 'grid',"),
    (["check", "tri", "--shrinkage", "nan"], "shrinkage is nan; expected a number below 0.9"),
    (["check", "tri", "--shrinkage", "-1"], "shrinkage is -1.0; expected 0 or more"),
    (["check", "tri", "--nozzle", "0"], "nozzle_mm is 0.0; expected 0.05 or more"),
    (["check", "tri", "--nozzle", "9"], "nozzle_mm is 9.0; expected 5 or less"),
    (["check", "tri", "--set", "perod_mm=2"], "unknown setting 'perod_mm'; did you mean 'period_mm'?"),
    (["check", "tri", "--set", "parameters.perod_mm=2"], "unknown parameter of tri 'perod_mm'; did you"),
    (["check", "tri", "--set", "infill.x60.percnt=2"], "unknown key of infill.x60 'percnt'; did you mean 'percent'?"),
    (["check", "tri", "--set", "infill.x60=2"], "infill.x60 is 2; expected a mapping with percent, pattern"),
    (["check", "tri", "--set", "tools=2"], "tools is 2; expected a mapping of names to values"),
    (["check", "tri", "--set", "waivers=2"], "waivers is 2; expected a list"),
    (["check", "tri", "--set", "materials." + "a." * 2000 + "b=2"], "unknown setting"),
    (["check", "tri", "--set", "period_mm"], "--set 'period_mm': expected KEY=VALUE"),
    (["check", "tri", "--set", "=3"], "--set '=3': expected KEY=VALUE"),
    (["check", "tri", "--set", "along=q"], "unknown value of along 'q'. Known: x, y"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "message"), NAMES, ids=[" ".join(words)[:60] for words, _ in NAMES])
def test_wrong_name(run, words, message):
    said = run(*words)
    assert (said.code, said.out) == (2, "")
    assert message in said.line


SIZES = [
    (["--period=-2"], "period_mm is -2; expected a number from 0.1 to 100 mm"),
    (["--period", "0"], "period_mm is 0; expected"),
    (["--set", "period_mm=nan"], "period_mm is 'nan'; expected a number from 0.1 to 100 mm"),
    (["--period", "nan"], "--period: 'nan' is not a length"),
    (["--period", "2 inch"], "--period: '2 inch' is not a length: write a number, with mm, um, cm or m"),
    (["--length", "1e9"], "length_mm is 1e+09; expected a number from 1 to 1000 mm"),
    (["--dielectric=-0.1"], "dielectric_mm is -0.1; expected a number from 0 to 10 mm"),
    (["--electrode", "0"], "electrode_mm is 0; expected a number from 0.01"),
    (["--size", "50"], "--size '50': expected LENGTHxWIDTH, as in 100x10"),
    (["--size", "50x"], "--size '50x': expected LENGTHxWIDTH"),
    (["--size", "1x2x3"], "--size '1x2x3': expected LENGTHxWIDTH"),
    (["--size", ""], "--size '': expected LENGTHxWIDTH"),
    (["--size", "-5x10"], "length_mm is -5; expected"),
    (["--lower-height", "0.6"], "lower_height_mm 0.6 must stay below hang_height_mm 0.5"),
]


@pytest.mark.parametrize(("words", "message"), SIZES, ids=[" ".join(words) for words, _ in SIZES])
def test_wrong_size(run, words, message):
    said = run("build", "tri", "--no-cad", *words)
    assert (said.code, said.out) == (2, "")
    assert message in said.line


def test_a_swarm_of_cells_is_refused_before_it_fills_the_memory(run):
    said = run(
        "check", "rect", "--size", "380x165", "--etpu-width", "0.02", "--air-width", "0.02", "--x60-width", "0.02"
    )
    assert said.code == 2
    assert "cells of the pattern on 380 x 165 mm; expected at most 50000: use a longer period" in said.line


def test_a_stack_of_layers_is_refused_before_it_fills_the_memory(run, tmp_path):
    fine = "title: t\nsource: s\nlayer_mm: 1e-9\nfirst_layer_mm: 1e-9\ninfill_pattern: grid\n"
    fine += "travel_speed_mm_s: 1\nbridge_warning_mm: 1\nbridge_error_mm: 2\n"
    (tmp_path / "thin.yaml").write_text(fine)
    said = run("check", "tri", "--quality", "thin.yaml")
    assert said.code == 2
    assert "layers of 1e-09 mm; expected at most 5000" in said.line


@pytest.mark.parametrize(
    "name",
    [
        "../x", "a\\b", ".", "", "größe", "it's", "a\nb", "-x", "x.", "CON", "con.txt", "a:b", "\udcff", "x" * 101,
    ],
    ids=ascii,
)  # fmt: skip
def test_a_name_that_is_no_file_name_everywhere(run, tmp_path, name):
    said = run("build", "tri", "--no-cad", "--name", name)
    assert said.code == 2
    assert "cannot be a file name everywhere; expected at most 100 letters" in said.line
    assert "--name" in said.line
    assert len(said.line) < 300
    assert list(tmp_path.iterdir()) == []


def test_too_large_for_the_bed(run, tmp_path):
    said = run("build", "tri", "--size", "330x330")
    assert said.code == 1
    assert "330 x 330 mm do not fit on the bed of diabase-h5, 390 x 170 mm" in said.line
    assert "nothing was written" in said.line
    assert said.out.startswith(
        "CHANGE  trix-d0.2-length330-width330: 1 error; estimated (PrusaSlicer, Arachne\n  walls)"
    )
    assert "\n\nerror  8-bed  sensor" in said.out
    assert list(tmp_path.iterdir()) == []


def test_a_short_is_an_error_and_nothing_is_written(run, tmp_path):
    said = run("build", "tri", "--dielectric", "0", "--no-cad")
    assert said.code == 1
    assert "the electrodes touch: a short by design; nothing was written (--force" in said.line
    assert list(tmp_path.iterdir()) == []


def test_strict_makes_a_warning_fatal(run, tmp_path):
    wide = ("tri", "--period", "3")  # its tips are as wide as a line
    assert run("check", *wide).code == 0
    assert run("check", *wide, "--strict").code == 1
    said = run("build", *wide, "--no-cad", "--strict")
    assert said.code == 1
    assert "nothing was written" in said.line
    assert list(tmp_path.iterdir()) == []
    assert run("check", "reference", "--strict").code == 0


def test_no_traceback_in_a_process_of_its_own(fork):
    for words in (["build", "trj"], ["draw", "tri", "--period", "-2"], ["predict", "/dev/zero"]):
        said = fork(*words)
        assert said.code == 2
        assert said.line


@pytest.mark.parametrize(
    "words", [["check", "reference", "--budget", "nan"], ["log", "add", "S1", "--humidity", "nan"]]
)
def test_nan_is_within_no_range(run, words):
    """A budget of nan seconds was taken as none."""
    said = run(*words)
    assert (said.code, said.out) == (2, "")
    assert "nan is not a number" in said.line


def test_a_sensor_that_reaches_where_the_prime_tower_stands_is_warned_of(run):
    said = run("check", "reference", "--size", "330x330", "--printer", "prusa-xl5")
    assert said.code == 0
    assert "it reaches into the far right corner, where the prime tower of" in said.words
