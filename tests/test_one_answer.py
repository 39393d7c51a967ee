"""One sensor, one answer: whoever is asked, and however, says the same of a design, to the digit.

``predict`` is the answer that all others are held to; that it is right is held against reference solutions that no
sensorgen made. Each entry point has one adapter below: where an output's form changes, its adapter does, and no test.
"""

import contextlib
import io
import json
import math
import re
import signal
import sys
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import lumped_line
import numpy as np
import pytest

import sensorgen
from sensorgen.cli import main

OWN = """\
shape: tri
parameters: {length_mm: 80, width_mm: 12, electrode_mm: 0.4, period_mm: 2.4, hang_height_mm: 0.6, lower_height_mm: 0.3,
  dielectric_mm: 0.3, along: x}
material_values:
  x60: {relative_permittivity: 3.9, youngs_modulus_pa: 4.5e+6}
  etpu: {resistivity_ohm_m: 0.05, youngs_modulus_pa: 18.0e+6}
"""
DESIGNS = {
    "trix": ["tri", "--dielectric", "0.2", "--along", "x"],
    "triy": ["tri", "--dielectric", "0.2", "--along", "y"],
    "rect": ["rect", "--dielectric", "0.1"],
    "reference": ["reference"],
    "double": ["double"],
    "own": ["own.yaml"],  # 33 1/3 periods long
    "compensated": ["tri", "--dielectric", "0.2", "--compensate", "print"],
    "upside-down": ["tri", "--dielectric", "0.2", "--orientation", "upside-down", "--support", "bvoh"],
}


@dataclass(frozen=True)
class Answer:
    """What an entry point says of a design; what it does not say is missing.

    Each is by the body that it is said of, ``drawn`` or ``printed``: capacitance between bounds [F], resistance of
    ``top`` and ``bottom`` electrode, of the ``worse`` one, or of ``both`` together [ohm], electrode gap [mm].
    ``verdict`` is how exactly a press is known, in force [N] and position [mm]; ``errors`` is the number of findings of
    that severity, with the exit code.
    """

    capacitance: dict = field(default_factory=dict)
    resistance: dict = field(default_factory=dict)
    gap: dict = field(default_factory=dict)
    verdict: tuple | None = None
    errors: tuple | None = None


class Asked:
    """A design, and what is asked of it: every command once, in a folder of its own."""

    def __init__(self, name, folder):
        self.name, self.folder, self._said = name, folder, {}
        (folder / "own.yaml").write_text(OWN, "utf-8")

    def say(self, *words):
        """Exit code and standard output of a command, run in this process."""
        words = tuple(map(str, words))
        if words not in self._said:
            self._said[words] = _run(words, self.folder)
        return self._said[words]

    def json(self, *words):
        """What a command prints as JSON; None where it prints nothing."""
        out = self.say(*words, "--json")[1]
        return json.loads(out) if out else None

    @cached_property
    def built(self):
        """Folder of build, with its files even where findings would keep it from writing any."""
        for force in ([], ["--force"]):
            said = self.json("build", *DESIGNS[self.name], "--no-cad", *force)
            if said and said["folder"]:
                return self.folder / said["folder"]
        raise AssertionError("build writes nothing")

    @cached_property
    def file(self):
        """The design as a file."""
        return self.built / "design.json"

    @cached_property
    def record(self):
        """Of a batch with one copy of the design."""
        (self.folder / "plan.yaml").write_text(
            json.dumps({"iteration": 60, "designs": [{"design": str(self.file)}]}), "utf-8"
        )
        self.say("batch", "plan.yaml", "--no-gcode", "--force", "--json")
        return self.folder / "out" / "plan" / "batch.json"

    @cached_property
    def logged(self):
        """Name of a specimen of the batch, with bed, prediction, reading and a recording at rest in the log."""
        name = next(iter(json.loads(self.record.read_text("utf-8"))["specimens"]))
        line = lumped_line.tri(0.2, 0.07, 0.2)
        tones, rows = np.array([1.1e3]), 40
        z = np.tile(line.impedance(tones), (rows, 1)) * (1 + 1e-4 * np.sin(np.arange(rows))[:, None])
        rest = np.column_stack([np.arange(rows) / 10, z.real, z.imag])
        lumped_line.write(self.folder / "rest.csv", ["time_s", *lumped_line.columns(tones)], rest)
        self.say("log", "predict", self.file, "--json")
        self.say("log", "import", self.record)
        self.say("log", "multimeter", name, "--y", "3k", "--z", "OL")
        self.say("log", "bench", name, "rest.csv")
        return name


