"""One print, one verdict: every command lists the same findings, by one slice, and its exit code follows from them.

At commit bc3b8e35 ``tri`` with a film of 0.2 mm had 8 findings by ``check``, 13 by ``batch`` and the API, 16 by
``draw`` and "no findings" at the end of ``slice``; ``check`` let ``cone`` pass, which ``slice`` refused.
"""

import contextlib
import json
import re

import pytest

import sensorgen
from in_process import run
from no_numbers import nothing
from sensorgen.analysis.report import report
from sensorgen.core.findings import counts, verdict
from sensorgen.measure.log import Log, notes, prints
from sensorgen.prediction import quantities

DESIGNS = {
    "tri-lost": "shape: tri\nparameters: {dielectric_mm: 0.2, length_mm: 10, width_mm: 6}",
    "tri-y": "shape: tri\nparameters: {dielectric_mm: 0.2, along: 'y', length_mm: 10, width_mm: 6}",
    "rect": "shape: rect\nparameters: {dielectric_mm: 0.1, length_mm: 10, width_mm: 6}",
    "reference": "shape: reference\nparameters: {length_mm: 10, width_mm: 6}",
    "waived": "shape: reference\nparameters: {length_mm: 10, width_mm: 6, dielectric_mm: 0.1}\n"
    "waivers: [{rule: 2-film, reason: pinholes}]",
    "cone": "shape: cone\nparameters: {length_mm: 5, width_mm: 5}",
    "pillar": "shape: pillar\nparameters: {length_mm: 10, width_mm: 10}",
    "double": "shape: double\nparameters: {length_mm: 10, width_mm: 6}",
    "classic": "shape: tri\nprofile: {walls: classic}\nparameters: {dielectric_mm: 0.3, length_mm: 10, width_mm: 6}",
    "upside-down": "shape: reference\norientation: upside-down\nparameters: {length_mm: 10, width_mm: 6}",
}
FAST = ("tri-lost", "cone", "waived")


@pytest.fixture(scope="module")
def slices(tmp_path_factory):
    """Every design is sliced once."""
    return tmp_path_factory.mktemp("slices")


@pytest.fixture
def folder(slices, tmp_path, monkeypatch, program):
    """A folder with the designs; nothing electrical is predicted, which decides no print."""
    program("prusa-slicer", "prusa-slicer")
    monkeypatch.setenv("SENSORGEN_SLICER", "prusa")
    monkeypatch.setenv("SENSORGEN_CACHE", str(slices))
    monkeypatch.setattr(quantities, "prediction", nothing)
    monkeypatch.setattr("sensorgen.asprinted.printed.Printed.cells", property(lambda _: pytest.fail("predicted")))
    return tmp_path


def _said(out):
    """Verdict, counts and source in a text."""
    found = re.search(
        r"(CHANGE|PRINT WITH WARNINGS|PRINT)\s+\S+: (.*?); (sliced by \S+\s[^\s;]+|estimated)", _words(out)
    )
    assert found, out
    return found.groups()


def _words(text):
    return " ".join(re.sub(r"<[^>]*>", " ", text).split())


def _counted(findings):
    """Number of findings by severity, of an output's own JSON."""
    heads = ["waived" if f["waiver"] else f["severity"] for f in findings]
    return {head: heads.count(head) for head in ("error", "warning", "info", "waived")}


