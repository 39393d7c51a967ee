"""Designs through the real slicers, once for all tests."""

import shutil
from pathlib import Path

import pytest

from sensorgen.asprinted.printed import body
from sensorgen.design import design
from sensorgen.export import slicing
from sensorgen.export.gcode import motion as paths
from sensorgen.export.slicers import cura as curaengine
from sensorgen.export.slicers import prusa

SIZES = {"tri": {"length_mm": 12.0, "width_mm": 8.0}, "rect": {"length_mm": 8.0, "width_mm": 8.0}}


def small(shape="tri", parameters=None, **more):
    given = ({"dielectric_mm": 0.1} | SIZES[shape] if shape in SIZES else {}) | (parameters or {})
    return design.make({"shape": shape, "parameters": given, **more})


@pytest.fixture(scope="session")
def real(tmp_path_factory):
    """A design's G-code by a way of walls, or a skip where the slicer is not installed."""
    known = {}

    def read(walls="arachne", variant=None):
        variant = variant or small()
        key = (walls, variant.id())
        if key not in known:
            program = "CuraEngine" if walls.startswith("cura") else "prusa-slicer"
            if shutil.which(program) is None:
                pytest.skip(f"{program} is not installed")
            folder = tmp_path_factory.mktemp("sliced")
            raw, version = SLICED[walls](variant, folder)
            known[key] = (paths.read(raw, variant.machine, "slicer"), version)
        return variant, *known[key]

    return read


@pytest.fixture(scope="session")
def printed(real):
    """What is printed of a design, by a way of walls."""
    known = {}

    def read(walls="arachne", variant=None):
        variant, lines, version = real(walls, variant)
        key = (walls, variant.id())
        if key not in known:
            known[key] = body(variant, lines, slicer=f"{walls} {version}")
        return variant, known[key]

    return read


def by_prusa(variant, folder):
    made = slicing.sliced([slicing.alone(variant)], "prusa", folder)
    return made.raw, made.version


def by_prusa_with(old, new):
    """PrusaSlicer with one line of the profile changed."""

    def run(variant, folder):
        made = slicing.sliced([slicing.alone(variant)], "prusa", folder)
        profile = folder / "profile.ini"
        text = profile.read_text()
        assert old in text
        profile.write_text(text.replace(old, new))
        prusa.slice_3mf(folder / "plate.3mf", profile, folder / "changed.gcode")
        return folder / "changed.gcode", made.version

    return run


def by_cura(variant, folder):
    made = slicing.sliced([slicing.alone(variant)], "cura", folder)
    return made.raw, made.version


def by_plain_cura(variant, folder):
    """Cura without filling gaps between outlines, as it comes."""
    made = slicing.sliced([slicing.alone(variant)], "cura", folder)
    settings = curaengine.engine_settings(
        variant.machine, variant.layers, slicing.plate_loads([slicing.alone(variant)])
    )
    for values in settings.tools.values():
        values["fill_outline_gaps"] = "false"
    bodies = slicing.plate_parts([slicing.alone(variant)])
    stls = [(Path(folder / f"{part.name}.stl"), part.extruder) for part in bodies]
    curaengine.slice_bodies(stls, settings, folder / "plain.gcode")
    return folder / "plain.gcode", made.version


SLICED = {
    "arachne": by_prusa,
    "classic": by_prusa_with("perimeter_generator = arachne", "perimeter_generator = classic"),
    "angle-0": by_prusa_with("fill_angle = 45", "fill_angle = 0"),
    "angle-90": by_prusa_with("fill_angle = 45", "fill_angle = 90"),
    "cura": by_plain_cura,
    "cura-gaps": by_cura,
}
