"""``sensorgen import``: sensors of other CAD programs, from the file to everything that a drawn shape gets."""

import json
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import cad_models
from sensorgen.cli import WRONG_INPUT
from sensorgen.core.errors import SensorgenError
from sensorgen.design import packs
from sensorgen.design.design import load, make
from sensorgen.design.values import permittivities
from sensorgen.prediction.capacitance import capacitance
from sensorgen.scene.geometry import cad

SMALL = {"length_mm": 12.0, "width_mm": 6.0}
ROUND_TRIP = {"tri": SMALL, "rect": {**SMALL, "along": "xy"}, "reference": SMALL}
MAP = ("--map", "*=x60@1", "--map", "*electrode*=etpu@2")


@pytest.fixture(scope="module")
def kernel():
    """One CAD process for all tests of this file: loading its kernel takes seconds."""
    with cad.CadProcess() as process:
        yield process


@pytest.fixture(scope="module")
def models(tmp_path_factory, kernel):
    """STEP files by build123d itself, and of our own designs."""
    folder = tmp_path_factory.mktemp("models")
    subprocess.run([sys.executable, cad_models.__file__, str(folder)], check=True, capture_output=True)
    for name, given in ROUND_TRIP.items():
        scene = make({"shape": name, "parameters": given}).drawn
        kernel.write_step(scene, {b.name: "#202428" for b in scene.bodies}, name, folder / f"{name}.step")
    return folder


@pytest.fixture
def shared_kernel(monkeypatch, kernel):
    class Lent:
        def __enter__(self):
            return kernel

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(cad, "CadProcess", Lent)


@pytest.fixture
def plates(tmp_path):
    """Three plates as STL files; each can be damaged."""

    def write(damage=None, **at):
        heights = {"low": (0.0, 0.4), "film": (0.4, 0.6), "up": (0.6, 1.0)} | at
        for name, (z0, z1) in heights.items():
            made = trimesh.creation.box(bounds=[(0, 0, z0), (20, 10, z1)])
            made = damage(made) if damage and name == "film" else made
            made.export(tmp_path / f"{name}.stl")
        return [f"{name}.stl" for name in heights]

    return write


PLATES = ("--map", "film=x60@1", "--map", "*=etpu@2", "--map", "film=x60@1")


@pytest.mark.usefixtures("shared_kernel")
@pytest.mark.parametrize("name", ROUND_TRIP)
def test_our_own_step_is_the_design_again(run, models, name):
    """Same capacitance as the design that was exported, by models that know nothing of the import."""
    assert run("import", models / f"{name}.step", *MAP).clean
    again, drawn = load(Path(f"{name}.yaml")), make({"shape": name, "parameters": ROUND_TRIP[name]})
    assert again.drawn.size_mm == pytest.approx(drawn.drawn.size_mm, abs=1e-12)
    assert [b.terminal for b in again.drawn.bodies] == [b.terminal for b in drawn.drawn.bodies]
    assert getattr(again.params, "period_mm", None) == (2.0 if name == "tri" else None)
    eps = ({v.material: v.value for v in permittivities(d)} for d in (again, drawn))
    one, other = (capacitance(d.in_use, of, 3e-2, keep=False) for d, of in zip((again, drawn), eps, strict=True))
    assert one.model == other.model
    assert one.capacitance_f.lower == pytest.approx(other.capacitance_f.lower, rel=1e-6)
    assert one.capacitance_f.upper == pytest.approx(other.capacitance_f.upper, rel=1e-6)


@pytest.mark.usefixtures("shared_kernel")
def test_bodies_are_listed_with_a_map_to_start_from(run, models):
    said = run("import", models / "dome.step", "--list", "--json")
    found = {body["name"]: body for body in json.loads(said.out)["bodies"]}
    assert list(found) == ["base_electrode", "film", "bump", "top_electrode"]
    cap = np.pi * cad_models.RISE_MM**2 * (cad_models.BALL_MM - cad_models.RISE_MM / 3)
    assert found["bump"]["volume_mm3"] == pytest.approx(cap, rel=0.03)
    assert found["bump"]["volume_mm3"] < cap  # triangles lie inside what is round
    assert {name: body["material"] for name, body in found.items()} == {
        "base_electrode": "etpu", "film": "x60", "bump": "x60", "top_electrode": "etpu"
    }  # fmt: skip
    assert not list(Path().iterdir())


