"""CAD solids: where they are, how much they hold, whether they are valid, and whether STEP keeps all of it.

build123d is loaded once, in this process: nothing else here uses its kernel.
"""

import random
import re
import warnings
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from sensorgen.core import lazy as registry
from sensorgen.core.errors import CadFailed, Unwritable
from sensorgen.design import shapes
from sensorgen.scene.geometry import solids
from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box

pytestmark = pytest.mark.kernel
COLOURS = ("#202428", "#f0e6d2", "#3080ff", "#202428")
HOSTILE = 'Größe µ € 😀 it\'s "23 triX" \\X2\\ #5 ; /* @1@ */'
L_OUTLINE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
L_CENTRE = (1.25, 0.75)  # of a 3 x 1 bar and of a 1 x 1 square upon its left end


@pytest.fixture(scope="module")
def kernel() -> ModuleType:
    """build123d, whose import warns about things that are not ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import build123d
    return build123d


def choices(params: type) -> Iterator[dict[str, str]]:
    """Each direction that a shape knows, or nothing where it knows none."""
    along = next((f for f in fields(params) if f.name == "along"), None)
    yield from ({"along": value} for value in along.metadata["choices"]) if along else ({},)


ALWAYS = ("tri", "bump", "pyramid")  # prisms, a body of revolution, a loft


def scenes() -> Iterator[Any]:
    """Every shape, small and cut off within a period; along each axis; full of support; also turned over."""
    for name in registry.names(shapes):
        shape = registry.load(shapes, name)
        marks = () if name in ALWAYS else pytest.mark.nightly
        for choice in choices(shape.Params):
            params = shape.Params(length_mm=5.3, width_mm=4.7, isolation_mm=0.1, **choice)
            made = shape.scene(params, Fill(support="bvoh"))
            label = "-".join((name, *choice.values()))
            yield pytest.param(made, id=label, marks=marks)
            yield pytest.param(made.turned_over(), id=f"{label}-turned", marks=marks)
        if name == "porous":
            continue  # its dielectric is whole layers of lines
        films = [f.name for f in fields(shape.Params) if f.name.endswith("dielectric_mm")]
        least = {f.name: f.metadata["range"][0] for f in fields(shape.Params) if f.name in films}
        bare = shape.Params(length_mm=5.3, width_mm=4.7, **least)  # tri: feet touch along edges
        yield pytest.param(shape.scene(bare, Fill()), id=f"{name}-no-film", marks=marks)


def colours(scene: Scene) -> dict[str, str]:
    return {body.name: COLOURS[k % len(COLOURS)] for k, body in enumerate(scene.bodies)}


def in_space(axis: str, u: float, v: float, w: float) -> tuple[float, float, float]:
    """The point (u, v) of an outline's plane, at w on its axis; written out by axis [mm]."""
    return {"x": (w, u, v), "y": (u, w, v), "z": (u, v, w)}[axis]


def centre(body: Body) -> tuple[float, ...]:
    """Centre of mass of all pieces [mm]."""
    found = [_moment(piece) for piece in body.pieces]
    return tuple(sum(volume * place[k] for volume, place in found) / sum(v for v, _ in found) for k in range(3))


def _moment(piece: Any) -> tuple[float, tuple[float, ...]]:
    """Volume and centre of a piece: of a prism from its corners, of others on their axis or from tetrahedra [mm]."""
    if isinstance(piece, Revolved):
        (low, high), (at, weight) = piece.span("z"), np.polynomial.legendre.leggauss(8)
        heights = (low + high) / 2 + at * (high - low) / 2
        below = np.array([piece.volume_mm3(low, z) for z in heights]) @ weight * (high - low) / 2
        volume = piece.volume_mm3()
        return volume, (piece.x_mm, piece.y_mm, high - below / volume)
    if isinstance(piece, Loft):
        corners = np.array(piece.polyhedron().vertices)[np.array(piece.polyhedron().triangles)]
        volumes = np.linalg.det(corners) / 6
        return volumes.sum(), tuple(volumes @ corners.sum(1) / 4 / volumes.sum())
    return _prism_moment(piece)


def _prism_moment(prism: Prism) -> tuple[float, tuple[float, ...]]:
    """Written out by axis."""
    points = prism.outline
    area = cu = cv = 0.0
    for (u0, v0), (u1, v1) in zip(points, points[1:] + points[:1], strict=True):
        cross = u0 * v1 - u1 * v0
        area, cu, cv = area + cross / 2, cu + (u0 + u1) * cross / 6, cv + (v0 + v1) * cross / 6
    middle = (prism.start_mm + prism.end_mm) / 2
    return area * (prism.end_mm - prism.start_mm), in_space(prism.axis, cu / area, cv / area, middle)


