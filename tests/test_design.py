"""Designs: what they take, what identifies them, and what they are called."""

import dataclasses
import subprocess
import sys
from types import SimpleNamespace

import pytest

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.design import design, packs
from sensorgen.design.design import make, name_of
from sensorgen.design.shapes import reference
from sensorgen.prediction.bodies import drawn
from sensorgen.scene.scene import Envelope, Prism


def tri(**more):
    return make({"shape": "tri", **more})


CHANGES = [
    {"parameters": {"period_mm": 2.5}}, {"parameters": {"dielectric_mm": 0.2000001}}, {"parameters": {"along": "y"}},
    {"parameters": {"isolation_mm": 0.1}}, {"materials": {"film": "x60@thesis-4.1"}},
    {"materials": {"top_electrode": "etpu@thesis-3.2"}}, {"materials": {"support": "bvoh"}}, {"printer": "prusa-xl5"},
    {"quality": "extrafine"}, {"nozzle_mm": 0.25}, {"tools": {"x60": 2}}, {"infill": {"x60": {"percent": 80}}},
    {"infill": {"x60": {"pattern": "grid"}}}, {"orientation": "upside-down"}, {"shrinkage": 0.02},
]  # fmt: skip


def test_ids_and_names_of_all_changes_differ():
    made = [tri(), *(tri(**change) for change in CHANGES)]
    assert len({d.id() for d in made}) == len({d.name for d in made}) == len(made)


@pytest.mark.parametrize(
    "same",
    [
        {"name": "other"},
        {"waivers": [{"rule": "5", "reason": "seen on the bench"}]},
        {"parameters": {"period_mm": 2, "along": "x"}},
        {"materials": {"film": "x60", "support": None}},
    ],
    ids=str,
)
def test_what_decides_nothing_does_not_change_the_id(same):
    assert tri(**same).id() == tri().id()


def test_a_new_version_of_sensorgen_changes_no_id():
    """In a process of its own, whose version is another one from the start; the identity is one of version 0.1.0."""
    program = (
        "import sensorgen.core.version as v; v.__version__ = '99.0'; from sensorgen.design.design import make; "
        "print(make({'shape': 'tri'}).id())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.strip() == tri().id()


def test_a_changed_value_in_a_material_changes_the_id(monkeypatch):
    before, load = tri().id(), design.material_files.load

    def changed(name, *rest):
        found = load(name, *rest)
        value = found.value("density_kg_m3").model_copy(update={"value": 1.0})
        return found.model_copy(update={"properties": found.properties | {"density_kg_m3": [value]}})

    monkeypatch.setattr(design.material_files, "load", changed)
    assert tri().id() != before


def test_the_place_of_a_printers_file_does_not_change_the_id(tmp_path):
    shipped = (packs.profiles() / "printers/diabase-h5.yaml").read_text("utf-8")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "own.yaml").write_text(shipped)
    one, two = (tri(printer=str(tmp_path / name / "own.yaml")) for name in ("a", "b"))
    assert one.id() == two.id() != tri().id()


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_what_is_written_is_read_back_as_the_same_design(change):
    made = tri(**change)
    assert make(made.model_dump(mode="json")) == made


def test_long_names_are_cut_but_stay_apart():
    odd = {f.name: 1.2345 for f in design.fields("rect").values() if f.name.endswith("_mm")}
    names = {name_of(make({"shape": "rect", "parameters": odd, "quality": q})) for q in ("fine", "extrafine")}
    assert len(names) == 2
    assert all(make({"shape": "rect", "name": name}).name == name for name in names)


@pytest.mark.parametrize("stem", ["my printer", "größe", "...", "-x-", "a" * 200])
def test_names_made_from_odd_file_names_are_safe(tmp_path, stem):
    path = tmp_path / f"{stem}.yaml"
    path.write_text((packs.profiles() / "printers/diabase-h5.yaml").read_text("utf-8"))
    name = tri(printer=str(path)).name
    assert tri(name=name).name == name


BAD = [
    ({"shape": 3}, BadInput, "shape is 3; expected text"),
    ({"shape": "tri", 1: 2}, BadInput, "1 is 1; expected"),
    ({"shape": "tri", "parameters": {"period_mm": 10**400}}, BadInput, "expected a number"),
    ({"shape": "tri", "parameters": {"period_mm": 10**5000}}, BadInput, "is a huge number; expected a number"),
    ({"shape": "tri", "parameters": {"along": 3}}, UnknownName, "unknown value of along '3.0'. Known: x, y"),
    *(({"shape": array, "parameters": {"period_mm": 30}}, OutOfRange, "is more than the sensor's shorter side, 10 mm")
      for array in ("bump", "cone", "pillar", "pyramid")),
    ({"shape": "tri", "tools": {"x60": True}}, BadInput, "tools.x60 is True; expected a whole number"),
    ({"shape": "tri", "tools": {"bvoh": 7}}, BadInput, "diabase-h5 has no tool 7"),
    ({"shape": "tri", "shrinkage": 0.9}, BadInput, "shrinkage is 0.9; expected a number below 0.9"),
    ({"shape": "tri", "nozzle_mm": "0.4"}, BadInput, "nozzle_mm is '0.4'; expected a number"),
    ({"shape": "tri", "waivers": {"rule": "5"}}, BadInput, "expected a list"),
    ({"shape": "tri", "materials": {"film": "air"}}, MissingValue, "no tool for air on diabase-h5: name one with"),
    ({"shape": "tri", "printer": "x\0.yaml"}, BadInput, "embedded null byte"),
    ({"shape": "tri", "name": "x" * 10_000}, BadInput, "cannot be a file name everywhere"),
]  # fmt: skip