@pytest.mark.usefixtures("shared_kernel")
def test_a_round_bump_is_a_body_of_revolution_exactly(run, models):
    assert run("import", models / "dome.step", *MAP).clean
    (bump,) = load(Path("dome.yaml")).drawn.body("bump").pieces
    cap = np.pi * cad_models.RISE_MM**2 * (cad_models.BALL_MM - cad_models.RISE_MM / 3)
    assert bump.volume_mm3() == pytest.approx(cap, rel=1e-6)
    assert bump.span("x") == pytest.approx((10 - cad_models.BUMP_MM, 10 + cad_models.BUMP_MM))
    assert bump.span("z") == pytest.approx((0.6, 1.2))


@pytest.mark.usefixtures("shared_kernel")
def test_triangles_lie_as_near_as_stated(kernel, models):
    for chord in (0.05, 0.002):
        bump = next(body for body in kernel.read_step(models / "dome.step", chord) if body.name == "bump")
        corners = bump.vertices_mm[bump.triangles]
        faces = corners[(np.ptp(corners[:, :, 2], axis=1) > 1e-6)]
        share = np.random.default_rng(1).dirichlet((1, 1, 1), 50)
        inside = np.einsum("sk,fkx->fsx", share, faces).reshape(-1, 3)
        centre = np.array([15.0, 15.0, 0.6 + cad_models.RISE_MM - cad_models.BALL_MM])
        off = cad_models.BALL_MM - np.linalg.norm(inside - centre, axis=1)
        assert off.min() > -1e-6
        assert off.max() <= chord


@pytest.mark.usefixtures("shared_kernel")
def test_electrodes_get_their_ends_by_height_unless_told(run, models):
    words = ("--map", "*er=etpu@2", "--map", "film=x60@1", "--map", "carrier=x60@1")
    assert run("import", models / "crossed.step", *words).ok
    assert {b.name: b.terminal for b in load(Path("crossed.yaml")).drawn.bodies} == {
        "carrier": "", "lower": "bottom", "film": "", "upper": "top"
    }  # fmt: skip
    again = run("import", models / "crossed.step", *words).line
    assert again.endswith("crossed.yaml exists; expected --force to replace it, or another --name")
    swapped = ("--terminal", "lower=top", "--terminal", "upper=bottom", "--force")
    assert run("import", models / "crossed.step", *words, *swapped).code == 0
    assert load(Path("crossed.yaml")).drawn.body("lower").terminal == "top"
    assert "unknown terminal 'left'" in run("import", models / "crossed.step", *words, "--terminal", "lower=left").line


@pytest.mark.usefixtures("shared_kernel")
def test_bodies_that_overlap_are_refused_with_place_and_picture(run, models):
    said = run("import", models / "colliding.step", *MAP)
    assert said.code == WRONG_INPUT
    assert "film / up___Gr_e_1" in said.out
    assert "overlap by 5 mm3, 0.0971 mm deep" in said.words
    assert "x 10, y 4.5, z 0.65 mm" in said.line
    assert [path.name for path in Path().iterdir()] == ["colliding-faults.svg"]
    text = Path("colliding-faults.svg").read_text(encoding="utf-8")
    assert text.count("<circle") == 3
    assert "from above" in text


def faulty_open(made):
    """Without its top."""
    return trimesh.Trimesh(made.vertices, made.faces[made.triangles[:, :, 2].mean(1) < made.bounds[1, 2] - 1e-9])


def test_stl_files_are_repaired_and_walk_on(run, plates):
    files = plates(faulty_open)
    said = run("import", *files, "--unit", "mm", "--name", "three", *PLATES).ok
    assert "a flat opening" in said.words
    design = load(Path("three.yaml"))
    exact_first = ["--map", "film=x60@1", "--map", "*w=etpu@2", "--map", "up=etpu@2", "--map", "*=x60@1"]
    assert run("import", *files, "--unit", "mm", "--name", "other", *exact_first).code == 0
    one, other = ({b.name: b.material for b in d.drawn.bodies} for d in (design, load(Path("other.yaml"))))
    assert one == other
    assert [b.volume_mm3() for b in design.drawn.bodies] == pytest.approx([80.0, 40.0, 80.0])
    eps = {v.material: v.value for v in permittivities(design)}
    plate_f = 8.8541878128e-12 * eps["x60"] * 0.02 * 0.01 / 0.2e-3
    assert capacitance(design.in_use, eps).capacitance_f.middle() == pytest.approx(plate_f, rel=1e-9, abs=0.0)