def spans(body: Body) -> list[float]:
    """Lowest x, y, z and highest x, y, z [mm]."""
    low = [min(p.span(axis)[0] for p in body.pieces) for axis in "xyz"]
    return low + [max(p.span(axis)[1] for p in body.pieces) for axis in "xyz"]


def box_of(shape: Any) -> list[float]:
    around = shape.bounding_box(optimal=True)
    return [*around.min, *around.max]


def middle_of(shape: Any) -> tuple[float, ...]:
    """Centre of mass of all solids of a shape [mm]."""
    pieces = shape.solids()
    total = sum(piece.volume for piece in pieces)
    return tuple(sum(p.volume * tuple(p.center())[k] for p in pieces) / total for k in range(3))


def faults(body: Body, shape: Any) -> list[str]:
    """What differs between a body and its CAD shape."""
    pieces = shape.solids()
    wrong = [f"{len(pieces)} solids"] if len(pieces) != len(body.pieces) else []
    wrong += ["invalid"] if not all(piece.is_valid for piece in pieces) else []
    wrong += ["volume"] if sum(p.volume for p in pieces) != pytest.approx(body.volume_mm3(), rel=1e-9) else []
    wrong += ["box"] if box_of(shape) != pytest.approx(spans(body), abs=1e-6) else []
    wrong += ["centre"] if middle_of(shape) != pytest.approx(centre(body), abs=1e-9) else []
    return wrong


@pytest.mark.parametrize("scene", list(scenes()))
def test_bodies_are_valid_whole_and_in_place(kernel: ModuleType, scene: Scene) -> None:
    assert {body.name: faults(body, solids.part(body)) for body in scene.bodies} == {b.name: [] for b in scene.bodies}


@pytest.mark.parametrize("scene", list(scenes()))
def test_step_reads_back(kernel: ModuleType, scene: Scene, tmp_path: Path) -> None:
    solids.write_step(scene, colours(scene), "title", tmp_path / "a.step")
    read = kernel.import_step(tmp_path / "a.step")
    assert read.label == "title"
    assert [shape.label for shape in read.children] == [body.name for body in scene.bodies]
    assert {s.label: "#" + "".join(f"{round(255 * c):02x}" for c in tuple(s.color)[:3]) for s in read.children} == (
        colours(scene)
    )
    for body, shape in zip(scene.bodies, read.children, strict=True):
        assert faults(body, shape) == [], body.name


@pytest.mark.parametrize("axis", "xyz")
def test_an_l_lands_in_its_place(kernel: ModuleType, axis: str) -> None:
    made = solids.solid(Prism(axis, L_OUTLINE, 10.0, 12.0))
    assert tuple(made.center()) == pytest.approx(in_space(axis, *L_CENTRE, 11.0), abs=1e-12)
    assert box_of(made) == pytest.approx([*in_space(axis, 0, 0, 10), *in_space(axis, 3, 2, 12)], abs=1e-6)
    assert made.volume == pytest.approx(8.0, rel=1e-12)
    assert made.is_inside(in_space(axis, 2.9, 0.5, 11.0))
    assert not made.is_inside(in_space(axis, 2.0, 1.5, 11.0))


def mirrored(prism: Prism, point: tuple[float, float]) -> tuple[float, float, float]:
    """A planted fault: x of a y-prism runs backwards, as for one who takes (x, z, y) for right-handed."""
    return 3.0 - point[0], prism.start_mm, point[1]


def swapped(prism: Prism, point: tuple[float, float]) -> tuple[float, float, float]:
    """A planted fault: the outline lies in (z, x)."""
    return point[1], prism.start_mm, point[0]


@pytest.mark.parametrize("fault", [mirrored, swapped])
def test_a_misplaced_y_prism_is_noticed(kernel: ModuleType, monkeypatch: pytest.MonkeyPatch, fault: Any) -> None:
    body = Body("l", "etpu", (Prism("y", L_OUTLINE, 10.0, 12.0),))
    assert faults(body, solids.part(body)) == []
    monkeypatch.setattr(solids, "_corner", fault)
    assert "centre" in faults(body, solids.part(body))


@pytest.mark.parametrize("axis", "xyz")
def test_what_cannot_be_made_is_named(kernel: ModuleType, axis: str, tmp_path: Path) -> None:
    """Too thin for the kernel; what encloses nothing is no prism at all."""
    outline = ((0.0, 0.0), (1e-8, 0.0), (1e-8, 1.0), (0.0, 1.0))
    good = box(0, 1, 0, 1, 0, 1)
    body = Body("cog", "etpu", (good, Prism(axis, outline, 4.0, 5.0)))
    words = rf"cannot make cog \(etpu\), prism 2 of 2, \d corners along {axis} at .*{axis} 4 to 5"
    with pytest.raises(CadFailed, match=words) as caught:
        solids.write_step(Scene((body,), (1, 1, 1)), {"cog": "#202428"}, "t", tmp_path / "a.step")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "a.step").exists()


