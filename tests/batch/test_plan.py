"""Plans: what they mean, and what is wrong with wrong ones."""

from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError, UnknownName
from sensorgen.workflows.batch import arranged
from sensorgen.workflows.batch.plan import BatchPlan, Item, load, pieces, shuffled, tools

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "film-study.yaml"
HEAD = "iteration: 26\ndesigns:\n"


def read(path):
    return pieces(load(path), path.parent)


def test_the_example_has_twenty_specimens_of_five_designs():
    found = read(EXAMPLE)
    assert len(found) == 20
    assert len({p.design.id() for p in found}) == 5
    assert [p.name for p in found[::4]] == [
        "26 triX .1mm 1 fine", "26 triX .2mm 1 fine", "26 triY .1mm 1 fine", "26 triY .2mm 1 fine", "26 SX60 1 fine",
    ]  # fmt: skip
    assert load(EXAMPLE).name == "film-study"


def test_copies_count_on_from_where_they_are_told(plan):
    path = plan(HEAD + "  - {shape: tri, replicates: 2}\n  - {shape: tri, replicates: 2, first: 3}\n")
    assert [p.name for p in read(path)] == [f"26 triX .2mm {k} fine" for k in (1, 2, 3, 4)]


def test_a_plan_fills_in_the_quality_and_printer_that_its_designs_leave_open(plan, tmp_path):
    path = plan("quality: extrafine\nprinter: prusa-xl5\n" + HEAD + "  - {shape: tri}\n")
    (piece,) = read(path)
    assert (piece.design.layers.name, piece.design.machine.name) == ("extrafine", "prusa-xl5")
    assert piece.name == "26 triX .2mm 1 x fine"
    (tmp_path / "own.yaml").write_text("shape: tri\nquality: extrafine\n")
    (own,) = read(plan("quality: fine\nprinter: prusa-xl5\n" + HEAD + "  - {design: own.yaml}\n"))
    assert (own.design.layers.name, own.design.machine.name) == ("extrafine", "prusa-xl5")


def test_a_design_that_a_plan_leaves_as_it_is_keeps_its_name(plan, tmp_path):
    (tmp_path / "finger.yaml").write_text("shape: tri\nname: finger\nparameters: {length_mm: 36}\n")
    for quality, is_own in (("fine", True), ("extrafine", False)):
        (piece,) = read(plan(f"quality: {quality}\n" + HEAD + "  - {design: finger.yaml}\n"))
        assert (piece.design.name == "finger", piece.design.layers.name) == (is_own, quality)


def test_a_shape_that_the_thesis_does_not_have_is_called_by_its_own_name(plan):
    (piece,) = read(plan(HEAD + "  - {shape: pillar}\n"))
    assert piece.name == "26 pillar .2mm 1 fine"


def test_a_plan_assigns_tools(plan, tmp_path):
    (tmp_path / "own.yaml").write_text("shape: rect\ntools: {x60: 2, bvoh: 1}\n")
    path = plan("tools: {x60: 5, etpu: 4}\n" + HEAD + "  - {shape: tri}\n  - {design: own.yaml}\n")
    found = read(path)
    assert tools([p.design for p in found]) == {4: "etpu", 5: "x60"}
    assert found[1].design.tools == {"x60": 5, "bvoh": 1, "etpu": 4}


def test_parameters_and_materials_go_before_those_of_the_file(plan, tmp_path):
    (tmp_path / "own.yaml").write_text("name: mine\nshape: tri\nparameters: {dielectric_mm: 0.3, length_mm: 50}\n")
    path = plan(HEAD + "  - {design: own.yaml, parameters: {dielectric_mm: 0.1}, materials: {film: x60@thesis-4.1}}\n")
    (piece,) = read(path)
    assert (piece.design.params.dielectric_mm, piece.design.params.length_mm) == (0.1, 50)
    assert piece.design.materials.film == "x60@thesis-4.1"
    assert piece.design.name != "mine"  # it is not that design any more
    (untouched,) = read(plan(HEAD + "  - {design: own.yaml}\n"))
    assert untouched.design.name == "mine"