WRONG = [
    (["--unit", "m"], "it is 20000 x 10000 x 1000 mm; expected 1 to 1000 mm"),
    (["--unit", "m"], "its numbers may be in mm (20 x 10 x 1 mm) or cm (200 x 100 x 10 mm) or inch (508 x 254 x"),
    (["--unit", "micron"], "its numbers may be in mm (20 x 10 x 1 mm) or cm (200 x 100 x 10 mm) or inch (508 x"),
    ([], "an STL has no unit; expected --unit mm"),
    (["--unit", "mm", "--map", "low=etpu@2"], "no material for film, up: give --map film=x60 --map up=MATERIAL"),
    (["--unit", "mm", *PLATES, "--map", "film=x61"], "unknown material 'x61'; did you mean 'x60'?"),
    (["--unit", "mm", *PLATES, "--map", "film=x60@2"], "tool 2 is given to both etpu and x60"),
    (["--unit", "mm", *PLATES, "--map", "low=etpu@3"], "etpu is on tools 3 and 2; expected one tool"),
    (["--unit", "mm", *PLATES, "--map", "flim=x60"], "unknown body 'flim'; did you mean 'film'?"),
    (["--unit", "mm", *PLATES, "--map", "film=x60@99"], "tools.x60: diabase-h5 has no tool 99"),
    (["--unit", "mm", "--map", "*=x60"], "no bottom and no top electrode; conductors: none"),
    (["--unit", "mm", *PLATES, "--terminal", "film=top"], "film=top: the material of film does not conduct"),
    (["--unit", "mm", *PLATES, "--terminal", "up=bottom"], "no top electrode; conductors: low, up"),
    (["--unit", "mm", *PLATES, "--chord", "5"], "--chord 5: expected 0.0001 to 1 mm"),
]


def test_wrong_words_are_one_line_and_nothing_is_written(run, plates):
    files = plates()
    before = sorted(path.name for path in Path().iterdir())
    for words, line in WRONG:
        assert line in run("import", *files, *words).refusal
    assert sorted(p.name for p in Path().iterdir() if not p.name.endswith("-faults.svg")) == before


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.step", b"", "the file is empty"),
        ("a.step", b"solid", "no STEP: it does not begin with ISO-10303-21"),
        ("a.step", b"ISO-10303-21; nothing follows", "no solids that the CAD kernel can read"),
        ("a.obj", b"v 1 2 3", "expected a file in .step, .stp, .3mf, .stl"),
        ("a.3mf", b"PK", "not a 3MF"),
    ],
)
@pytest.mark.usefixtures("shared_kernel")
def test_files_that_are_none_are_one_line(run, tmp_path, name, content, line):
    (tmp_path / name).write_bytes(content)
    assert line in run("import", name).refusal


def test_a_step_of_500_mb_is_refused_at_once(run, tmp_path):
    with (tmp_path / "big.step").open("wb") as file:
        file.truncate(500_000_000)
    assert "500 MB; expected at most 100 MB" in run("import", "big.step").line


FOUR = {"low": (0.0, 0.2), "one": (0.4, 0.6), "two": (0.8, 1.0), "up": (1.2, 1.4)}
FILMS = {"a": (0.2, 0.4), "b": (0.6, 0.8), "c": (1.0, 1.2)}
MAP_FOUR = ("--map", "a=x60@1", "--map", "b=x60@1", "--map", "c=x60@1", "--map", "*=etpu@2")


def stacked(folder, **heights):
    for name, (z0, z1) in heights.items():
        trimesh.creation.box(bounds=[(0, 0, z0), (20, 10, z1)]).export(folder / f"{name}.stl")
    return [*(f"{name}.stl" for name in heights), "--unit", "mm"]


@pytest.mark.parametrize("given", [{"low": "bottom", "one": "none", "two": "none", "up": "top"}, {"one": "none"}])
def test_terminals_that_are_given_need_no_height(run, tmp_path, given):
    """With more than three separate conductors each was asked for, even where each was given."""
    files = stacked(tmp_path, **FOUR, **FILMS)
    ends = [word for name, end in given.items() for word in ("--terminal", f"{name}={end}")]
    assert run("import", *files, *MAP_FOUR, "--name", "four", *ends).clean
    ends = {b.name: b.terminal for b in load(Path("four.yaml")).drawn.bodies if b.name in FOUR}
    two = given.get("two", "middle").replace("none", "")
    assert ends == {"low": "bottom", "one": "", "two": two, "up": "top"}