def test_the_kernels_own_words_are_kept(kernel: ModuleType) -> None:
    with pytest.raises(CadFailed, match="z 1 to 1 mm: BRepSweep"):
        solids.part(Body("flat", "etpu", (box(0, 1, 0, 1, 1, 1),)))


def test_a_last_edge_of_half_a_nanometre_is_an_edge(kernel: ModuleType) -> None:
    outline = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 5e-7))
    assert solids.solid(Prism("y", outline, 0.0, 1.0)).is_valid


def one_box(**changes: Any) -> Scene:
    return Scene((replace(Body("film", "x60", (box(0, 2, 0, 1, 0, 0.1),)), **changes),), (2, 1, 0.1))


@pytest.mark.parametrize("title", [HOSTILE, "", "line\nbreak\ttab", "x" * 300])
def test_any_title_and_name(kernel: ModuleType, title: str, tmp_path: Path) -> None:
    scene = one_box(name=title)
    path = tmp_path / f"{title[:20].replace('/', '')} ü.step".replace("\n", "")
    solids.write_step(scene, {title: "#202428"}, title, path)
    path.read_bytes().decode("ascii")
    read = kernel.import_step(path)
    # import_step replaces some characters, for the sake of a viewer of its authors
    seen = "".join(c for c in title if c not in "\n\t").translate(str.maketrans(" .()", "____"))
    assert (read.label, read.children[0].label) == (seen, seen)
    assert read.children[0].volume == pytest.approx(0.2, rel=1e-9)


def test_the_file_says_ap214_and_millimetres(kernel: ModuleType, tmp_path: Path) -> None:
    solids.write_step(one_box(), {"film": "#f0e6d2"}, "t", tmp_path / "a.step")
    text = (tmp_path / "a.step").read_text("ascii")
    assert "AUTOMOTIVE_DESIGN { 1 0 10303 214" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert solids.TIME_STAMP in text
    assert not re.search(r"'@\d+@'", text)


def test_each_number_in_the_file_names_one_thing(kernel: ModuleType, tmp_path: Path) -> None:
    tri = registry.load(shapes, "tri")
    scene = tri.scene(tri.Params(length_mm=5.3), Fill(support="bvoh"))
    solids.write_step(scene, colours(scene), "t", tmp_path / "a.step")
    data = (tmp_path / "a.step").read_text("ascii").partition("DATA;")[2]
    defined = [int(n) for n in re.findall(r"^#(\d+) = ", data, re.MULTILINE)]
    assert defined == list(range(1, len(defined) + 1))
    assert {int(n) for n in re.findall(r"#(\d+)", data)} == set(defined)


@pytest.mark.parametrize("seed", range(2))
def test_order_in_memory_does_not_show(seed: int) -> None:
    """The kernel writes each body's colours as one block; which comes first, and so all numbers, is chance."""
    bodies = [(1, "0.1"), (2, "0.2"), (3, "0.1")]
    plain, shuffled = colour_blocks(bodies), colour_blocks(random.Random(seed).sample(bodies, 3))
    assert solids._in_order(shuffled) == solids._in_order(plain)


def colour_blocks(bodies: list[tuple[int, str]]) -> bytes:
    """Blocks of colours as the kernel writes them; a later block refers to a colour that an earlier one has."""
    lines, known = [], {}
    for context, colour in bodies:
        number = 10 + len(lines)
        shared = known.setdefault(colour, number + 2)
        lines.append(f"#{number} = {solids._COLOURS.decode()}'',(\n  #{number + 1}),#{context});\n")
        lines.append(f"#{number + 1} = STYLED_ITEM('color',(#{shared}),#{context + 3});\n")
        lines += [f"#{number + 2} = COLOUR_RGB('',{colour},0.,0.);\n"] if shared == number + 2 else []
    return "".join(lines).encode()


def test_no_folder_no_colour_no_body(kernel: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(Unwritable, match=r"nowhere/a\.step.*No such file"):
        solids.write_step(one_box(), {"film": "#f0e6d2"}, "t", tmp_path / "nowhere" / "a.step")
    with pytest.raises(CadFailed, match="'film' has no colour; colours are given for: foil"):
        solids.write_step(one_box(), {"foil": "#f0e6d2"}, "t", tmp_path / "a.step")
    with pytest.raises(CadFailed, match="'t' has no bodies"):
        solids.write_step(Scene((), (1, 1, 1)), {}, "t", tmp_path / "a.step")
