"""Faults planted in sliced G-code are refused, or accepted with a reason; what slicers really write is accepted."""

import pytest
from planted import FAULTS, moved, swapped

from sensorgen.asprinted import agreement
from sensorgen.core.errors import BadInput
from sensorgen.design import design
from sensorgen.export.gcode.check import check_motion
from sensorgen.export.gcode.motion import executed, follow, paths_of
from sensorgen.export.slicing import alone, sliced

SENSOR = design.make(
    {"shape": "tri", "name": "planted", "parameters": {"dielectric_mm": 0.2, "length_mm": 6.0, "width_mm": 5.0}}
)


@pytest.fixture(scope="session")
def base(tmp_path_factory):
    """Lines of the sensor's G-code by a slicer, made once."""
    made = {}

    def lines(slicer):
        if slicer not in made:
            folder = tmp_path_factory.mktemp(slicer)
            made[slicer] = sliced([alone(SENSOR)], slicer, folder).ready.read_text().splitlines()
        return made[slicer]

    return lines


def checked(lines):
    """Of the commands and motions alone, and what :func:`found` needs more."""
    machine = SENSOR.machine
    motion = executed("\n".join(lines).encode(), machine)
    tools = {SENSOR.tool(name): name for name in SENSOR.used()}
    return check_motion(motion, machine, tools, others_empty=True), motion


def found(lines):
    """Findings as ``slice`` has them."""
    first, motion = checked(lines)
    paths, place = paths_of(motion, SENSOR.machine), SENSOR.machine.bed_centre_mm()
    made = first.with_more(agreement.check(SENSOR, paths, motion, place, alone=True)).findings
    return [f for f in made if f.rule != "support"]  # the first cogs lie over an empty layer, in every file


def refused(fault, findings, lines):
    """One of the rules that a fault is to be refused by does so, with advice and place."""
    errors = {f.rule for f in findings if f.severity == "error"}
    return errors & set(fault.expected.split()) and all(f.advice and 1 <= f.line <= len(lines) for f in findings)


def disagreement(fault, lines):
    """Outcome of the check of a fault, against what is expected; "" where they agree.

    What the check of commands and motions refuses is not compared with the design, too.
    """
    wanted, _, more = fault.expected.partition(": ")
    accepted = wanted in ("argued", "warns")
    if not accepted and refused(fault, checked(lines)[0].findings, lines):
        return ""
    findings = found(lines)
    errors = {f.rule for f in findings if f.severity == "error"}
    warnings = {f.rule for f in findings if f.severity == "warning"}
    if accepted:
        right = (errors, warnings) == (set(), {more} if wanted == "warns" else set())
    else:
        right = refused(fault, findings, lines)
    return "" if right else f"{fault.expected}: errors {errors}, warnings {warnings}"


@pytest.mark.parametrize("group", FAULTS)
def test_planted_faults_are_refused_or_argued(group, base, prusa_slicer):
    assert prusa_slicer
    lines = base("prusa")
    wrong = {fault.name: disagreement(fault, fault.edit(lines)) for fault in FAULTS[group]}
    assert {name: what for name, what in wrong.items() if what} == {}


def test_at_least_142_faults_are_refused():
    faults = [fault for group in FAULTS.values() for fault in group]
    assert len({fault.name for fault in faults}) == len(faults)
    assert sum(not fault.expected.startswith(("warns:", "argued:")) for fault in faults) >= 142


def test_a_slicers_files_are_not_refused(base, prusa_slicer, cura_engine):
    assert prusa_slicer
    assert cura_engine
    assert [f for slicer in ("prusa", "cura") for f in found(base(slicer))] == []


def test_a_file_is_checked_where_it_stands(base, prusa_slicer, tmp_path):
    assert prusa_slicer
    path, lines = tmp_path / "a.gcode", base("prusa")
    for x, y in ((0.0, 0.0), (-30.0, 12.0)):
        path.write_text("\n".join(moved(x, y, ";TYPE")(lines)))
        assert {f.rule for f in agreement.check_motion(SENSOR, follow(path))} == {"support"}
    path.write_text("\n".join(swapped(lines)))
    assert {f.rule for f in agreement.check_motion(SENSOR, follow(path))} >= {"material"}
    other = design.make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 10.0, "width_mm": 5.0}})
    with pytest.raises(BadInput, match=r"no piece of 10 x 5 mm.*off by 3.7\d mm at least"):
        agreement.check_motion(other, follow(path))