def test_too_many_conductors_are_asked_for_by_name(run, tmp_path):
    line = run("import", *stacked(tmp_path, **FOUR, **FILMS), *MAP_FOUR, "--terminal", "up=top").line
    assert "4 electrodes that do not touch: low, one, two, up" in line
    assert "give --terminal low=END --terminal one=END --terminal two=END, END top" in line


def test_a_top_that_support_alone_holds_is_no_plate(run, tmp_path):
    """It passed as a solid plate that prints without findings."""
    files = stacked(tmp_path, low=(0.0, 0.4), film=(0.4, 0.7), support=(0.7, 0.8), up=(0.8, 1.2))
    materials = ("--map", "film=x60@1", "--map", "support=bvoh@3", "--map", "*=etpu@2")
    assert run("import", *files, *materials, "--name", "sup").code == 0
    assert "9-loose up, layer 9 nothing holds it" in run("check", "sup.yaml", "--budget", "0").words
    assert "is held by nothing" in run("predict", "sup.yaml", "--drawn").words


def test_a_conductor_between_both_electrodes_is_a_short(run, tmp_path):
    """It was called a middle electrode."""
    files = stacked(tmp_path, low=(0.0, 0.4), block=(0.4, 0.6), up=(0.6, 1.0))
    said = run("import", *files, "--map", "*=etpu@2", "--name", "short")
    assert said.code == 1
    assert "next correct what is found below, then import again with --force" in said.words
    assert "(columns, fem2d, fem3d, prisms: the electrodes touch" in said.words
    assert "1-short low / block / up conductors that touch are both electrodes" in said.words
    assert "middle" not in said.words
    assert {b.name: b.terminal for b in load(Path("short.yaml")).drawn.bodies} == {
        "low": "bottom", "block": "", "up": "top"
    }  # fmt: skip
    checked = run("check", "short.yaml", "--budget", "1")
    assert checked.code == 1
    assert checked.words.startswith("CHANGE")
    assert "block and up touch" in checked.words


def test_without_a_map_nothing_is_imported(run, plates):
    files = plates()
    before = sorted(Path().iterdir())
    said = run("import", *files, "--unit", "mm")
    assert (
        "expected sensorgen import low.stl film.stl up.stl --unit mm --map low=MATERIAL --map film=x60" in said.refusal
    )
    assert said.out == run("import", *files, "--unit", "mm", "--list").out
    assert sorted(Path().iterdir()) == before


def test_the_command_that_a_list_ends_with_can_be_pasted(run, plates):
    """It had neither the folder of a file nor its unit, and was wrapped amid the command."""
    Path("my parts").mkdir()
    files = [str(Path(name).rename(Path("my parts") / name)) for name in plates()]
    listed = run("import", *files, "--unit", "mm", "--list").out.replace("MATERIAL", "etpu")
    command = shlex.split(listed.partition("To import it:\n")[2].replace("\\\n", " "))
    assert command[0] == "sensorgen"
    assert run(*command[1:]).code == 0
    assert load(Path("low.yaml")).drawn.size_mm == (20.0, 10.0, 1.0)


def test_a_list_writes_no_picture(run, plates):
    files = plates(up=(0.5, 1.0))
    before = sorted(Path().iterdir())
    assert "overlap" in run("import", *files, "--unit", "mm", "--list").refusal
    assert sorted(Path().iterdir()) == before
    assert run("import", *files, "--unit", "mm", *PLATES).code == WRONG_INPUT
    assert [p.name for p in Path().iterdir() if p not in before] == ["low-faults.svg"]


def test_a_changed_sensor_keeps_its_name(run, plates):
    """It was named after its size: imported-length20-width10, as any other one of that size."""
    for name, film in (("a", (0.4, 0.6)), ("b", (0.4, 0.61))):
        files = plates(film=film, up=(film[1], 1.0))
        assert run("import", *files, "--unit", "mm", "--name", name, *PLATES, "--force").code == 0
    changed = (("a",), ("a", "--set", "eps_x60=3"), ("a", "--set", "eps_x60=3.1"), ("b", "--set", "eps_x60=3"))
    cells = (run("cell", f"{name}.yaml", "--drawn", "--json", *words).out for name, *words in changed)
    names = [json.loads(cell)["design"] for cell in cells]
    assert [name[:2] for name in names] == ["a", "a-", "a-", "b-"]
    assert len(set(names)) == 4