WRONG = {
    "": "holds nothing",
    "iteration: 26\n": "designs is missing",
    "iteration: 26\ndesigns: []\n": "at least one entry",
    HEAD + "  - {}\n": "designs.0: neither of design and shape",
    HEAD + "  - {shape: tri, design: x.yaml}\n": "designs.0: both of design and shape",
    HEAD + "  - {shape: trj}\n": "did you mean 'tri'",
    HEAD + "  - {design: missing.yaml}\n": "unknown design 'missing.yaml'",
    HEAD + "  - {shape: tri, replicates: 0}\n": "replicates is 0; expected 1 or more",
    HEAD + "  - {shape: tri, replicates: 1000}\n  - {shape: rect}\n": "1001 specimens; expected at most 1000",
    HEAD + "  - {shape: tri, copies: 5}\n": "copies",
    HEAD + "  - {shape: tri, parameters: {dielectric: 1}}\n": "did you mean 'dielectric_mm'",
    HEAD + "  - {shape: tri}\n  - {shape: tri, materials: {film: x60@thesis-4.1}}\n": "two specimens are called",
    HEAD + "  - {shape: tri}\n  - {shape: rect}\n  - {shape: tri}\n": "'26 triX .2mm 1 fine'",
    HEAD + "  - {shape: tri}\nlayout: {kind: round}\n": "expected 'column' or 'packed'",
    HEAD + "  - {shape: tri}\nlayout: {spacing_mm: .nan}\n": "spacing_mm",
    HEAD + "  - {shape: tri}\nslicers: [cure]\n": "'prusa' or 'cura'",
    HEAD + "  - {shape: tri}\nslicers: []\n": "at least one",
    HEAD + "  - {shape: tri}\nname: ../../etc\n": "expected text such as 26 or film-study",
    HEAD + "  - {shape: tri}\nfilaments: {etpv: {lot: A}}\n": "did you mean 'etpu'",
    HEAD + "  - {shape: tri}\nfilaments: {etpu: {lot: \"a\\nb\"}}\n": "one line",
    HEAD + "  - {shape: tri}\nbake: [{temperature_c: 150}]\n": "hours is missing",
    HEAD + "  - {shape: tri}\nprinter: prusa\n": "prusa-xl5",
    "iteration: -1\ndesigns: [{shape: tri}]\n": "iteration is -1",
    "iteration: 2.5\ndesigns: [{shape: tri}]\n": "iteration is 2.5; expected a whole number",
}  # fmt: skip


@pytest.mark.parametrize("text", WRONG, ids=lambda t: WRONG[t])
def test_wrong_plans(plan, text):
    with pytest.raises(SensorgenError) as error:
        read(plan(text))
    assert WRONG[text] in str(error.value)


@pytest.mark.parametrize(
    ("one", "other", "said"),
    [
        ("quality: fine", "quality: extrafine", "quality fine for a and extrafine for b; give both the same quality"),
        ("printer: diabase-h5", "printer: prusa-xl5", "printer diabase-h5 for a and prusa-xl5"),
        ("nozzle_mm: 0.4", "nozzle_mm: 0.25", "0.4 for a and 0.25 for b"),
        ("tools: {x60: 4}", "tools: {x60: 5}", "wants x60 on tool 5, but x60 is on tool 4"),
        ("tools: {x60: 4}", "materials: {support: bvoh}\ntools: {x60: 5, bvoh: 4}", "one spool on each tool"),
    ],
)
def test_designs_that_no_plate_holds_together(plan, tmp_path, one, other, said):
    (tmp_path / "a.yaml").write_text(f"shape: tri\n{one}\n")
    (tmp_path / "b.yaml").write_text(f"shape: rect\n{other}\n")
    with pytest.raises(BadInput) as error:
        read(plan(HEAD + "  - {design: a.yaml}\n  - {design: b.yaml}\n"))
    assert said in str(error.value)


