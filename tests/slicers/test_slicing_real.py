"""Every variant of the thesis, both ways up and in both qualities, through both real slicers to the printer's words.

Nine of these 72 are run each time, all by `make nightly`; and some through Debian 13's slicers, too.

Small sensors of few cells: what their G-code says does not depend on how often the pattern repeats.
"""

import re
import zipfile
from itertools import product
from pathlib import Path

import extruded
import numpy as np
import pytest

from sensorgen.core import yamlfile
from sensorgen.design import design
from sensorgen.design.printer import tower
from sensorgen.export import slicing
from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.crossings import lift
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.reading import text_of
from sensorgen.export.slicers import cura, prusa, versions
from sensorgen.export.slicing import Placed, alone, sliced
from sensorgen.export.threemf.prusa import TOWER

DESIGNS = Path(__file__).parents[2] / "designs"
VARIANTS = sorted(p.relative_to(DESIGNS).as_posix() for p in DESIGNS.rglob("*.yaml") if not p.stem.endswith("-d0"))
SIZE = {"length_mm": 6.0, "width_mm": 6.0}  # two or three cells
FILLED_IN = re.compile(rb";(TIME|Filament used|M(IN|AX)[XYZ]):")  # in the head that CuraEngine leaves unfinished
PROGRAMS = {"prusa": "prusa-slicer", "cura": "CuraEngine"}


def small(name, **more):
    data = yamlfile.read(DESIGNS / name)
    data["parameters"] = {**data.get("parameters", {}), **SIZE}
    return design.make({**data, "name": Path(name).stem, **more})


@pytest.fixture
def slicer(request, prusa_slicer, cura_engine):
    return request.param


def solid_mm3(variant):
    """Volume of the bodies of each tool."""
    solid = dict.fromkeys(map(variant.tool, variant.used()), 0.0)
    for body in variant.printed.bodies:
        solid[variant.tool(body.material)] += body.volume_mm3()
    return solid


def ratios(made, variant):
    """Printed over solid volume of each tool [-]."""
    printed = extruded.read(made.ready, variant.machine.filament_mm).model_mm3()
    return {tool: printed[tool] / volume for tool, volume in solid_mm3(variant).items()}


both = pytest.mark.parametrize("slicer", sorted(PROGRAMS), indirect=True)
# Each variant once, and each slicer with both ways up in both qualities; all others are run by `make nightly`.
NINE = {
    ("reference.yaml", "as-drawn", "fine", "prusa"),
    ("23/sqxy-d0.1.yaml", "upside-down", "extrafine", "prusa"),
    ("23/sqxy-d0.2.yaml", "as-drawn", "fine", "cura"),
    ("23/sqyx-d0.1.yaml", "upside-down", "extrafine", "cura"),
    ("23/sqyx-d0.2.yaml", "as-drawn", "fine", "prusa"),
    ("23/trix-d0.1.yaml", "upside-down", "fine", "prusa"),
    ("23/trix-d0.2.yaml", "as-drawn", "extrafine", "cura"),
    ("23/triy-d0.1.yaml", "upside-down", "fine", "cura"),
    ("23/triy-d0.2.yaml", "as-drawn", "extrafine", "prusa"),
}
EVERY = [
    pytest.param(*case, marks=() if case in NINE else pytest.mark.nightly)
    for case in product(VARIANTS, ("as-drawn", "upside-down"), ("fine", "extrafine"), sorted(PROGRAMS))
]


@pytest.mark.parametrize(("name", "orientation", "quality", "slicer"), EVERY, indirect=["slicer"])
def test_each_variant_passes_the_printers_check(name, orientation, quality, slicer, tmp_path):
    variant = small(name, orientation=orientation, quality=quality)
    made = sliced([alone(variant)], slicer, tmp_path)
    result = check(made.ready, variant.machine)
    assert result.errors(strict=True) == []
    assert {tool.tool for tool in result.tools} == {3, 4}
    assert all(tool.purge_mm > 5 for tool in result.tools)  # the tower primes both
    assert made.version.split(".")[0].isdecimal()
    assert not {b";TIME:6666", b";Filament used: 0m"} & set(made.ready.read_bytes().splitlines())
    assert ratios(made, variant) == {3: pytest.approx(1.0, abs=0.12), 4: pytest.approx(1.0, abs=0.12)}
    layers = paths.read(made.ready, variant.machine).model()
    heights = np.unique(np.round(layers.end_mm[:, 2], 4))
    assert set(heights) <= {round(z, 4) for z in variant.layers.boundaries_mm(variant.printed.size_mm[2] + 0.1)}