@pytest.mark.parametrize(("data", "kind", "message"), BAD, ids=[message for *_, message in BAD])
def test_bad_designs_name_file_and_key(data, kind, message):
    with pytest.raises(kind) as error:
        make(data, "some.yaml")
    assert str(error.value).startswith("some.yaml: ")
    assert message in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize("data", [None, 3, "tri", [], [("shape", "tri")]])
def test_what_is_no_mapping_is_no_design(data):
    with pytest.raises(BadInput, match="expected a mapping"):
        make(data)


@pytest.mark.parametrize("shape", ["tri", "rect", "reference"])
def test_every_parameter_is_taken_at_its_limits_and_not_beyond(shape):
    for name, field in design.fields(shape).items():
        if "range" not in field.metadata:
            continue
        for limit, beyond in zip(field.metadata["range"], (-1e-9, 1e-9), strict=True):
            assert design._checked(field, limit) == limit
            with pytest.raises(OutOfRange, match=f"{name} is .*; expected a number from"):
                design.parameters(shape, {name: limit + beyond})


@dataclasses.dataclass(frozen=True)
class Cogs(Envelope):
    """Parameters of a shape that somebody adds: two of them words."""

    form: str = dataclasses.field(default="dome", metadata={"help": "Form.", "choices": ("dome", "half round", "hook")})
    foot: str = dataclasses.field(default="none", metadata={"help": "Foot.", "choices": ("none", "hook")})
    corners: int = dataclasses.field(default=16, metadata={"help": "Corners.", "range": (3, 400)})


@pytest.fixture
def cogs(monkeypatch):
    """A shape whose parameters are words too."""

    def scene(p, fill):
        return reference.scene(reference.Params(length_mm=p.length_mm, width_mm=p.width_mm), fill)

    plugin, known = SimpleNamespace(Params=Cogs, scene=scene), design.shape
    monkeypatch.setitem(design.packs.shipped_names("shapes"), "cogs", design.packs.shipped()[0])
    monkeypatch.setattr(design, "shape", lambda name: plugin if name == "cogs" else known(name))


@pytest.mark.parametrize(
    ("parameters", "name"),
    [
        ({"form": "dome"}, "cogs"),
        ({"form": "hook"}, "cogs-form-hook"),
        ({"form": "half round", "length_mm": 50}, "cogs-length50-form-half-round"),
    ],
)
def test_a_parameter_that_is_a_word_stands_in_the_name(cogs, parameters, name):
    assert make({"shape": "cogs", "parameters": parameters}).name == name


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ((), "of 0 corners is open: none;"),
        (((0, 0), (1, 1), (1, 0), (0, 1)), "encloses nothing"),  # two triangles, one the other way round
        (((0, 0), (1, 0), (1, 1), (0, 1), (0, 0)), "has the same corner twice in a row"),
        (((0, 0), (float("nan"), 0), (1, 1)), "has a corner that is nowhere"),
    ],
)
def test_an_outline_that_encloses_nothing_is_refused_wherever_a_scene_is_made(cogs, monkeypatch, corners, said):
    """A design file names its shape; whatever that shape draws is looked at before any model is asked."""
    monkeypatch.setattr(design.shape("cogs"), "scene", lambda p, fill: Prism("y", corners, 0.0, 1.0))
    with pytest.raises(BadInput, match=rf"^there: an outline {said}.* expected at least three corners"):
        make({"shape": "cogs"}, "there")


def test_a_dielectric_fills_film_and_isolation_unless_they_are_given():
    materials = {"dielectric": "pla", "film": "x60"}
    made = make({"shape": "tri", "parameters": {"isolation_mm": 0.2}, "materials": materials}).materials
    assert (made.dielectric, made.film, made.isolation) == ("pla", "x60", "pla")


@pytest.mark.parametrize("film", ["x60", "ninjaflex"])
def test_a_film_of_another_material_than_the_dielectric_stays(film):
    """Of the default, too, which the film of another dielectric has not unless it is given."""
    slots = {"dielectric": "ninjaflex", "film": film}
    design = make({"shape": "tri", "materials": slots, "tools": {"ninjaflex": 2}})
    again = make(design.model_dump(exclude_defaults=True, mode="json"))
    assert again.materials == design.materials
    assert (again.materials.film, again.materials.isolation, again.id()) == (film, "ninjaflex", design.id())
    assert drawn(design).with_values({"x60": {"relative_permittivity": 3.0}}).design.materials == design.materials


@pytest.mark.parametrize("name", [{}, {"name": "mine"}])
def test_a_dielectric_of_a_design_in_python_fills_the_film_too(name):
    given = {"shape": "tri", "materials": {"dielectric": "ninjaflex"}, "tools": {"ninjaflex": 2}}
    assert design.Design(**given, **name).materials == make(given).materials