def test_a_replaced_design_leaves_no_bodies_behind(run, plates):
    words = ["--unit", "mm", "--name", "a", *PLATES]
    assert run("import", *plates(), *words).code == 0
    (first,) = Path().glob("*.bodies.json")
    Path("other-12345678.bodies.json").write_text("{}", encoding="utf-8")
    assert run("import", *plates(film=(0.4, 0.61), up=(0.61, 1.0)), *words, "--force").code == 0
    (second,) = (path for path in Path().glob("a-*.bodies.json"))
    assert second != first
    assert Path("other-12345678.bodies.json").exists()
    Path("copy.yaml").write_bytes(Path("a.yaml").read_bytes())  # which needs the same bodies
    assert run("import", *plates(), *words, "--force").code == 0
    assert second.exists()
    assert load(Path("copy.yaml")).shape == "imported"


def test_materials_of_a_pack_beside_the_design_are_suggested_and_taken(run, plates, tmp_path):
    text = (Path(packs.__file__).parent / "templates" / "material.yaml").read_text("utf-8").replace("NAME", "eel")
    (tmp_path / "materials").mkdir()
    (tmp_path / "materials" / "eel.yaml").write_text(text, "utf-8")
    files = [Path(name).rename(f"{name[:-4]}-eel.stl" if name != "film.stl" else name).name for name in plates()]
    listed = run("import", *files, "--unit", "mm", "--list", "--json").json["bodies"]
    assert [body["material"] for body in listed] == ["eel", "x60", "eel"]
    assert run("import", *files, "--unit", "mm", "--name", "own", "--map", "film=x60@1", "--map", "*=eel@2").clean
    Path("a.gcode").write_text("G90\nM83\n", encoding="utf-8")
    assert run("gcode", "check", "a.gcode", "--material", "2=eel").code != WRONG_INPUT
    assert "unknown material 'eal'; did you mean 'eel'?" in run("gcode", "check", "a.gcode", "--material", "2=eal").line


def test_geometry_is_part_of_the_design(run, plates, tmp_path):
    assert run("import", *plates(), "--unit", "mm", "--name", "a", *PLATES).code == 0
    first = load(Path("a.yaml"))
    assert run("import", *plates(film=(0.4, 0.61), up=(0.61, 1.0)), "--unit", "mm", "--name", "b", *PLATES).code == 0
    assert load(Path("b.yaml")).id() != first.id()
    assert make(first.model_dump(mode="json")).id() == first.id()  # a record holds all of it
    (bodies,) = tmp_path.glob("a-*.bodies.json")
    bodies.write_text(bodies.read_text().replace("0.6", "0.7"))
    assert "its content is not that of its name" in run("check", "a.yaml").line
    bodies.unlink()
    assert "not a file; expected the bodies" in run("check", "a.yaml").line


UNFIT = [
    ({"bodies": {"low": {"material": "etpu"}}}, "bodies.film is missing"),
    ({"bodies": {"lid": {"material": "etpu"}}}, "unknown body 'lid'"),
    ({"parameters": {"length_mm": 50.0}}, "parameters.length_mm: an imported sensor is as large as its bodies"),
    ({"geometry": None}, "geometry is missing"),
    ({"geometry": "data:application/zlib;base64,AAAA"}, "geometry: no bodies in it"),
    ({"shape": "tri"}, "tri is drawn from parameters; expected shape: imported"),
]


def test_designs_that_do_not_fit_their_bodies_are_refused(run, plates):
    assert run("import", *plates(), "--unit", "mm", "--name", "a", *PLATES).code == 0
    data = load(Path("a.yaml")).model_dump(mode="json")
    for change, line in UNFIT:
        with pytest.raises(SensorgenError, match=line):
            make(data | change)


@pytest.mark.usefixtures("shared_kernel", "at_rest")
def test_rounded_corners_cost_the_resistance_alone(run, models):
    """Of the plate without its corners; the electrodes reach no end face, which is said, with its exit code."""
    assert run("import", models / "rounded.step", "--map", "pad=x60@1", "--map", "*=etpu@2").code == 0
    said = run("predict", "rounded.yaml", "--json")
    found, plate_f = json.loads(said.out), 8.8541878128e-12 * 4.68 * (300 - (4 - math.pi)) * 1e-6 / 0.6e-3
    assert plate_f < found["drawn"]["capacitance"]["value"] < 1.12 * plate_f
    assert found["capacitance"]["value"] == pytest.approx(found["drawn"]["capacitance"]["value"], rel=0.05)
    assert (said.code, found["status"], found["resistance"]) == (2, "predicted", {})
    assert re.search("no resistance: the (top|bottom) electrode runs from", said.err)
    text = run("predict", "rounded.yaml").words
    assert "capacitance" in text and "no resistance: the" in text  # noqa: PT018


