"""Tabs with names: letters apart, wide enough to print, beside the sensor and not in it."""

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.design import design
from sensorgen.design.specimen_name import SpecimenName, parse
from sensorgen.scene import lettering
from sensorgen.scene.geometry import meshes
from sensorgen.workflows.batch import arranged, labelling

SENSOR = design.make({"shape": "tri"})
NAME = "26 triX .2mm 12 x fine"


def raised(sensor, name):
    """The raised squares of a tab as a picture of dots, the top row first."""
    (body,) = labelling.bodies(sensor, name)
    dot = labelling.dot_mm(sensor)
    length, _ = labelling.size_mm(sensor, name)
    x0 = sensor.printed.size_mm[0]
    letters = body.pieces[1:]
    top = max(p.span("y")[1] for p in letters)
    rows = round((top - min(p.span("y")[0] for p in letters)) / dot)
    picture = np.zeros((rows, round(length / dot)), bool)
    for p in letters:
        (a, b), (_, high) = p.span("x"), p.span("y")
        picture[round((top - high) / dot), round((a - x0) / dot) : round((b - x0) / dot)] = True
    return picture


def test_what_is_written_can_be_read():
    shown = ["".join(" #"[int(dot)] for dot in row).rstrip() for row in raised(SENSOR, "26 triX 7")]
    assert shown == [
        " ### ###",
        "   # #",
        " ### ###",
        " #   # #",
        " ### ###",
        "",
        " ### #### ### #   #",
        "  #  #  #  #  ## ##",
        "  #  ####  #   ###",
        "  #  # #   #  ## ##",
        "  #  # ## ### #   #",
        "",
        " ###",
        "   #",
        "   #",
        "   #",
        "   #",
    ]


@pytest.mark.parametrize(("nozzle", "line"), [(0.4, 0.44), (0.25, 0.275), (0.6, 0.66)])
def test_strokes_are_wider_than_a_line(nozzle, line):
    sensor = design.make({"shape": "tri", "nozzle_mm": nozzle, "parameters": {"width_mm": 20}})
    letters = labelling.bodies(sensor, NAME)[0].pieces[1:]
    for p in letters:
        assert min(p.span("x")[1] - p.span("x")[0], p.span("y")[1] - p.span("y")[0]) >= 1.05 * line


@pytest.mark.parametrize(("shape", "orientation"), [("tri", "upside-down"), ("rect", "as-drawn")])
def test_the_tab_touches_the_far_end_and_lies_on_the_bed(shape, orientation):
    sensor = design.make({"shape": shape, "orientation": orientation, "shrinkage": 0.2})
    (body,) = labelling.bodies(sensor, NAME)
    length, width = labelling.size_mm(sensor, NAME)
    x0, deep, _ = sensor.printed.size_mm
    spans = {axis: [p.span(axis) for p in body.pieces] for axis in "xyz"}
    assert min(a for a, _ in spans["x"]) == x0
    assert max(b for _, b in spans["x"]) == pytest.approx(x0 + length)
    assert (min(a for a, _ in spans["y"]), max(b for _, b in spans["y"])) == (0.0, deep)
    assert min(a for a, _ in spans["z"]) == 0.0
    assert width == deep
    assert body.material == "x60"


def test_the_mesh_is_closed_and_of_the_volume_of_its_boxes():
    (body,) = labelling.bodies(SENSOR, NAME)
    mesh = meshes.mesh(body)
    assert mesh.volume_mm3() == pytest.approx(body.volume_mm3(), rel=1e-9)
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}


@pytest.mark.parametrize("wanted", ["true", "false"])
def test_a_piece_has_room_for_its_tab_on_the_plate(plan, wanted):
    """As long and wide as all of its boxes together."""
    path = plan()
    path.write_text(f"{path.read_text('utf-8')}labels: {{tab: {wanted}}}\n", "utf-8")
    found = arranged(path)
    for number, rect in found.plate.items():
        piece = found.pieces[number]
        more = labelling.bodies(piece.design, piece.name) if wanted == "true" else ()
        boxes = [p for body in (*piece.design.printed.bodies, *more) for p in body.pieces]
        length, width = (max(p.span(axis)[1] for p in boxes) - min(p.span(axis)[0] for p in boxes) for axis in "xy")
        assert (rect.x1 - rect.x0, rect.y1 - rect.y0) == pytest.approx((length, width))


def test_every_name_of_the_grammar_can_be_written():
    sensor = design.make({"shape": "tri", "parameters": {"width_mm": 40}})
    for shape in ("tri", "rect", "reference", "double"):
        for slicing in ("", "fine", "x fine", "xtrafine"):
            axes = {"tri": "Y", "rect": "XY"}.get(shape, "")
            name = SpecimenName(1234567890 % 9999, shape, axes, 0.123457, 9876, slicing, "m").name
            assert labelling.bodies(sensor, parse(name).name)


def test_letters_that_look_alike_never_change_a_name():
    glyphs = lettering.FONT
    alike = {(a, b) for a in glyphs for b in glyphs if a < b and glyphs[a] == glyphs[b]}
    assert alike <= {("0", "O"), ("5", "S")}  # digits stand in numbers alone, O and S in words


def test_no_dot_of_a_letter_hangs_on_its_corners_alone():
    for letter, picture in lettering.FONT.items():
        dots = np.pad(np.array([[dot == "#" for dot in row] for row in picture.split()]), 1)
        beside = np.roll(dots, 1, 0) | np.roll(dots, -1, 0) | np.roll(dots, 1, 1) | np.roll(dots, -1, 1)
        assert dots.any(), letter
        assert (beside | ~dots).all(), letter


def test_narrow_sensors_are_told():
    thin = design.make({"shape": "tri", "parameters": {"width_mm": 2}})
    with pytest.raises(BadInput, match="2 mm wide, too little"):
        labelling.bodies(thin, NAME)
    with pytest.raises(BadInput, match="no letter '!'"):
        labelling.bodies(SENSOR, "26 triX!")
