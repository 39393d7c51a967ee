"""Wrong words: the nearest right one is offered, in one line, and nothing is written."""

import pytest

REFUSED = {  # by the words that they follow
    "": [
        (["bild", "tri"], "unknown command 'bild'; did you mean 'build'?"),
        (["build", "trj"], "unknown shape 'trj'; did you mean 'tri'?"),
        (["optimise", "trj"], "unknown shape or file of a target 'trj'; did you mean 'tri'?"),
        (["build", "TRI"], "unknown shape 'TRI'; did you mean 'tri'?"),
        (["build", "tri", "--dielectrik", "0.2"], "unknown option '--dielectrik'; did you mean '--dielectric'?"),
        (["list", "material"], "did you mean 'materials'?"),
        (["list"], "Missing argument '{shapes|materials|printers|"),
        (["list", "shapes", "--jsn"], "did you mean '--json'?"),
        (["completion", "zhs"], "did you mean 'zsh'?"),
        (["schema", "--csv"], "unknown option '--csv'"),
        (["check", "--strict", "tri"], "--strict stands before the shape; write sensorgen check {SHAPE|"),
        (["check", "tri", "rect"], "unexpected extra argument (rect)"),
        (["check", "reference", "--budget", "nan"], "nan is not a number"),
        (["log", "add", "S1", "--humidity", "nan"], "nan is not a number"),
    ],
    "predict": [
        (["tri", "--drawn", "--force", "1", "--compression", "bonded"],
         "the law 'bonded' applies to a solid plate; tri has gaps: expected 'unconfined'"),
        (["reference", "--drawn", "--force", "1", "--compression", "solved"],
         "is a solid plate: expected the law 'unconfined', 'bonded' or 'symmetric'"),
    ],
    "check tri": [
        (["--along", "xx"], "unknown --along 'xx'; did you mean 'x'? Known: x, y"),
        (["--orientation", "upsidedown"], "did you mean 'upside-down'?"),
        (["--material", "film=x61"], "unknown material 'x61'; did you mean 'x60'?"),
        (["--material", "flm=x60"], "unknown key of materials 'flm'; did you mean 'film'?"),
        (["--material", "film=x60@thesis-41"], "source of x60 'thesis-41'; did you mean 'thesis-4.1'?"),
        (["--material", "film=X 60"], "materials.film is 'X 60'; expected text such as x60 or x60@"),
        (["--material", "film=etpu"], "materials.film: etpu conducts"),
        (["--material", "electrode=x60"], "materials.top_electrode: x60 does not conduct"),
        (["--material", "film"], "--material 'film': expected KEY=VALUE"),
        (["--support", "bvho"], "unknown material 'bvho'; did you mean 'bvoh'?"),
        (["--support", "x60"], "materials.support: the sensor itself is made of x60"),
        (["--printer", "diabase"], "unknown printer 'diabase'; did you mean 'diabase-h5'?"),
        (["--printer", "own.yaml"], "cannot read 'own.yaml': No such file"),
        (["--quality", "fin"], "unknown quality 'fin'; did you mean 'fine'?"),
        (["--tool", "x60=9"], "tools.x60: diabase-h5 has no tool 9; it has [1, 2, 3, 4, 5]"),
        (["--tool", "x60=²"], "--tool: '²' is not a whole number"),
        (["--tool", "x61=2"], "unknown material 'x61'"),
        (["--tool", "x60=3"], "tool 3 is given to both etpu and x60: choose with --tool"),
        (["--infill", "lots"], "--infill: 'lots' is not a number"),
        (["--infill", "x61=80"], "unknown material 'x61'"),
        (["--infill", "0"], "infill.x60.percent is 0.0; expected a number above 0"),
        (["--infill", "120"], "infill.x60.percent is 120.0; expected 100 or less"),
        (["--infill-pattern", "gird"], "infill.x60.pattern is 'gird'; expected 'rectilinear', 'grid',"),
        (["--shrinkage", "nan"], "shrinkage is nan; expected a number below 0.9"),
        (["--shrinkage", "-1"], "shrinkage is -1.0; expected 0 or more"),
        (["--nozzle", "0"], "nozzle_mm is 0.0; expected 0.05 or more"),
        (["--nozzle", "9"], "nozzle_mm is 9.0; expected 5 or less"),
        (["--set", "perod_mm=2"], "unknown setting 'perod_mm'; did you mean 'period_mm'?"),
        (["--set", "parameters.perod_mm=2"], "unknown parameter of tri 'perod_mm'; did you"),
        (["--set", "infill.x60.percnt=2"], "unknown key of infill.x60 'percnt'; did you mean 'percent'?"),
        (["--set", "infill.x60=2"], "infill.x60 is 2; expected a mapping with percent, pattern"),
        (["--set", "tools=2"], "tools is 2; expected a mapping of names to values"),
        (["--set", "waivers=2"], "waivers is 2; expected a list"),
        (["--set", "materials." + "a." * 2000 + "b=2"], "unknown setting"),
        (["--set", "period_mm"], "--set 'period_mm': expected KEY=VALUE"),
        (["--set", "=3"], "--set '=3': expected KEY=VALUE"),
        (["--set", "along=q"], "unknown value of along 'q'. Known: x, y"),
    ],
    "build tri --no-cad": [
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
    ],
    "cell tri": [
        (["--accuracy", "0"], "--accuracy: 0; expected a number above 0"),
        (["--accuracy", "nan"], "--accuracy: nan; expected a number above 0"),
        (["--model", "fem4d"], "unknown model of capacitance 'fem4d'; did you mean 'fem"),
        (["--drawn", "--model", "fem3d"], "fem3d: not all of it is boxes"),
        (["--drawn", "--dielectric", "0"], "the electrodes touch: the capacitance grows without bound"),
        (["--set", "eps_x61=3"], "unknown material 'x61'; did you mean 'x60'"),
        (["--set", "epz_x60=3"], "unknown quantity of x60 'epz'; did you mean 'eps'"),
        (["--set", "eps_x60=soft"], "material_values.x60.relative_permittivity is 'soft'; expected a number"),
        (["--set", "eps_x60=-1"], "relative_permittivity of x60 is -1; expected 1e-09 to 1e+09"),
        (["--explain", "--json"], "--json holds the plan too"),
        (["--sweep", "eps_x60"], "--sweep 'eps_x60': expected KEY=VALUE"),
        (["--sweep", "eps_x60=1:a:2"], "'a' is not a number: write a number without a unit"),
        (["--sweep", "eps_x60=0,1"], "eps_x60=0.0: relative_permittivity of x60 is 0"),
        (["--sweep", "dielectric_mm=0.2:0.1:0.05"], "expected a step above 0"),
        (["--sweep", "dielectric_mm=99"], "dielectric_mm=99.0: dielectric_mm is 99; expected"),
        (["--sweep", "nosuch=1,2"], "unknown setting 'nosuch'"),
        (["--sweep", "along=x,z"], "along=z: unknown value of along 'z'"),
        (["--jobs", "0"], "--jobs"),
        (("--set", "resistivity_x60=1e6"), "--frequency 1.1kHz"),
        (("--set", "loss_x60=-0.1"), "expected 0 to 1e+06"),
        (("--set", "loss_x60=1e7"), "expected 0 to 1e+06"),
        (("--set", "loss_x60=0.1", "--model", "columns"), "losses are solved by fem2d and fem3d alone"),
        (("--set", "loss_x60=0.1", "--frequency", "1kHz,2kHz"), "expected one"),
        (("--set", "loss_x60=0.1", "--frequency", "0"), "above 0"),
    ],
    "compress tri": [
        (["--stress", "-1"], "expected 0 or more"),
        (["--stress", "0"], "expected a stress above 0"),
        (["--stress", "much"], "is not a stress"),
        (["--stress", "5mm"], "is not a stress"),
        (["--sides", "glued"], "bonded"),
        (["--contact", "slippy"], "frictionless"),
        (["--model", "press4d"], "press2d"),
        (["--set", "nu_x60=0.6"], "0.5"),
        (["--set", "youngs_modulus_x60=0"], "youngs_modulus"),
        (["--model", "springs", "--stress", "9000MPa"], "flat"),
        (["--set", "youngs_modulus_x60=5e4"], "100 kPa on x60 of 50 kPa"),
        (["--explain"], "--explain without --accuracy"),
        (["--accuracy", "1e-2", "--explain", "--json"], "--json holds the plan too"),
        (["--accuracy", "1e-2", "--check-mesh"], "at once"),
        (["--accuracy", "1e-2", "--model", "springs"], "springs tells displacement alone, no capacitance; leave out"),
    ],
    "compress tri --sweep dielectric_mm=0.1,0.2": [
        (["--accuracy", "1e-2", "--explain"], "one design; --json holds the plan too"),
        (["--plot", "a.png"], "--plot draws one design"),
        (["--sweep", "dielectric_mm=99"], "dielectric_mm=99.0: dielectric_mm is 99"),
    ],
    "sheet reference --size 60x60 --frequencies 100kHz,1MHz": [
        (["--contacts", "corner-pads"], "did you mean 'corners'"),
        (["--force", "1,2"], "--force: 2 values; expected one"),
        (["--force", "0"], "above 0"),
        (["--tip", "60"], "leaves no place"),
        (["--tip", "0"], "--tip: 0; expected above 0"),
        (["--noise", "0"], "--noise 0; expected a share above 0"),
        (["--frequencies", "1GHz,900GHz"], "use frequencies up to"),
        (["--frequencies", f"{10**140}"], "below 1e+100, not 1e+140"),
        (["--pad", "0-10"], "expected X0-X1,Y0-Y1 in mm"),
        (["--pad", "0-10,0-10-20"], "expected X0-X1,Y0-Y1 in mm"),
        (["--pad", "0-ten,0-10"], "--pad: '0-ten,0-10': 'ten' is not a length"),
        (["--pad=-5-10,0-10"], "expected X0-X1,Y0-Y1"),
        (["--pad", "10-0,0-10"], "give the lower first"),
        (["--pad", "0,0"], "without length"),
        (["--pad", "55-65,0-10"], "x 55..65, y 0..10 mm reaches from x = 55 to 65 mm, beyond the sheet's 0 to 60 mm"),
        (["--pad", "0-10,0-10", "--pad", "5-15,0-10"], "shorted"),
    ],
    "stack double": [
        (["--position", "99"], "overhangs"),
        (["--force", "1,2"], "expected one"),
        (["--force", "0"], "--force"),
        (["--drift", "0"], "--drift 0; expected a share"),
        (["--touch", "200"], "a tip of 200 mm; expected up to"),
        (["--force", "9kN"], "touch"),
        (["--upper-dielectric", "0"], "touch"),
    ],
    "bench plan reference": [
        (("--force", "6"), "expected the least and the largest"),
        (("--tip", "101"), "longer than the sensor, 100 mm"),
        (("--dwell", "0"), "expected a dwell above 0"),
        (("--seed", "-1"), "--seed -1; expected"),
        (("--picture", "plan.jpg"), "ends in .png"),
        (("--presses", "60000", "--repeats", "1"), "expected up to 100000"),
    ],
    "characterise": [
        (["diabase-h5", "etpu"], "expected one that conducts and one that does not"),
        (["diabase-h5", "etpu", "x60", "bvoh"], "expected one that conducts and one that does not"),
        (["diabase-h5", "etpu", "x61"], "unknown material 'x61'; did you mean 'x60'"),
        (["diabase", "etpu", "x60"], "unknown printer 'diabase'"),
        (["diabase-h5", "etpu", "x60", "--hours", "0.01"], "no coupon fits"),
        (["diabase-h5", "etpu", "x60", "--count", "13"], "expected 2 to 12 coupons"),
        (["diabase-h5", "etpu", "x60", "--tool", "etpu"], "expected MATERIAL=NUMBER"),
        (["--hours", "3"], "stands before the printer"),
        (["read", "no.yaml"], "cannot read"),
    ],
    "predict reference --sides free --drawn": [
        (["--noise", "300%"], "--noise 3; expected a share above 0 and below 1"),
        (["--accuracy", "-1"], "--accuracy: -1; expected a number above 0"),
        (["--tip=-1"], "tip.width_mm is -1.0; expected a number above 0"),
        (["--compression", "solved"], "--compression and --sides at once"),
        (["--force", "0:6:0"], "--force: '0:6:0': expected a step above 0"),
        (["--force", "2,1"], "--force: '2,1': 1 stands after 2; expected rising values, each once"),
        (["--force", "-1"], "--force: -1; expected 0 or more"),
        (["--force", "6 kg"], "--force: '6 kg' is not a force: write a number, with N, mN, kN"),
        (["--position", "0:120:40"], "position 120 mm is outside the sensor; expected 0 to 100 mm"),
        (["--position=-5"], "--position: -5; expected 0 or more"),
        (["--frequencies", "0,1kHz"], "--frequencies: 0; expected above 0"),
        (["--frequencies", "1mhz"], "'mhz' may be mHz or MHz"),
        (["--frequencies", "1kHz,1kHz"], "1000 stands twice"),
        (["--force", "0:700:100", "--position", "50"], "force 600 N at position 50 mm: the stress thins the film by 1"),
        (["--plot", "p", "--force", "0:700:100"], "force 600 N at position 5 mm: the stress thins the film by 1"),
        (["--force", "1", "--tip", "120"], "a tip of 120 mm; expected up to the sensor's 100 mm"),
        (["--force", "1", "--tip", "0"], "tip.width_mm is 0.0; expected a number above 0"),
        (["--tip", "5,stiff,even"], "--tip: '5,stiff,even': expected as 10mm, 5mm,stiff, even or 10mm,ninjaflex,10mm"),
        (["--tip", "rubber"], "unknown material 'rubber'"),
        (["--force", "1", "--compression", "bond"], "unknown --compression 'bond'; did you mean 'bonded'?"),
        (["--force", "1", "--json", "--csv"], "--json and --csv at once; expected one of them"),
        (["--plot", "p", "--csv"], "--csv and --plot at once"),
        (["--plot", "p", "-o", "f"], "--output and --plot at once"),
        (["--plot", "p", "--force", "1"], "1 force(s) and 101 position(s) make no map"),
        (["--force", "0:6:0.001", "--position", "0:100:0.1"], "7 x 6001 x 1001 frequencies, forces and positions;"),
        (["--force", "1", "-o", "."], "cannot write '.': it is a folder or a device; expected a file"),
    ],
}  # fmt: skip
CASES = [((*command.split(), *words), message) for command, rows in REFUSED.items() for words, message in rows]