def _drawn_in_report(folder):
    """The drawing in the report of one reading of a specimen."""
    with Log(folder / "log.db", create=True) as log:
        prints.bind(log, ["S1"], str(folder / "d.yaml"))
        log.add([notes.reading("S1", "700", "OL", log=log)])
        made = report(log, None, specimens=["S1"])
    ((drawing,),) = [section.drawings for section in made.sections if section.drawings]
    return drawing.svg


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in FAST else pytest.mark.nightly) for n in DESIGNS]
)  # fmt: skip
def test_every_command_has_one_verdict(name, folder):
    (folder / "d.yaml").write_text(f"name: {name}\n{DESIGNS[name]}\n", "utf-8")
    with contextlib.chdir(folder):
        held = sensorgen.check(sensorgen.load("d.yaml"))
    wanted, number = held.verdict, counts(held.findings)
    assert verdict(held.findings) == wanted
    assert held.source.startswith("sliced by PrusaSlicer 2")
    code = 1 if wanted == "CHANGE" else 0

    said = run(folder, "check", "d.yaml", "--budget", "0")
    first = _said(said[1])
    assert (said[0], first[0], first[2]) == (code, wanted, held.source)
    assert sum(map(int, re.findall(r"\d+", first[1]))) == len(held.findings)
    assert len(re.findall(r"(?m)^(?:error|warning|info|waived) ", said[1])) == len(held.findings)

    built = run(folder, "build", "d.yaml", "--no-cad", "--budget", "0", "--out", "built")
    assert (built[0], _said(built[1])) == (code, first)
    detailed = run(folder, "build", "d.yaml", "--no-cad", "--budget", "0", "--out", "built", "--details")
    assert (detailed[0], _said(detailed[1])) == (code, first)
    kept = json.loads((folder / "built" / name / "check.json").read_text("utf-8"))
    assert (kept["verdict"], kept["counts"], kept["source"]) == (wanted, number, held.source)
    assert _counted(kept["findings"]) == number

    run(folder, "draw", "d.yaml", "-o", "d.svg")
    for drawing in ((folder / "d.svg").read_text("utf-8"), _drawn_in_report(folder)):
        assert f"Findings: {first[1]}" in _words(drawing)
        assert f"{wanted}; {held.source}" in _words(drawing)
    run(folder, "show", "d.yaml", "--no-open", "-o", "d.html")
    page = (folder / "d.html").read_text("utf-8")
    assert _said(page) == first
    assert len(re.findall(r'<li class="(?:error|warning|info|waived)">', page)) == len(held.findings)

    (folder / "plan.yaml").write_text("iteration: 60\ndesigns: [{design: d.yaml}]\n", "utf-8")
    batch = run(folder, "batch", "plan.yaml", "--no-gcode")
    assert (batch[0], _said(batch[1])) == (code, first)

    sliced = run(folder, "slice", "d.yaml", "--out", "sliced")
    assert (sliced[0], _said(sliced[1])) == (code, first)
    data = json.loads(next((folder / "sliced" / name).glob("*.json")).read_text("utf-8"))
    assert (data["verdict"], _counted(data["all_findings"])) == (wanted, number)
    assert data["refused"] == any(f.rule == "13-gcode" and f.severity == "error" for f in held.findings)


def test_without_a_slicer_the_estimate_says_so(folder, monkeypatch):
    (folder / "d.yaml").write_text(f"name: tri\n{DESIGNS['tri-lost']}\n", "utf-8")
    monkeypatch.setenv("SENSORGEN_SLICER", "none")
    by_hand = _said(run(folder, "check", "d.yaml", "--budget", "0")[1])
    monkeypatch.delenv("SENSORGEN_SLICER")
    monkeypatch.setenv("PATH", str(folder))
    code, out = run(folder, "check", "d.yaml", "--budget", "0")
    assert (code, _said(out)) == (1, by_hand)
    assert "estimated (PrusaSlicer, Arachne walls): no slicer installed" in _words(out)
    code, out = run(folder, "build", "d.yaml", "--no-cad", "--budget", "0")
    assert (code, _said(out)) == (1, by_hand)


def test_another_name_of_a_slicer_is_a_message(folder, monkeypatch):
    (folder / "d.yaml").write_text(f"name: tri\n{DESIGNS['reference']}\n", "utf-8")
    monkeypatch.setenv("SENSORGEN_SLICER", "prusaa")
    assert run(folder, "check", "d.yaml", "--budget", "0")[0] == 2
