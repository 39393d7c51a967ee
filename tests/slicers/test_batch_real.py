"""Plates of a batch in the hands of the real slicers: everything is printed where the record says, and nothing else."""

import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from no_numbers import nothing, roughly_at_rest
from sensorgen.core import yamlfile
from sensorgen.core.errors import SlicerFailed
from sensorgen.design import design
from sensorgen.design.printer import load_printer, tower
from sensorgen.export.gcode import motion as paths
from sensorgen.measure.log import prints
from sensorgen.measure.log.entries import Prediction, RawFile
from sensorgen.prediction import quantities
from sensorgen.workflows.batch import labelling, make
from sensorgen.workflows.batch.record import RECORD
from sensorgen.workflows.sealed import batch_differences

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "film-study.yaml"
MACHINE = load_printer("diabase-h5")


def read(folder):
    """The record of a batch."""
    return json.loads((folder / RECORD).read_text("utf-8"))


SMALL = """\
iteration: 26
seed: 3
designs:
  - {shape: tri, parameters: {length_mm: 12, width_mm: 10}, replicates: 2}
  - {shape: reference, parameters: {length_mm: 12, width_mm: 10}}
slicers: [prusa, cura]
layout: {kind: column}
labels: {tab: true}
"""
LINE_MM = 0.44


@pytest.fixture(scope="module")
def without_press(tmp_path_factory):
    """Makes a batch whose predictions are rough, without a load; they are kept for all."""
    cache = str(tmp_path_factory.mktemp("unpressed"))

    def run(plan, out, **more):
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(sys.modules, "netgen", None)
            patch.setenv("SENSORGEN_CACHE", cache)
            with roughly_at_rest():
                return make(plan, out, **more)

    return run


@pytest.fixture(scope="module")
def made(without_press):
    """Makes a batch of a plan's text."""

    def run(folder, text):
        path = folder / "plan.yaml"
        path.write_text(text, "utf-8")
        return without_press(path, folder / "out")

    return run


def needed(*programs):
    """Skip where a slicer is not installed, but never on CI."""
    missing = [p for p in programs if shutil.which(p) is None]
    if missing and not os.environ.get("CI"):
        pytest.skip(f"{missing[0]} is not installed")


@pytest.fixture(scope="module")
def small(tmp_path_factory, made):
    needed("prusa-slicer", "CuraEngine")
    return made(tmp_path_factory.mktemp("small"), SMALL)