@pytest.mark.usefixtures("shared_kernel", "unpressed", "at_rest")
def test_the_whole_walk_in_an_empty_folder(run, models, program):
    """From a STEP of another program to a sliced print, with commands alone."""
    program("prusa-slicer", "prusa-slicer")
    said = run("import", models / "filleted.step", "--map", "pad=x60@1", "--map", "*=etpu@2").ok
    assert "30 x 10 x 1.6 mm" in said.words
    assert run("check", "filleted.yaml").code == 0
    predicted = run("predict", "filleted.yaml", "--json").ok
    found, plate_f = json.loads(predicted.out), 8.8541878128e-12 * 4.68 * 9.4e-3 * 30e-3 / 0.8e-3
    for one in (found, found["drawn"]):  # fringes at the narrower plate's edges, a fillet beside them
        assert plate_f < one["capacitance"]["value"] < 1.12 * plate_f
        assert one["capacitance"]["certified"]
    assert run("build", "filleted.yaml", "--no-cad").code == 0
    made = {path.name for path in Path("out/filleted").iterdir()}
    assert {"filleted.prusa.3mf", "filleted.cura.3mf", "filleted.svg", "design.json"} <= made
    assert run("slice", "filleted.yaml").ok
    assert Path("out/filleted/filleted.prusa.gcode").stat().st_size > 10_000


ELLIPSE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="12mm" height="8mm" viewBox="0 0 120 80">'
    '<ellipse cx="60" cy="40" rx="50" ry="30"/></svg>'
)


@pytest.mark.usefixtures("unpressed", "at_rest")
def test_a_sensor_cut_to_an_outline_is_sliced_and_predicted(run, program):
    """The skirt follows the outline into the corners of its box, which is no collision."""
    program("prusa-slicer", "prusa-slicer")
    Path("oval.svg").write_text(ELLIPSE, encoding="utf-8")
    words = ("reference", "--border", "oval.svg", "--name", "oval")
    assert run("slice", *words).clean
    found = run("predict", *words, "--json").json
    assert "oval.prusa.gcode" in json.dumps(found)
    area, eps = np.pi * 5e-3 * 3e-3, 4.68
    assert found["capacitance"]["value"] == pytest.approx(8.8541878128e-12 * eps * area / 0.6e-3, rel=0.02)
    assert "--border" in run("build", "reference", "--help").out
    assert "the border is 10 mm" in run("check", *words, "--size", "25x10").line


def test_a_middle_electrode_is_read_by_stack(run, tmp_path):
    """As the shape of the same plates; it was refused with the advice to use this command."""
    heights = {"low": (0.0, 0.3), "under": (0.3, 0.8), "mid": (0.8, 1.1), "over": (1.1, 1.8), "up": (1.8, 2.1)}
    maps = ["--map", "*=etpu@2", "--map", "under=x60@1", "--map", "over=x60@1"]
    assert run("import", *stacked(tmp_path, **heights), *maps, "--name", "three").code == 0
    said = run("stack", "three.yaml")
    plates = {"length": 20, "width": 10, "electrode": 0.3, "lower-dielectric": 0.5, "upper-dielectric": 0.7}
    drawn = run("stack", "double", *(word for key, value in plates.items() for word in (f"--{key}", str(value))))
    assert (said.code, said.out) == (0, drawn.out)
    checked = run("check", "three.yaml")
    assert (checked.code, checked.words.startswith("PRINT three: no findings; estimated")) == (0, True)
    assert "; not predicted" in checked.words
    heights = {"low": (0.0, 0.3), "post": (0.3, 1.8), "mid": (0.8, 1.1), "up": (1.8, 2.1)}
    files = stacked(tmp_path, **heights)
    trimesh.creation.box(bounds=[(5, 2, 0.8), (15, 8, 1.1)]).export(tmp_path / "mid.stl")
    trimesh.creation.box(bounds=[(0, 0, 0.3), (4, 10, 1.8)]).export(tmp_path / "post.stl")
    assert run("import", *files, "--map", "*=etpu@2", "--map", "post=x60@1", "--name", "beside").code == 0
    assert "post: beside the middle electrode, which is from 0.8 to 1.1 mm" in run("stack", "beside.yaml").line