def _run(words, folder):
    argv, before = sys.argv, signal.getsignal(signal.SIGTERM)
    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["sensorgen", *words]
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as left:
        assert "Traceback" not in err.getvalue()
        return left.code, out.getvalue()
    finally:
        sys.argv = argv
        signal.signal(signal.SIGTERM, before)


# ---- adapters: one for each entry point --------------------------------------


def predict(asked):
    """What all others are held to: the drawing by ``predict``, the print by ``predict --as-printed``."""
    drawn, both = asked.json("predict", asked.file), asked.json("predict", asked.file, "--as-printed")
    code, _ = asked.say("predict", asked.file, "--as-printed", "--json")
    printed = both["electrode_resistance_ohm"]["printed"]
    return Answer(
        {"drawn": _bounds(drawn["capacitance_f"]), "printed": _bounds(both["capacitance_f"]["printed"])},
        {
            "drawn": _ohm(drawn.get("electrode_resistance_ohm")),
            "printed": _ohm({end: at[0] for end, at in printed.items() if at} if printed else None),
        },
        {"drawn": both["electrode_gap_mm"]["drawn"], "printed": tuple(both["electrode_gap_mm"]["printed"])},
        _verdict(drawn.get("identifiability")),
        (_errors(both["findings"]), code),
    )


def predict_as_printed(asked):
    """The drawing beside the print."""
    both = asked.json("predict", asked.file, "--as-printed")
    return Answer(
        {"drawn": _bounds(both["capacitance_f"]["drawn"])},
        {"drawn": _ohm(both["electrode_resistance_ohm"]["drawn"])},
    )


def build(asked):
    """``prediction.json`` and ``check.json``."""
    prediction, check = (
        json.loads((asked.built / name).read_text("utf-8")) for name in ("prediction.json", "check.json")
    )
    code, _ = asked.say("build", *DESIGNS[asked.name], "--no-cad", "--json")
    return _of_prediction(prediction, errors=(_errors(check["findings"]), code))


def cell(asked):
    """``cell``, times the sensor's area."""
    said = asked.json("cell", asked.file)
    return Answer({"drawn": _per_area(said, said["area_m2"], "lower_f_per_m2", "upper_f_per_m2") if said else None})


def compress(asked):
    """``compress`` at stress 0, which it puts before the stresses that are asked for."""
    said, area = asked.json("compress", asked.file, "--stress", "1"), asked.json("cell", asked.file)
    if not said:
        return Answer({"drawn": None})
    at_rest = {end: said[end][said["stress_kpa"].index(0.0)] for end in ("lower_f_per_m2", "upper_f_per_m2")}
    return Answer({"drawn": _per_area(at_rest, area["area_m2"], "lower_f_per_m2", "upper_f_per_m2")})


def batch(asked):
    """``batch.json``."""
    specimen = next(iter(json.loads(asked.record.read_text("utf-8"))["specimens"].values()))
    code, _ = asked.say("batch", "plan.yaml", "--no-gcode", "--json")
    return _of_prediction(specimen["expected"], errors=(None, code))


def log_predict(asked):
    """``log predict``."""
    _ = asked.logged
    (_, out) = asked.say("log", "predict", asked.file, "--json")
    return _of_prediction(next(_data(row) for row in json.loads(out) if "data" in row))


def log_show(asked):
    """``log show`` of a specimen: its predictions, which must agree."""
    found = [_of_prediction(_data(row)) for row in asked.json("log", "show", asked.logged) if "data" in row]
    if len({answer.capacitance["drawn"] for answer in found}) == 1:
        return found[0]
    return replace(found[0], capacitance={"drawn": f"{len(found)} predictions that differ"})


def report(asked):
    """``report``: the table of specimens, that of tones, and that of the variants."""
    _ = asked.logged
    code, out = asked.say("report", "--iteration", 60, "--format", "json", "-o", "-")
    assert code == 0, f"report ends with {code}"
    tables = {t["key"]: _rows(t) for section in json.loads(out)["sections"] for t in section["tables"]}
    assert tables.get("tones"), "report compares no impedance"
    tone, card = tables["tones"][0], tables["identifiability"][0]
    return Answer(
        {"drawn": _scaled(1e-12, tone["C from"], tone["C to"])},
        {"drawn": {"worse": tables["specimens"][0]["R_Y to"]}},
        verdict=_scaled(1.0, card["standard error of force"], card["standard error of position"]),
    )