@pytest.fixture(scope="module", params=["short", pytest.param("whole", marks=pytest.mark.nightly)])
def twenty(request, tmp_path_factory, without_press):
    """Twenty sensors of three designs on one plate, 14 mm long, or the example as it stands; and their length [mm].

    No test of these looks at a prediction.
    """
    needed("prusa-slicer")
    folder = tmp_path_factory.mktemp("twenty")
    if request.param == "whole":
        return without_press(EXAMPLE, folder / "out"), 100.0
    data = yamlfile.read(EXAMPLE)
    data["designs"] = [{**data["designs"][k], "replicates": count} for k, count in ((0, 7), (3, 7), (4, 6))]
    for each in data["designs"]:
        given = yamlfile.read(EXAMPLE.parent / each.pop("design")) if "design" in each else each
        each |= {"shape": given["shape"], "parameters": given["parameters"] | {"length_mm": 14.0, "width_mm": 10.0}}
    (folder / EXAMPLE.name).write_text(json.dumps(data), "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(quantities, "prediction", nothing)
        patch.setenv("SENSORGEN_CACHE", str(folder / "cache"))
        return make(folder / EXAMPLE.name, folder / "out"), 14.0


def printed_by(batch, slicer):
    """Lines of the bodies, and for each specimen which of them lie within its place on the record."""
    lines = paths.read(batch.folder / read(batch.folder)["slicers"][slicer]["gcode"], MACHINE).model()
    middle = (lines.start_mm + lines.end_mm)[:, :2] / 2
    inside = {}
    for name, s in read(batch.folder)["specimens"].items():
        inside[name] = (np.abs(middle - s["centre_mm"]) <= np.array(s["size_mm"]) / 2 + 0.05).all(axis=1)
    return lines, inside


def volumes(lines, rows):
    volume = lines.volume_mm3(MACHINE.filament_mm)
    return {tool: float(volume[rows & (lines.tool == tool)].sum()) for tool in (3, 4)}


def solid(name, tab_mm3):
    shape = "tri" if "tri" in name else "reference"
    sensor = design.make({"shape": shape, "parameters": {"length_mm": 12.0, "width_mm": 10.0}})
    found = {3: 0.0, 4: tab_mm3}
    for body in sensor.printed.bodies:
        found[sensor.tool(body.material)] += body.volume_mm3()
    return found


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_every_line_lies_within_one_specimen(small, slicer):
    lines, inside = printed_by(small, slicer)
    assert len(lines) > 1000
    assert (np.sum(list(inside.values()), axis=0) == 1).all()


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_every_specimen_is_printed_whole_with_both_tools_and_its_tab(small, slicer):
    lines, inside = printed_by(small, slicer)
    for name, rows in inside.items():
        length_mm = read(small.folder)["specimens"][name]["size_mm"][0]
        sensor = design.make({"shape": "tri", "parameters": {"length_mm": 12.0, "width_mm": 10.0}})
        (label,) = labelling.bodies(sensor, name)
        assert length_mm == pytest.approx(12 + labelling.size_mm(sensor, name)[0])
        printed, exact = volumes(lines, rows), solid(name, label.volume_mm3())
        for tool, volume in exact.items():
            assert printed[tool] == pytest.approx(volume, rel=0.12), (name, tool)
        # Raised letters: X60 above the tab's plate and beyond the sensor's end.
        centre = read(small.folder)["specimens"][name]["centre_mm"][0]
        end = centre - length_mm / 2 + 12
        above = rows & (lines.start_mm[:, 0] > end + LINE_MM) & (lines.end_mm[:, 2] > labelling.PLATE_MM + 0.05)
        assert (lines.tool[above] == 4).all()
        letters = sum(p.volume_mm3() for p in label.pieces[1:])
        assert volumes(lines, above)[4] == pytest.approx(letters, rel=0.35), name


def test_all_but_the_gcode_is_the_same_without_slicing(small, tmp_path, without_press):
    path = tmp_path / "plan.yaml"
    path.write_text(SMALL, "utf-8")
    files = without_press(path, tmp_path / "out", gcode=False).record.files
    assert {name: read(small.folder)["files"][name] for name in files} == files
    more = {"plan.prusa.gcode", "plan.cura.gcode", "prusa/raw.gcode", "prusa/profile.ini", "cura/raw.gcode"}
    assert set(read(small.folder)["files"]) - set(files) == more | {"cura/settings.json"}


def test_twenty_sensors_in_one_file(twenty):
    batch, _ = twenty
    inside = printed_by(batch, "prusa")[1]
    assert len(inside) == 20
    assert (np.sum(list(inside.values()), axis=0) == 1).all()
    assert all(rows.sum() > 500 for rows in inside.values())
    assert not batch_differences(batch.folder, RECORD)


def test_skirt_and_tower_stay_on_the_bed_and_off_the_specimens(twenty):
    batch, _ = twenty
    everything = paths.read(batch.folder / "film-study.prusa.gcode", MACHINE)
    ways = everything.of(everything.length_mm() > 0)
    half = np.array(MACHINE.bed_mm) / 2
    assert (np.abs(ways.end_mm[:, :2]) <= half).all()
    names = np.array(ways.kinds)[ways.kind]
    tower_rows = np.char.startswith(names.astype(str), "wipe tower")
    assert tower_rows.any()
    (kept,) = read(batch.folder)["tower"]
    at = ways.end_mm[tower_rows][:, :2]
    assert (at >= [kept["x0"] - 1, kept["y0"] - 1]).all()
    assert (at <= [kept["x1"] + 1, kept["y1"] + 1]).all()
    place = tower(MACHINE, design.make({"shape": "tri"}).layers, 2)
    assert (kept["x0"], kept["y1"]) == (place.x_mm - 2, place.y_mm + place.side_mm + 2)


def test_the_record_names_slicer_profile_and_gcode(small):
    slicers = json.loads((small.folder / RECORD).read_text("utf-8"))["slicers"]
    assert set(slicers) == {"prusa", "cura"}
    for used in slicers.values():
        assert used["version"][0].isdigit()
        assert {used["gcode"], used["raw"], used["profile"]} <= set(read(small.folder)["files"])
    assert not batch_differences(small.folder, RECORD)
    assert not [p for p in small.folder.rglob("*") if p.suffix in (".stl", ".part")]


def stand_in(folder, monkeypatch, script):
    """A program that goes by the slicer's name."""
    path = folder / "bin" / "prusa-slicer"
    path.parent.mkdir()
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    monkeypatch.setenv("PATH", f"{path.parent}:/usr/bin:/bin")


def test_each_designs_prediction_is_that_of_the_first_slicers_print(small):
    first = next(iter(read(small.folder)["slicers"].values()))["printed"]
    for key, found in read(small.folder)["predictions"].items():
        assert found == first[key]["prediction"]
        assert found["body"].startswith("printed, ")
        assert found["capacitance"]["value"] == pytest.approx(found["drawn"]["capacitance"]["value"], rel=0.3)


def test_the_log_keeps_the_predictions(small):
    path = small.folder / RECORD
    file = RawFile(uid="0" * 64, name=RECORD, size=path.stat().st_size)
    kept = [json.loads(row.data) for row in prints.rows(path, file) if isinstance(row, Prediction)]
    assert len(kept) == 2  # copies share one
    assert all(data in read(small.folder)["predictions"].values() for data in kept)


@pytest.mark.parametrize("slicer", ["prusa", "cura"])
def test_the_record_says_what_is_printed_of_each_design(small, slicer):
    found = read(small.folder)["slicers"][slicer]["printed"]
    assert set(found) == {piece["design_id"] for piece in read(small.folder)["specimens"].values()}
    made = {printed["design"].partition("-")[0]: printed for printed in found.values()}
    plain, prisms = made["reference"], made["trix"]
    assert all(row["ratio"] and 0.9 < row["ratio"] < 1.1 for row in plain["layers"])
    predicted, tips = plain["prediction"], prisms["prediction"]
    assert predicted["gap"]["value"] == pytest.approx(6e-4)
    assert predicted["capacitance"]["value"] == pytest.approx(predicted["drawn"]["capacitance"]["value"], rel=1e-6)
    for end, drawn in predicted["drawn"]["resistance"].items():
        assert predicted["resistance"][end]["value"] == pytest.approx(drawn["value"], rel=0.1)
    # PrusaSlicer drops the tips of the cogs, one layer of 0.1 mm; Cura fills them with thin lines.
    assert tips["gap"]["value"] == pytest.approx(3e-4 if slicer == "prusa" else 2e-4)
    assert sum(p.lost for plate in small.record.slicers.values() for p in plate.printed.values()) == 2
    assert small.errors()
    assert not small.errors(force=True)


def test_a_batch_that_fails_leaves_the_earlier_one_as_it_was(tmp_path, monkeypatch, without_press):
    path = tmp_path / "plan.yaml"
    path.write_text(SMALL, "utf-8")
    folder = without_press(path, tmp_path / "out", gcode=False).folder
    stand_in(tmp_path, monkeypatch, "exit 1")
    path.write_text(SMALL.replace("seed: 3", "seed: 4"), "utf-8")
    with pytest.raises(SlicerFailed):
        without_press(path, tmp_path / "out")
    assert not batch_differences(folder, RECORD)
    assert json.loads((folder / RECORD).read_text("utf-8"))["seed"] == 3
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["plan"]


def test_masses_are_those_of_what_the_plan_loads(tmp_path, monkeypatch, made):
    lines = ["; generated by PrusaSlicer 2.5.0 on some day", "M83", "T0", "G1 Z0.1 F3000", "G1 X9 Y0 E1 F1200"]
    lines.append("M0 H1")
    script = 'while [ "$1" != --output ]; do shift; done\n' + "".join(f"echo '{line}' >> \"$2\"\n" for line in lines)
    stand_in(tmp_path, monkeypatch, script)
    batch = made(tmp_path, SMALL.replace("[prusa, cura]", "[prusa]\ntools: {x60: 1, etpu: 2}"))
    (used,) = read(batch.folder)["slicers"]["prusa"]["tools"]
    assert (used["tool"], used["material"]) == (1, "x60")
    assert read(batch.folder)["tools"]["1"]["material"] == "x60"


def test_the_check_of_the_real_files_finds_no_error_and_sums_them_up(small, twenty):
    plate, length_mm = twenty
    for batch, slicer in ((small, "prusa"), (small, "cura"), (plate, "prusa")):
        used = read(batch.folder)["slicers"][slicer]
        assert [f for f in used["findings"] if f["severity"] == "error"] == []
        assert [(t["tool"], t["material"]) for t in used["tools"]] == [(3, "etpu"), (4, "x60")]
    # Twenty sensors: what is printed of each material besides purging, near the bodies' volume.
    exact = {3: 0.0, 4: 0.0}
    for name in read(plate.folder)["specimens"]:
        shape, film = ("reference", 0.6) if "SX60" in name else ("tri", float(name.split()[2][:2]))
        along = {"along": name.split()[1][-1].lower()} if shape == "tri" else {}
        sensor = design.make({"shape": shape, "parameters": {"dielectric_mm": film, "length_mm": length_mm, **along}})
        for body in sensor.printed.bodies:
            exact[sensor.tool(body.material)] += body.volume_mm3()
    area_mm2 = np.pi / 4 * MACHINE.filament_mm**2
    for t in read(plate.folder)["slicers"]["prusa"]["tools"]:
        printed = (t["filament_mm"] - t["purge_mm"]) * area_mm2
        assert printed == pytest.approx(exact[t["tool"]], rel=0.06)