@both
def test_what_the_rewriting_leaves_alone(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    made = sliced([alone(variant)], slicer, tmp_path)
    before, after = paths.read(made.raw, variant.machine, "slicer"), paths.read(made.ready, variant.machine)
    for column in ("start_mm", "end_mm", "filament_mm", "tool", "kind", "layer"):
        assert np.array_equal(getattr(before, column), getattr(after, column)), column
    texts = [text_of(path).splitlines() for path in (made.raw, made.ready)]
    assert [texts[0][n - 1] for n in before.number] == [texts[1][n - 1] for n in after.number]
    feeds = [follow(path).feed_mm_min[follow(path).extruded_mm > 0] for path in (made.raw, made.ready)]
    assert feeds[0] == pytest.approx(feeds[1], abs=1e-3)
    comments = [
        [line for line in text_of(path).splitlines() if line.startswith(b";") and not FILLED_IN.match(line)]
        for path in (made.raw, made.ready)
    ]
    assert comments[0] == comments[1]


@both
@pytest.mark.parametrize("which", ["own", "newer"])
def test_two_sensors_stand_where_they_were_placed(slicer, which, newer_program, tmp_path):
    one, two = small("23/trix-d0.1.yaml"), small("23/sqxy-d0.2.yaml")
    pieces = [Placed(one, (-40.0, 10.0), "left"), Placed(two, (30.0, -20.0), "right")]
    program = newer_program(PROGRAMS[slicer]) if which == "newer" else ""
    made = sliced(pieces, slicer, tmp_path, program=program)
    assert check(made.ready, one.machine).errors(strict=True) == []
    lines = paths.read(made.ready, one.machine).model()
    assert len(lines)
    for where, middle in ((lines.end_mm[:, 0] < 0, (-40, 10)), (lines.end_mm[:, 0] > 0, (30, -20))):
        ends = lines.end_mm[where]
        low, high = ends.min(axis=0)[:2], ends.max(axis=0)[:2]
        assert (low + high) / 2 == pytest.approx(middle, abs=0.05)
        assert ((high - low > 5.4) & (high - low <= 6.0)).all()  # lines stay inside the outline


@both
def test_another_printer_keeps_its_words(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml", printer="prusa-xl5", tools={"etpu": 0, "x60": 1})
    made = sliced([alone(variant)], slicer, tmp_path)
    assert check(made.ready, variant.machine).errors() == []
    found = lift(made.raw, variant.machine)
    lifted, lifting = found.text, found.lifting
    written, before = (
        [line for line in text.splitlines() if not FILLED_IN.match(line)] for text in (made.ready.read_bytes(), lifted)
    )
    for line in before:  # the slicer's, in order; between them Z alone, where a change of tool left it unstated
        while written[0] != line:
            assert re.fullmatch(rb"G1( Z[0-9.]+)? F[0-9]+", written.pop(0))
        written.pop(0)
    assert written == []
    assert lifting.lifts > 0
    assert lifting.after.contact_mm + lifting.after.near_mm == 0
    ends = paths.read(made.ready, variant.machine).model().end_mm[:, :2]
    assert (ends.min(axis=0) + ends.max(axis=0)) / 2 == pytest.approx(variant.machine.bed_centre_mm(), abs=0.05)


@both
def test_retraction_by_the_firmware(slicer, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    control = variant.machine.control.model_copy(update={"firmware_retraction": True})
    variant.__dict__["machine"] = variant.machine.model_copy(update={"control": control})
    made = sliced([alone(variant)], slicer, tmp_path)
    motion = follow(made.ready)
    assert not (motion.filament_mm < 0).any()
    commands = [event.command for event in motion.events]
    plain = [command.code for command in commands if command.code in ("G10", "G11") and not command.words]
    assert plain.count("G10") >= plain.count("G11") > 3
    assert check(made.ready, variant.machine).errors(strict=True) == []


NEWER = {"prusa": (2, 9), "cura": (5,)}


def supported():
    """The triangles' air filled with support, on a third tool."""
    return small("23/trix-d0.2.yaml", materials={"support": "bvoh"})


@both
@pytest.mark.parametrize(
    "variant",
    [
        pytest.param(small("23/trix-d0.2.yaml"), id="tri", marks=pytest.mark.nightly),
        pytest.param(small("23/sqyx-d0.1.yaml", quality="extrafine"), id="rect"),
        pytest.param(supported(), id="support"),
    ],
)  # fmt: skip
def test_newer_slicers_pass_the_printers_check(variant, slicer, newer_program, tmp_path):
    made = sliced([alone(variant)], slicer, tmp_path, program=newer_program(PROGRAMS[slicer]))
    assert versions.parse(made.version) >= NEWER[slicer]
    assert made.findings == ()
    loaded = {variant.tool(name): name for name in variant.used()}
    assert check(made.ready, variant.machine, loaded, others_empty=True).errors(strict=True) == []
    assert all(0.93 < ratio < 1.2 for ratio in ratios(made, variant).values())
    lines = paths.read(made.ready, variant.machine)
    place = tower(variant.machine, variant.layers, len(loaded))
    names = np.array(lines.kinds)[lines.kind]
    ends = lines.end_mm[np.isin(names, ("wipe tower", "prime-tower")), :2] - (place.x_mm, place.y_mm)
    assert len(ends) > 10
    assert ((ends > -3) & (ends < place.side_mm + 3)).all()  # with its brim


def test_without_its_place_in_the_3mf_the_tower_leaves_the_bed(newer_program, tmp_path):
    variant = small("23/trix-d0.1.yaml")
    program = slicing.Runner(newer_program("prusa-slicer"))
    made = sliced([alone(variant)], "prusa", tmp_path, program=program.program)
    with zipfile.ZipFile(tmp_path / "plate.3mf") as full, zipfile.ZipFile(tmp_path / "bare.3mf", "w") as bare:
        assert TOWER in full.namelist()
        for name in set(full.namelist()) - {TOWER}:
            bare.writestr(name, full.read(name))
    prusa.slice_3mf(tmp_path / "bare.3mf", tmp_path / "profile.ini", tmp_path / "bare.gcode", program)
    reach = [
        paths.read(path, variant.machine, "slicer").end_mm[:, 1].max() for path in (made.raw, tmp_path / "bare.gcode")
    ]
    assert reach[0] < variant.machine.bed_mm[1] / 2 < reach[1]


@both
def test_a_setting_that_the_slicer_does_not_know_is_a_finding(slicer, newer_program, tmp_path, monkeypatch):
    slip, template = {"prusa": "thick_bridges", "cura": "wall_line_count"}[slicer], versions.template
    monkeypatch.setattr(
        "sensorgen.export.slicers.loads.template", lambda *at: re.sub(f"(?m)^{slip} =", f"{slip}_ =", template(*at))
    )  # fmt: skip
    prusa._templates.cache_clear(), cura._templates.cache_clear()
    made = sliced([alone(small("23/trix-d0.1.yaml"))], slicer, tmp_path, program=newer_program(PROGRAMS[slicer]))
    prusa._templates.cache_clear(), cura._templates.cache_clear()
    assert [f.rule for f in made.findings] == ["11-profile"]
    assert f"{slip}_" in made.findings[0].message


def test_options_of_the_design_reach_the_print(newer_program, tmp_path):
    infill = {"x60": {"percent": 40.0, "pattern": "gyroid"}}
    own = {"settings": {"prusa": {"nonsense": 1}}}
    profile = {"walls": "classic", "wall_lines": {"x60": 1}, "line_mm": {"x60": 0.5}} | own
    variant = small("23/trix-d0.2.yaml", infill=infill, profile=profile)
    made = sliced([alone(variant)], "prusa", tmp_path, program=newer_program("prusa-slicer"))
    assert check(made.ready, variant.machine).errors(strict=True) == []
    used = prusa.settings(made.raw.read_text())
    assert used["perimeter_generator"] == "classic"
    assert ["nonsense" in f.message for f in made.findings] == [True]
    lines = paths.read(made.ready, variant.machine).model()
    walls = np.char.find(np.array(lines.kinds)[lines.kind], "perimeter") >= 0
    widths = {tool: np.median(lines.width_mm[walls & (lines.tool == tool)]) for tool in (3, 4)}
    assert widths == {3: pytest.approx(0.44), 4: pytest.approx(0.5)}
    assert ratios(made, variant)[4] < 0.9