def fit(asked):
    """The sensor from which ``fit`` starts."""
    from sensorgen.analysis.comparison.moved import Movable

    return _of_sensor(asked, lambda design: Movable(design).sensed)


def invert(asked):
    """The sensor that ``invert`` searches."""
    from sensorgen.prediction.ladder import usual

    return _of_sensor(asked, usual)


def check(asked):
    """``check``: errors, and the gap where it is not the drawn one."""
    code, out = asked.say("check", asked.file, "--json")
    findings = json.loads(out)["findings"]
    gap = next((f for f in findings if f["rule"] == "2-printed-gap"), None)
    printed = float(re.search(r"Arachne: ([\d.]+) mm", gap["message"])[1]) if gap else None
    return Answer(
        gap={"drawn": gap["limit_mm"], "printed": (printed, printed)} if gap else {}, errors=(_errors(findings), code)
    )


def draw(asked):
    """``draw``: errors in the title block; drawing is no verdict, so the exit code counts for nothing."""
    asked.say("draw", asked.file, "-o", "drawing.svg")
    said = re.search(r"Findings: .*", (asked.folder / "drawing.svg").read_text("utf-8"))
    count = re.search(r"(\d+) errors?", said[0]) if said else None
    return Answer(errors=(int(count[1]) if count else 0, None))


def slice_(asked):
    """``slice``: errors of the drawing, of what is printed, and of the G-code, if it writes any."""
    code, out = asked.say("slice", asked.file, "--json")
    said = json.loads(out)
    found = [*said.get("design_findings", []), *said.get("printed", {}).get("findings", []), *said["findings"]]
    return Answer(errors=(_errors(found), code))


def python(asked):
    """``sensorgen.predict``."""
    assert hasattr(sensorgen, "predict"), "there is no sensorgen.predict"
    said = sensorgen.predict(sensorgen.load(asked.file))
    return Answer({"printed": _ends(said.capacitance), "drawn": _ends(said.drawn.capacitance)})


def _of_prediction(data, errors=None):
    """A prediction as build, batch and log keep it."""
    card = data.get("identifiability")
    return Answer(
        {"drawn": _bounds(data["capacitance_f"])},
        {"drawn": _ohm(data.get("electrode_resistance_ohm"))},
        verdict=_verdict(card),
        errors=errors,
    )


def _of_sensor(asked, sensed_of):
    from sensorgen.core.errors import SensorgenError
    from sensorgen.design.design import make

    try:
        sensed = sensed_of(make(json.loads(asked.file.read_text("utf-8"))))
    except SensorgenError:
        return Answer({"drawn": None}, {"drawn": {}})
    bounds = sensed.unloaded.answer.capacitance_f
    return Answer({"drawn": (bounds.lower, bounds.upper)}, {"drawn": {"both": sensed.sensor.resistance_ohm()}})


def _bounds(data):
    return (data["lower"], data["upper"]) if isinstance(data, dict) else None


def _scaled(factor, *values):
    return None if None in values else tuple(value * factor for value in values)


def _ends(bounds):
    return (bounds.lower, bounds.upper)


def _per_area(data, area_m2, lower, upper):
    return tuple(data[end] * area_m2 for end in (lower, upper))


def _ohm(ends):
    return {**ends, "worse": max(ends.values()), "both": sum(ends.values())} if ends else {}


def _verdict(card):
    """Standard errors of force [N] and position [mm]."""
    return (card["sigma_force_n"], card["sigma_position_m"] * 1e3) if card and "sigma_force_n" in card else None


def _errors(findings):
    return sum(f["severity"] == "error" for f in findings)


def _data(row):
    return row["data"] if isinstance(row["data"], dict) else json.loads(row["data"])


def _rows(table):
    names = [column["name"] for column in table["columns"]]
    return [dict(zip(names, row, strict=True)) for row in table["rows"]]


# ---- who is asked for what, and what differs today -------------------------------------------------------------------