@pytest.mark.usefixtures("shared_cache")
@pytest.mark.parametrize(("words", "message"), CASES, ids=[" ".join(words)[:80] for words, _ in CASES])
def test_wrong_words(run, tmp_path, words, message):
    said = run(*words)
    assert (said.code, said.out) == (2, "")
    assert message in said.line
    assert list(tmp_path.iterdir()) == []


def test_a_swarm_of_cells_is_refused_before_it_fills_the_memory(run):
    assert (
        "cells of the pattern on 380 x 165 mm; expected at most 50000: use a longer period"
        in run(
            "check", "rect", "--size", "380x165", "--etpu-width", "0.02", "--air-width", "0.02", "--x60-width", "0.02"
        ).refusal
    )


def test_a_stack_of_layers_is_refused_before_it_fills_the_memory(run, tmp_path):
    fine = "title: t\nsource: s\nlayer_mm: 1e-9\nfirst_layer_mm: 1e-9\ninfill_pattern: grid\n"
    fine += "travel_speed_mm_s: 1\nbridge_warning_mm: 1\nbridge_error_mm: 2\n"
    (tmp_path / "thin.yaml").write_text(fine)
    assert "layers of 1e-09 mm; expected at most 5000" in run("check", "tri", "--quality", "thin.yaml").refusal


@pytest.mark.parametrize(
    "name",
    [
        "../x", "a\\b", ".", "", "größe", "it's", "a\nb", "-x", "x.", "CON", "con.txt", "a:b", "\udcff", "x" * 101,
    ],
    ids=ascii,
)  # fmt: skip
def test_a_name_that_is_no_file_name_everywhere(run, tmp_path, name):
    said = run("build", "tri", "--no-cad", "--name", name)
    assert "cannot be a file name everywhere; expected at most 100 letters" in said.refusal
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


def test_a_sensor_that_reaches_where_the_prime_tower_stands_is_warned_of(run):
    said = run("check", "reference", "--size", "330x330", "--printer", "prusa-xl5").ok
    assert "it reaches into the far right corner, where the prime tower of" in said.words