def test_the_order_is_drawn_by_the_seed_alone():
    found = read(EXAMPLE)
    one = [p.name for p in shuffled(found, 2026)]
    assert sorted(one) == sorted(p.name for p in found)
    assert one == [p.name for p in shuffled(found[::-1], 2026)]
    assert one != [p.name for p in shuffled(found, 2027)]
    # From sha256sum, by hand: printf '2026\n26 SX60 1 fine' | sha256sum gives 20f5a9..., the least of the twenty.
    assert one[:3] == ["26 SX60 1 fine", "26 triY .1mm 2 fine", "26 triX .2mm 4 fine"]


def test_places_in_the_order_are_as_good_as_evenly_spread():
    """Over 2000 seeds each specimen comes first about one time in twenty: chi square of 19 degrees under its 99.9 %."""
    found = read(EXAMPLE)
    first = [shuffled(found, seed)[0].name for seed in range(2000)]
    expected = 2000 / len(found)
    assert sum((first.count(p.name) - expected) ** 2 / expected for p in found) < 43.8


def test_the_page_shows_the_example_and_every_key_of_a_plan():
    page = (ROOT / "docs" / "batch.md").read_text("utf-8")
    shown = page.partition("```yaml\n")[2].partition("```")[0]
    assert EXAMPLE.read_text("utf-8").partition("\n")[2] == shown
    assert not [key for key in BatchPlan.model_fields if f"`{key}`" not in page]


SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 10**19), st.floats(), st.text(max_size=8),
    st.sampled_from(["tri", "rect", "reference", "prusa", "cura", "column", "packed", "etpu", "x60", "../x.yaml"]),
)  # fmt: skip
KEYS = st.one_of(
    st.sampled_from([*BatchPlan.model_fields, *Item.model_fields, "spacing_mm", "lot", "hours"]), st.text(max_size=5)
)
TREES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=8,
)
FITTING = {"iteration": 26, "designs": [{"shape": "tri", "replicates": 2}]}


@settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(KEYS, TREES, max_size=3), st.booleans())
def test_any_mapping_is_a_plan_or_refused_in_words(tmp_path, data, whole):
    path = tmp_path / "plan.yaml"
    path.write_text(yaml.safe_dump(FITTING | data if whole else data, allow_unicode=True), "utf-8")
    try:
        found = arranged(path)
    except SensorgenError:
        return
    assert len({piece.name for piece in found.pieces}) == len(found.pieces)


def test_a_huge_specimen_fits_nowhere(plan):
    with pytest.raises(OutOfRange, match=r"plan\.yaml: a specimen of .* fits on no plate"):
        arranged(plan(HEAD + "  - {shape: tri, parameters: {length_mm: 400}}\n"))


def test_the_nearest_design_is_offered(plan, tmp_path):
    (tmp_path / "trix-d0.1.yaml").write_text("shape: tri\n")
    with pytest.raises(UnknownName, match=r"did you mean 'trix-d0.1.yaml'"):
        read(plan(HEAD + "  - {design: trix-d01.yaml}\n"))


@pytest.mark.parametrize("layout", ["spacing_mm: 0", "spacing_mm: 0.87", "spacing_mm: 0, brim_mm: 0.4"])
def test_specimens_that_would_print_as_one_are_refused(plan, layout):
    with pytest.raises(BadInput, match=r"print as one; expected layout.spacing_mm of 0\.88 or more"):  # two lines
        arranged(plan(HEAD + f"  - {{shape: tri, replicates: 2}}\nlayout: {{{layout}}}\n"))


def test_specimens_two_lines_apart_or_alone_have_a_place(plan):
    for word, layout in (("2", "spacing_mm: 0.88"), ("2", "spacing_mm: 0, brim_mm: 0.5"), ("1", "spacing_mm: 0")):
        assert arranged(plan(HEAD + f"  - {{shape: tri, replicates: {word}}}\nlayout: {{{layout}}}\n")).plate