ASKED = {
    "capacitance drawn": (predict_as_printed, build, cell, compress, batch, log_predict, log_show, report, fit, invert,
                          python),
    "capacitance printed": (build, batch, log_predict, log_show, report, fit, invert, python),
    "resistance drawn": (predict_as_printed, build, batch, log_predict, log_show, report, fit, invert),
    "resistance printed": (build, batch, log_predict, log_show, report, fit, invert),
    "gap drawn": (build, check, batch, log_predict, log_show, report),
    "gap printed": (build, check, batch, log_predict, log_show, report),
    "verdict": (build, log_predict, log_show, report),
    "errors": (build, check, batch, draw, slice_),
}  # fmt: skip
ALL = tuple(DESIGNS)
SOLVED = ("trix", "triy", "rect", "own", "compensated", "upside-down")  # a cell that no closed form has
PRISMS = ("trix", "triy", "own", "compensated", "upside-down")  # of which the slicer drops layers
UNNAMED = ("rect", "reference", "double")  # whose gap is printed as drawn

CHEAP = "goes by the bounds of columns"
OWN_ACCURACY = "asks the cell for another accuracy"
SILENT = "says nothing of the print"
SILENT_GAP = "says nothing of the gap"
UNAWARE = "does not count what is not printed"
RED = {  # who differs today, why, and for which designs: what is mended has to go from here, as xfail is strict
    "capacitance drawn": {
        "predict_as_printed": ("asks the cell another time, and has other digits from the ninth on", PRISMS),
        "build": (CHEAP, SOLVED),
        "cell": (OWN_ACCURACY, SOLVED),
        "compress": (f"{OWN_ACCURACY}; of the own design it takes whole periods only", SOLVED),
        "batch": (OWN_ACCURACY, SOLVED),
        "log_predict": (CHEAP, SOLVED),
        "log_show": ("the log has a prediction of the bed and another one of the design", SOLVED),
        "report": (f"{CHEAP}, and by the design that the specimen's name stands for", SOLVED),
        "fit": (CHEAP, SOLVED),
        "python": ("there is no Python API", ALL),
    },
    "capacitance printed": {
        "build": (SILENT, ALL),
        "batch": (f"{SILENT} unless it slices", ALL),
        "log_predict": (SILENT, ALL),
        "log_show": (SILENT, ALL),
        "report": (SILENT, ALL),
        "fit": (SILENT, ALL),
        "invert": (SILENT, ALL),
        "python": ("there is no Python API", ALL),
    },
    "resistance drawn": {
        "predict_as_printed": ("predict has no resistance where it has no capacitance", ("double",)),
        "report": ("has a resistance of its own, by the design that the specimen's name stands for", ("double", "own")),
    },
    "resistance printed": {
        "build": (SILENT, ALL),
        "batch": (f"{SILENT} unless it slices", ALL),
        "log_predict": (SILENT, ALL),
        "log_show": (SILENT, ALL),
        "report": (SILENT, ALL),
        "fit": (SILENT, ALL),
        "invert": (SILENT, ALL),
    },
    "gap drawn": {
        "build": (SILENT_GAP, ALL),
        "check": ("names the gap only where it is printed otherwise", UNNAMED),
        "batch": (SILENT_GAP, ALL),
        "log_predict": (SILENT_GAP, ALL),
        "log_show": (SILENT_GAP, ALL),
        "report": (SILENT_GAP, ALL),
    },
    "gap printed": {
        "build": (SILENT_GAP, ALL),
        "check": ("names the gap only where it is printed otherwise", UNNAMED),
        "batch": (f"{SILENT_GAP} unless it slices", ALL),
        "log_predict": (SILENT_GAP, ALL),
        "log_show": (SILENT_GAP, ALL),
        "report": (SILENT_GAP, ALL),
    },
    "verdict": {
        "build": (CHEAP, SOLVED),
        "log_predict": (CHEAP, SOLVED),
        "log_show": (CHEAP, SOLVED),
        "report": (CHEAP, SOLVED),
    },
    "errors": {
        "build": (UNAWARE, PRISMS),
        "check": (UNAWARE, PRISMS),
        "batch": (f"{UNAWARE} unless it slices", PRISMS),
        "draw": (f"{UNAWARE} unless --as-printed", PRISMS),
    },
}


def cases():
    """Every quantity by every entry point, of the designs that are red today apart from the others."""
    for quantity, entries in ASKED.items():
        for entry in entries:
            name = f"{quantity}-{entry.__name__.strip('_')}"  # slice_
            why, red = RED[quantity].get(entry.__name__, ("", ()))
            if green := [design for design in DESIGNS if design not in red]:
                yield pytest.param(quantity, entry, green, id=name)
            if red:
                marked = pytest.mark.xfail(strict=True, raises=AssertionError, reason=f"{why}: {', '.join(red)}")
                yield pytest.param(quantity, entry, red, id=f"{name}-differs", marks=marked)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """The designs, each asked everything at most once."""
    made = {}

    def of(name):
        return made.setdefault(name, Asked(name, tmp_path_factory.mktemp(name)))

    return of


@pytest.fixture(autouse=True)
def _solved_once(_cache, monkeypatch, tmp_path_factory):
    """What is solved is kept for all tests of this file."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path_factory.getbasetemp() / "one-answer"))


@pytest.mark.parametrize(("quantity", "entry", "designs"), list(cases()))
def test_whoever_is_asked_says_the_same(quantity, entry, designs, asked, monkeypatch, program):
    if entry is slice_:
        program("prusa-slicer", "prusa-slicer")
    differing = {}
    for name in designs:
        design = asked(name)
        monkeypatch.setenv("SENSORGEN_LOG", str(design.folder / "log.db"))
        wanted = _of(predict(design), quantity)
        try:
            found = _of(entry(design), quantity)
        except AssertionError as error:
            found = str(error).partition("\n")[0]
        if not _same(wanted, found):
            differing[name] = (found, wanted)
    assert not differing, "\n".join(f"{k}: {v[0]}, but predict says {v[1]}" for k, v in differing.items())


def _of(answer, quantity):
    name, _, body = quantity.partition(" ")
    value = getattr(answer, name)
    return value.get(body, "does not say") if body else value


def _same(wanted, found):
    """Equal but for rounding of the last digit; of what one of both does not tell apart, what both tell."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        return (
            set(found) <= set(wanted) and bool(found) == bool(wanted) and all(_same(wanted[k], found[k]) for k in found)
        )
    if isinstance(wanted, tuple) and isinstance(found, tuple):
        return len(wanted) == len(found) and all(b is None or _same(a, b) for a, b in zip(wanted, found, strict=True))
    if isinstance(wanted, float | int) and isinstance(found, float | int):
        return math.isclose(wanted, found, rel_tol=1e-12)
    return wanted == found


def test_a_digit_is_a_difference():
    assert _same({"top": 1.0, "both": 3.0}, {"both": 3.0})
    assert _same((2, 1), (2, None))
    assert not _same((6.419105947e-11, 6.4e-11), (6.419105974e-11, 6.4e-11))
    assert not _same({"both": 3.0}, {"both": 3.000001})
    assert not _same({"both": 3.0}, {})
    assert not _same((1.0, 2.0), None)
    assert not _same(None, "does not say")


REFERENCE = json.loads((Path(__file__).parent / "reference" / "cells.json").read_text("utf-8"))
PERIODS, CELLS = 10e-3 * 50, 5 * 50  # of 2 mm: metres of prism, and cells of 2 x 2 mm, in 100 x 10 mm
TRUE_F = {
    "trix": REFERENCE["tri"][1]["C_F_per_m"] * PERIODS,
    "triy": REFERENCE["tri"][1]["C_F_per_m"] * PERIODS,
    "rect": REFERENCE["rect"][0]["C_F"] * CELLS,
    "reference": REFERENCE["plate"]["C_F_per_m2"] * 1e-3,
    "upside-down": REFERENCE["tri"][1]["C_F_per_m"] * PERIODS,
}


@pytest.mark.parametrize("name", TRUE_F)
def test_the_answer_holds_the_independent_solution(name, asked, monkeypatch):
    """Bounds of the drawing, no wider than 1 %, hold what other programs have solved."""
    low, high = predict(asked(name)).capacitance["drawn"]
    assert low * (1 - 3e-5) <= TRUE_F[name] <= high * (1 + 3e-5)
    assert high / low < 1.01


def test_a_design_of_which_nobody_says_anything_is_no_agreement(asked):
    """None beside None is the same answer, so all but the double sensor must have one."""
    for name in DESIGNS:
        answer = predict(asked(name))
        assert (answer.capacitance["drawn"] is None) == (name == "double")
        assert (answer.verdict is None) == (name == "double")
