"""Packs as a new user has them: own files beside a design, in a folder of packs, and from an installed package."""

import json
import pickle
import re
import shutil
import sys
from hashlib import sha256
from pathlib import Path

import pytest

from sensorgen.core import files, yamlfile
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design import design, materials, packs, shape_files
from sensorgen.measure import accuracy
from sensorgen.workflows.batch import plan as plans

TEMPLATES = Path(packs.__file__).parent / "templates"
DESIGN = "shape: zig\nparameters: {length_mm: 40}\nmaterials: {electrode: eel}\nprinter: mine\ntools: {eel: 0}\n"
CYCLE = {"a": "requires: [b]", "b": "requires: [c]", "c": "requires: [a]"}


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put(folder, what, name, change=("", "")):
    """A template's file in a pack's folder."""
    kind = {"material": "materials", "shape": "shapes", "printer": "printers", "quality": "qualities"}[what]
    suffix = ".py" if what == "shape" else ".yaml"
    text = (TEMPLATES / f"{what}{suffix}").read_text("utf-8").replace("NAME", name)
    assert change[0] in text
    path = folder / kind / f"{name}{suffix}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text.replace(*change) if change[0] else text, "utf-8")
    if what == "shape":
        shape_files.trust(name, path.read_text("utf-8"))
    return path


@pytest.fixture
def mine(here):
    """The files that the design of this module needs, beside it."""
    names = {"eel": "material", "zig": "shape", "mine": "printer"}
    return {name: put(here, what, name) for name, what in names.items()}


def install(folder, monkeypatch, value="lab_pack", name="lab"):
    """A package with a pack, as an installer leaves it."""
    put(folder / "lab_pack", "material", "lab-ink")
    (folder / "lab_pack" / "__init__.py").write_text("raise SystemExit('a pack is not imported')\n")
    info = folder / "lab_pack-2.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab-pack\nVersion: 2.1\n")
    (info / "entry_points.txt").write_text(f"[sensorgen.packs]\n{name} = {value}\n")
    monkeypatch.syspath_prepend(str(folder))


def made(**changes):
    return design.make({**yamlfile.parse(DESIGN, "design"), **changes})


def test_from_an_empty_folder_to_files_for_a_print(run, roughly):
    for words in (("material", "eel"), ("shape", "zig"), ("printer", "mine"), ("quality", "mid"), ("design", "my")):
        assert run("new", *words).code == 0
    assert run("pack", "trust", ".").code == 0
    assert run("pack", "test", ".").out == ".: 4 files, no findings\n"
    assert run("check", "my.yaml").out.startswith("PRINT  my: no findings")
    Path("my.yaml").write_text(DESIGN, encoding="utf-8")
    assert run("check", "my.yaml").code == 0
    said = run("predict", "my.yaml", "--json")
    values = {(v["material"], v["quantity"]): v for v in json.loads(said.out)["values"]}
    assert values["eel", "resistivity_ohm_m"]["source"] == "eel-sheet"
    assert run("build", "my.yaml", "--no-cad").code == 0
    assert materials.citations()["eel-sheet"].startswith("example numbers")
    assert {"my.prusa.3mf", "prediction.json", "design.json"} <= {file.name for file in Path("out/my").iterdir()}
    assert "eel" in Path("out/my/design.json").read_text(encoding="utf-8")


def test_a_new_design_is_the_shape_by_its_name(run):
    """The template's values are the defaults: one plate, one answer, from the file and by name."""
    run("new", "design", "my")
    ours, by_name = design.load(Path("my.yaml")), design.make({"shape": "reference", "name": "my"})
    assert ours.id() == by_name.id()


def test_by_options_alone(run):
    put(Path(), "material", "eel"), put(Path(), "shape", "zig")
    for shape in ("zig", "./shapes/zig.py"):
        said = run("check", shape, "--material", "electrode=eel", "--tool", "eel=1", "--film", "0.3", "--json").clean
        assert json.loads(said.out)["name"].startswith("zig-film0.3")
    said = run("check", "zig", "--material", "dielectric=./materials/eel.yaml", "--tool", "eel=1")
    assert said.line == "sensorgen: materials.dielectric: eel conducts"
    said = run("check", "zig", "--material", "electrode=eel").line
    assert said.startswith("sensorgen: no tool for eel on diabase-h5: name one with --tool eel=1, or 'tools: {eel: 1}'")
    assert said.endswith("(free: 1, 2, 3, 5)")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("check tri --material electrode=eel", "unknown material 'eel'. .*; your own: sensorgen new material eel"),
        ("check zig", "unknown shape 'zig'. Known: .*; your own: sensorgen new shape zig"),
        ("check tri --printer mk4", "unknown printer 'mk4'. Known: .*; your own: sensorgen new printer mk4"),
        ("new material x60", "a material 'x60' ships with sensorgen .pack thesis.; choose another name"),
        ("new material ../x", "'../x' cannot be a material's name; expected small letters and digits, as lab-eel"),
        ("new material a --pack ../x", "--pack '../x'; expected small letters, digits and '-'"),
        ("pack test nothing", "unknown pack 'nothing'. Known: .*thesis"),
        ("pack test .", ".: no files of a pack; expected folders as materials, sources, shapes"),
        ("pack trust thesis", "thesis: has no shapes; expected a pack with shapes, a shape's file"),
        ("check tri --layer-height 0.2", "unknown option '--layer-height': the print quality has it; take another"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(run, words, expected):
    said = run(*words.split())
    assert said.code == 2
    assert re.search(expected, said.line)
    assert not list(Path().iterdir())


def test_from_another_folder(run, unpressed):
    """What is beside the design is not beside the working folder."""
    put(Path("sub"), "material", "eel"), put(Path("sub"), "shape", "zig"), put(Path("sub"), "printer", "mine")
    Path("sub/my.yaml").write_text(DESIGN, encoding="utf-8")
    for words in (["check"], ["predict", "--drawn"], ["draw", "-o", "d.svg"]):
        said = run(words[0], "sub/my.yaml", *words[1:])
        assert (said.code, "sensorgen: " in said.err) == (0, False), words


def test_an_existing_file_stays(run):
    run("new", "material", "eel")
    Path("materials/eel.yaml").write_text("mine", encoding="utf-8")
    assert run("new", "material", "eel").line.startswith("sensorgen: 'materials/eel.yaml' exists; choose another name")
    assert Path("materials/eel.yaml").read_text(encoding="utf-8") == "mine"


def test_a_parameter_with_the_name_of_an_option(run, recwarn, unpressed):
    put(Path(), "shape", "zig", ("height_mm", "tip_mm"))
    said = run("predict", "zig", "--shape-tip", "0.5", "--tip", "5", "--json", "--drawn").clean
    assert json.loads(said.out)["design"]
    assert "--shape-tip" in run("check", "zig", "--help").out.replace("--tip", "--shape-tip")
    assert not [w for w in recwarn if "more than once" in str(w.message)]


def test_where_each_comes_from(run, here, monkeypatch, tmp_path_factory):
    run("new", "material", "eel")
    run("new", "shape", "zig", "--pack", "mine")
    run("pack", "trust", "mine")
    install(tmp_path_factory.mktemp("site"), monkeypatch)
    entries = run("list", "materials", "--json").json
    found = {name: (entries[name]["pack"], entries[name]["where"], entries[name]["version"]) for name in entries}
    assert found["eel"] == (here.name, "beside the design", "")
    assert found["lab-ink"] == ("lab", "installed", "2.1")
    assert found["x60"][:2] == ("thesis", "shipped")
    assert found["ninjatek-eel"][:2] == ("filaments", "shipped")
    printers = run("list", "printers", "--json").json
    assert {name: printers[name]["pack"] for name in printers} == {"diabase-h5": "thesis", "prusa-xl5": "others"}
    shapes = run("list", "shapes", "--json").json
    assert (shapes["zig"]["pack"], shapes["zig"]["where"]) == ("mine", "own")
    assert shapes["zig"]["file"] == str(packs.place() / "mine" / "shapes" / "zig.py")
    assert f"[pack lab 2.1, installed: {entries['lab-ink']['file']}]" in run("list", "materials").words
    assert {"thesis", "mine", "lab"} <= set(run("list", "packs", "--json").json)
    assert run("check", "tri", "--material", "electrode=lab-ink", "--tool", "lab-ink=1").code in (0, 1)


def test_one_damaged_file_does_not_hide_the_others(run):
    run("new", "material", "eel")
    Path("materials/bad.yaml").write_text("title: [", encoding="utf-8")
    said = run("list", "materials").ok
    assert "bad cannot be used: bad.yaml: line" in said.words


@pytest.mark.parametrize(
    ("value", "name", "expected"),
    [
        ("lab_pack.missing", "lab", "there is no folder 'lab_pack/missing' in it"),
        ("lab_pack:__path__", "lab", "names no folder"),
        ("lab_pack", "../lab", "names no folder"),
    ],
)
def test_damaged_entry_points(run, monkeypatch, tmp_path_factory, value, name, expected):
    install(tmp_path_factory.mktemp("site"), monkeypatch, value, name)
    said = run("list", "materials")
    assert "'lab-pack'" in said.refusal
    assert expected in said.line
    assert run("check", "reference").code == 0  # nothing of it is needed


@pytest.mark.parametrize(
    ("file", "text", "expected"),
    [
        ("entry_points.txt", "[sensorgen.packs]\nno sign of what it is\n", "cannot be read|names no folder"),
        ("entry_points.txt", "[sensorgen.packs]\n= lab_pack\n", "names no folder"),
        ("METADATA", None, ""), ("METADATA", "\x00\n", ""),
    ],
)  # fmt: skip
def test_a_damaged_package(run, monkeypatch, tmp_path_factory, file, text, expected):
    site = tmp_path_factory.mktemp("site")
    install(site, monkeypatch)
    path = site / "lab_pack-2.1.dist-info" / file
    path.unlink()
    if text is not None:
        path.write_text(text)
    said = run("list", "materials")
    assert said.code == (2 if expected else 0)
    assert re.search(expected, said.line if expected else "")


def test_what_is_nearer_goes_before_and_what_ships_cannot_be_hidden(here):
    own = packs.place()
    put(own / "one", "material", "eel", ("value: 0.1,", "value: 0.2,"))
    assert packs.find("materials", "eel").pack.name == "one"
    put(here, "material", "eel")
    assert packs.find("materials", "eel").pack.where == packs.BESIDE
    put(own / "two", "material", "ink")
    put(own / "three", "material", "ink")
    with pytest.raises(BadInput, match=r"material 'ink' is in 2 packs: .*three.* and .*two.*; rename or remove one"):
        packs.find("materials", "ink")
    put(here, "material", "x60")
    with pytest.raises(BadInput, match=r"a material 'x60' ships with sensorgen .pack thesis.; rename the file"):
        design.make({"shape": "tri", "materials": {"film": "x60"}})


def test_packs_that_require_each_other(run, here):
    for name, manifest in CYCLE.items():
        put(packs.place() / name, "material", f"{name}-ink")
        (packs.place() / name / "pack.yaml").write_text(manifest)
    assert (
        "packs require each other in a circle: a -> b -> c -> a"
        in run("check", "tri", "--material", "electrode=a-ink", "--tool", "a-ink=1").refusal
    )
    (packs.place() / "c" / "pack.yaml").write_text("requires: [d]")
    assert "requires pack 'd', which is not there; install it, or copy it to" in run("pack", "test", "c").words
    (packs.place() / "c" / "pack.yaml").write_text("requires: [filaments]\nversion: '3'\n")
    assert run("pack", "test", "a").code == 0


def test_the_identity_of_a_design_holds_the_content_of_its_files(here, mine):
    before = made().id()
    assert made(name="other").id() == before
    for name, old, new, same in (
        ("eel", "value: 0.1,", "value: 0.11,", False), ("eel", "# in drawings", "# colour", True),
        ("zig", "p.period_mm / 4", "1.0 * p.period_mm / 4", False),
        ("mine", "[250.0, 210.0]", "[240.0, 210.0]", False), ("mine", "# or: centre", "", True),
    ):  # fmt: skip
        text = mine[name].read_text()
        assert old in text
        mine[name].write_text(text.replace(old, new))
        shape_files.trust(name, mine[name].read_text())
        assert (made().id() == before) is same, (name, new)
        mine[name].write_text(text)
    for name in ("materials", "shapes", "printers"):
        shutil.move(here / name, packs.place() / "moved" / name)
    assert made().id() == before


def test_a_record_of_a_design_does_not_need_its_files_and_goes_to_another_process(here, mine):
    before = made()
    sent, record = pickle.dumps(before), json.dumps(before.resolved())
    for file in mine.values():
        shutil.rmtree(file.parent)
    assert pickle.loads(sent) == before
    for again in (design.of_resolved("zig", json.loads(record)), pickle.loads(sent)):
        assert (again.id(), again.drawn) == (before.id(), before.drawn)
    with pytest.raises(UnknownName, match="unknown shape 'zig'"):
        made()


def test_designs_of_a_batch_have_the_files_beside_them(here):
    put(here / "sub", "material", "eel")
    (here / "sub" / "d.yaml").write_text("shape: reference\nmaterials: {electrode: eel}\ntools: {eel: 1}\n")
    (here / "plan.yaml").write_text("iteration: 1\ndesigns: [{design: sub/d.yaml}]\n")
    plan = plans.load(here / "plan.yaml")
    assert plan.design(plan.designs[0], here).used()["eel"] == ""


@pytest.mark.parametrize(
    "own", ["{shapes: {zig: 5}}", "{shapes: [zig]}", "5", "{forms: {zig: a}}", "{shapes: {zig: ''}}"]
)
def test_what_a_design_brings_is_checked(run, own):
    Path("d.yaml").write_text(f"shape: zig\nown: {own}\n", encoding="utf-8")
    said = run("check", "d.yaml")
    assert said.code == 2
    assert said.line


def test_a_design_cannot_bring_a_material_by_the_name_of_one_that_ships(here):
    text = put(here, "material", "eel").read_text()
    with pytest.raises(BadInput, match="a material 'x60' ships with sensorgen"):
        design.make({"shape": "tri", "own": {"materials": {"x60": text}}})


def test_a_copy_of_a_printer_by_its_path(here):
    text = packs.find("printers", "diabase-h5").text().replace("nozzle_mm: 0.4", "nozzle_mm: 0.3")
    (here / "diabase-h5.yaml").write_text(text)
    found = design.make({"shape": "tri", "printer": "./diabase-h5.yaml"})
    assert (found.machine.name, found.machine.nozzle_mm) == ("diabase-h5", 0.3)
    assert design.of_resolved("tri", json.loads(json.dumps(found.resolved()))).id() == found.id()


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_a_link_out_of_a_pack(run, here, tmp_path_factory):
    secret = tmp_path_factory.mktemp("else") / "eel.yaml"
    secret.write_text("title: secret")
    (here / "materials").mkdir()
    (here / "materials" / "eel.yaml").symlink_to(secret)
    said = run("check", "tri", "--material", "electrode=eel", "--tool", "eel=1")
    assert "a link that leads out of its pack; copy the file to its place" in said.refusal
    assert "secret" not in said.line


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_links_to_themselves_and_folders_that_are_links(run, here, tmp_path_factory):
    outside = put(tmp_path_factory.mktemp("else"), "material", "eel").parent
    (here / "materials").symlink_to(outside)
    words = ("check", "tri", "--material", "electrode=eel", "--tool", "eel=1")
    assert "a link that leads out of its pack; copy the file to its place" in run(*words).line
    (here / "materials").unlink()
    (here / "materials").mkdir()
    (here / "materials" / "eel.yaml").symlink_to("eel.yaml")
    for said in (run(*words), run("pack", "test", ".")):
        assert said.code in (1, 2)
        assert "a link that leads out of its pack" in said.words + said.err
    whole = packs.place() / "lab"  # a pack itself may be a link
    whole.parent.mkdir(parents=True, exist_ok=True)
    whole.symlink_to(outside.parent)
    assert packs.find("materials", "eel", whole.parent).text()


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"a: &a [x]\nb: *a\n", "line 2: aliases .* are not taken"), (b"\0" * 200_000, "200000 bytes; expected at"),
        (b"title: 1\n", "eel.yaml: title is 1; expected text"),
        (b'title: "a\\e[31mb"\nabout: x\ncolour: "#ffffff"\nconductor: true\nproperties: {}\n', "title is .* one line"),
    ],
)  # fmt: skip
def test_hostile_files_of_a_pack(run, here, content, expected):
    (here / "materials").mkdir()
    (here / "materials" / "eel.yaml").write_bytes(content)
    said = run("check", "tri", "--material", "electrode=eel", "--tool", "eel=1")
    assert said.code == 2
    assert re.search(expected, said.line)
    said = run("pack", "test", ".")
    assert said.code == 1
    assert re.search(expected, said.words)
    assert len(list(here.rglob("*"))) == 2


def test_trust_is_of_a_content(run, here):
    file = put(here, "shape", "zig")
    assert design.make({"shape": "zig"}).drawn
    file.write_text(file.read_text() + "\n")
    with pytest.raises(shape_files.NotTrusted, match="not trusted and did not run"):
        design.make({"shape": "zig"})
    assert run("pack", "trust", "shapes/zig.py").out.startswith(f"trusted: {file.relative_to(here)}\n")
    assert design.make({"shape": "zig"}).drawn


@pytest.mark.parametrize(
    "words",
    ["check zig", "check zig --help", "list shapes", "pack test .", "pack test shapes/zig.py", "draw ./shapes/zig.py",
     "check d.yaml", "predict brought.yaml"],
)  # fmt: skip
def test_nothing_of_a_strangers_folder_runs_unasked(run, words, monkeypatch):
    """No process starts before the consent, and each command shows what is missing."""
    text = (TEMPLATES / "shape.py").read_text("utf-8")
    Path("shapes").mkdir()
    Path("shapes/zig.py").write_text(text, "utf-8")
    Path("d.yaml").write_text("shape: zig\n", "utf-8")
    Path("brought.yaml").write_text(f"shape: zig\nown: {{shapes: {{zig: {json.dumps(text)}}}}}\n", "utf-8")
    started = []
    monkeypatch.setattr(shape_files.subprocess, "Popen", lambda *words, **_: started.append(words))
    monkeypatch.setattr(shape_files.shape_process, "module_of", lambda *words: started.append(words))
    said = run(*words.split())
    assert started == []
    assert said.code == (0 if words == "list shapes" else 1 if words.startswith("pack") else 2)
    both = " ".join(f"{said.out} {said.err}".split())
    assert "not trusted" in both
    assert "sensorgen pack trust shapes/zig.py" in both


def test_a_strangers_text_moves_no_terminal_in_the_help_and_takes_none_of_its_options(run):
    text = (TEMPLATES / "shape.py").read_text("utf-8").replace("height_mm", "help")
    text = text.replace("Height of", "a\\x1b[2J\\u202eb")
    Path("shapes").mkdir()
    Path("shapes/zig.py").write_text(text + '\n__doc__ = "Zig.\\x1b]0;owned\\x07\\x9b31m\\u202e"\n', "utf-8")
    Path("shapes/other.py").write_text(text, "utf-8")
    run("pack", "trust", "shapes/zig.py")
    said = run("check", "zig", "--help")
    assert "--shape-help" in said.out
    assert not set("\x1b\x07\x9b\u202e") & set(said.out)
    assert "zig" in run("schema", "design").out  # without the one that is not trusted


def test_a_design_that_brings_its_shape_is_trusted_by_its_file(run):
    text = (TEMPLATES / "shape.py").read_text("utf-8")
    Path("brought.yaml").write_text(json.dumps({"shape": "zig", "own": {"shapes": {"zig": text}}}), "utf-8")
    assert run("pack", "trust", "brought.yaml").out.startswith("trusted: brought.yaml: zig\n")
    assert shape_files.is_trusted(text)
    assert run("check", "brought.yaml").code in (0, 1)


PLANTED = [
    ("material", "source: it-sheet, default: true, low: 210.0", "source: web, default: true, low: 210.0",
     "source: nozzle_temperature_c: source 'web' is not explained"),
    ("material", "youngs_modulus_pa:", "youngs_modulus_mpa:", "quantity: unknown quantity 'youngs_modulus_mpa'"),
    ("material", "value: 5.0, source: it-sheet, default: true", "value: 5.0, source: it-sheet",
     "default: relative_permittivity has no default value"),
    ("material", "value: 0.1,", "value: -0.1,", "read: .*resistivity_ohm_m of it-sheet is -0.1"),
    ("shape", '"bottom"),', '""),', "terminals: terminals are"),
    ("shape", "min(x + 3 * quarter, end)", "min(x + 3 * quarter, end) - 0.1", "support: .*are left empty"),
    ("shape", "from math import ceil", "from math import ceil\n\ntry:\n    import numpy\nexcept ImportError:\n    pass",
     "imports: imports numpy"),
    ("shape", '"Height of the blocks."', '""', "read: zig.py: parameter height_mm has no help"),
    ("shape", "(0.05, 5.0)})\n    film_mm", "(0.5, 5.0)})\n    film_mm", "read: .*default 0.4 is outside its range"),
    ("shape", '"range": (0.5, 50.0)', '"choices": (1, 2)', "read: .*default 4.0 is not among its choices"),
    ("printer", "min_layer_mm: 0.05", "min_layer_mm: 0.5", "read: .*min_layer_mm 0.5 is above nozzle_mm 0.4"),

    ("material", "low: 0.05, high: 0.5", "low: 0.5, high: 0.05",
     "read: it.yaml, line 12: resistivity_ohm_m of it-sheet has low 0.5 above high 0.05"),
    ("material", "{value: 0.1,", "{value: 0.9,", "line 12: .* is 0.9, outside its own range of 0.05 to 0.5"),
    ("material", "20.0e6", "20.0", r"line 16: youngs_modulus_pa of it-sheet is 20; .*1 MPa is 1.0e6 Pa.*implausible"),
    ("shape", "    low = p.electrode_mm", "    import random\n    low = p.electrode_mm * random.uniform(0.9, 1)",
     "random: the same parameters give different bodies"),
    ("shape", "    low = p.electrode_mm", "    low = p.electrode_mm * (1 + hash('a') % 10**9 / 1e10)",
     "random: the same parameters"),
    ("quality", "layer_mm: 0.15  ", "layer_mm: 0.9  ", "profile: no printer that ships can print it"),
]  # fmt: skip


@pytest.mark.parametrize(("what", "old", "new", "expected"), PLANTED, ids=[case[3][:40] for case in PLANTED])
def test_planted_faults_are_found(run, here, what, old, new, expected):
    put(here, what, "zig" if what == "shape" else "it", (old, new))
    said = run("pack", "test", ".", "--json")
    assert said.code == 1
    findings = json.loads(said.out)["findings"]
    assert any(re.search(expected, f"{f['rule']}: {f['message']}") for f in findings), findings


def test_a_fault_of_a_shape_is_one_finding_with_how_many_sensors_have_it(run, here):
    put(here, "shape", "zig", ("box(*whole, low, film)", "box(*whole, low, film + 0.02)"))
    found = run("pack", "test", ".", "--json").json["findings"]
    assert [f["rule"] for f in found] == ["scene", "scene", "volume", "support"]
    assert found[0]["message"] == "film / blocks: overlap by 0.6 mm3 (in 13 of 13 sensors tried)"


def test_a_source_that_a_command_wrote_is_tested_where_it_is(run):
    file = files.data(packs.SOURCES, "materials") / "bars-1.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    text = "about: bars\nmaterials: {etpu: {youngs_modulus_pa: {value: 2.0e7, low: 1.0e6, high: 1.0e8}}}\n"
    file.write_text(text, "utf-8")
    said = run("pack", "test", str(file))
    assert (said.code, "1 file, no findings" in said.words) == (0, True)


@pytest.mark.parametrize(
    ("name", "what", "folder", "expected"),
    [
        ("eel.yml", "material", "materials", "materials/eel.yml: nothing reads this file -> rename it to eel.yaml"),
        ("My Eel.yaml", "material", "materials", "nothing reads this file -> rename it to my-eel.yaml"),
        ("eel.yaml", "material", "shapes", "shapes/eel.yaml: nothing .* -> move it to materials, as eel.yaml"),
        ("zig.py", "shape", "materials", "materials/zig.py: nothing .* -> move it to shapes, as zig.py"),
        ("mine.yaml", "printer", "materials", "mine.yaml: .* -> it holds a printer: move it to printers"),
        ("eel.yaml", "material", "material", "material/: nothing reads this folder -> rename it to materials"),
        ("eel.yaml", "material", ".", "eel.yaml: nothing reads this material here -> move it to materials"),
    ],
)
def test_a_file_in_a_wrong_place_is_found(run, here, name, what, folder, expected):
    text = put(here / "else", what, "it").read_text("utf-8")
    (here / "pack" / folder).mkdir(parents=True, exist_ok=True)
    (here / "pack" / folder / name).write_text(text)
    (here / "pack" / "pack.yaml").write_text("version: '1'\n")
    said = run("pack", "test", "pack", "--json")
    assert said.code == 1
    found = json.loads(said.out)["findings"]
    assert len(found) == 1
    assert re.search(expected, f"{found[0]['body']}: {found[0]['message']} -> {found[0]['advice']}")


def test_planted_faults_of_sources(run, here):
    (here / "sources").mkdir()
    text = "about: bars\nmaterials: {etpu: {youngs_modulus_pa: {value: VALUE, low: 1.0, high: 1.0e8}}}\n"
    for value, code, expected in (("2.0e7", 1, "is 1; expected 100 to"), ("2.0e9", 1, "outside its own range of 1 to")):
        (here / "sources" / "lab-1.yaml").write_text(text.replace("VALUE", value))
        said = run("pack", "test", ".")
        assert (said.code, expected in said.words) == (code, True)
    (here / "sources" / "lab-1.yaml").write_text(text.replace("VALUE", "2.0e7").replace("1.0,", "1.0e6,"))
    assert run("pack", "test", ".").code == 0


def test_a_name_in_two_packs_is_found_with_both_places(run):
    for name in ("one", "two"):
        put(packs.place() / name, "material", "ink")
    said = run("pack", "test", "one")
    assert said.code == 1
    assert "pack two has a material 'ink' too" in said.words
    assert str(packs.place() / "two" / "materials" / "ink.yaml") in said.out.replace("\n       ", "")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("  G28\n", "  M999 S1\n", "start and end code, line 3: mine has no M999"),
        ("max_nozzle_c: 250.0", "max_nozzle_c: 200.0", "no profile for "),
        ("{etpu: 0, x60: 1}", "{etpy: 0, x60: 1}", "default_tools: tool 0 has unknown material 'etpy'"),
    ],
)
def test_check_and_build_refuse_a_printer_that_pack_test_refuses(run, here, old, new, expected):
    put(here, "printer", "mine")
    words = ("reference", "--printer", "mine", "--tool", "etpu=0")
    assert run("check", *words).code == 0
    put(here, "printer", "mine", (old, new))
    assert expected in run("pack", "test", ".").words
    for command in (("check",), ("build", "--no-cad")):
        said = run(command[0], *words, *command[1:])
        assert said.code in (1, 2)
        assert expected in said.words + said.err
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("ranges:", "range:", "read"), ("  - [100.0, 0.01, 0.004]", "  - [100.0, 0.01]", "read"),
        ("0.1, 0.0, 0.0]", "-0.1, 0.0, 0.0]", "limits"),
        ("  - [1.0e+3, 0.01, 0.001]", "  - [1.0e+3, 0.0, 0.0]", "limits"),
    ],
)  # fmt: skip
def test_planted_faults_of_instruments(run, old, new, rule):
    run("new", "instrument", "m-100")
    file = Path("instruments/m-100.yaml")
    assert run("pack", "test", str(file)).code == 0
    text = file.read_text("utf-8").replace(old, new)
    file.write_text(text.replace("leads_ohm: 0.2", "leads_ohm: 0.0"), "utf-8")
    said = run("pack", "test", str(file), "--json")
    assert (said.code, json.loads(said.out)["findings"][0]["rule"]) == (1, rule)


@pytest.mark.parametrize("name", [pytest.param("thesis", marks=pytest.mark.nightly), "filaments", "others"])
def test_packs_that_ship_have_no_findings(run, name):
    """That of the thesis has all shapes, each of which tests/shapes tries at one size."""
    assert run("pack", "test", name).out.endswith("no findings\n")


def test_an_own_dielectric(run, unpressed):
    put(Path(), "material", "gel", ("conductor: true", "conductor: false"))
    put(Path(), "printer", "mine")
    taken = ["--material", "dielectric=gel", "--tool", "gel=1", "--tool", "etpu=0", "--printer", "mine"]
    said = run("predict", "tri", *taken, "--drawn", "--json").clean
    found = design.make({"shape": "tri", "materials": {"dielectric": "gel", "film": "x60"}, "tools": {"gel": 1}})
    assert (found.materials.film, found.materials.isolation) == ("x60", "gel")
    values = {(v["material"], v["quantity"]): v for v in json.loads(said.out)["values"]}
    assert values["gel", "relative_permittivity"]["value"] == 5.0


def test_an_instrument_beside_the_readings(here):
    (here / "instruments").mkdir()
    text = (TEMPLATES / "instrument.yaml").read_text("utf-8").replace("NAME", "LCR-7")
    (here / "instruments" / "lcr-7.yaml").write_text(text)
    accuracy._all.cache_clear()
    try:
        assert accuracy.find("LCR-7").dc_ohm(50.0, 4) == pytest.approx((50 * 1e-4 + 100 * 4e-5) / 3**0.5)
    finally:
        accuracy._all.cache_clear()


def test_both_electrodes_by_one_word():
    found = design.make({"shape": "tri", "materials": {"electrode": "etpu@thesis-3.2", "top_electrode": "etpu"}})
    assert (found.materials.top_electrode, found.materials.bottom_electrode) == ("etpu", "etpu@thesis-3.2")


def test_own_sources_of_fits_are_in_packs_too(here):
    (packs.place() / "fits" / "sources").mkdir(parents=True)
    text = "about: bars of June\nmaterials: {etpu: {resistivity_ohm_m: {value: 0.3}}}\n"
    (packs.place() / "fits" / "sources" / "bars-6.yaml").write_text(text)
    found = design.make({"shape": "tri", "materials": {"electrode": "etpu@bars-6"}})
    assert found.own["sources"]["bars-6"] == text
    assert found.material("etpu").value("resistivity_ohm_m", "bars-6").value == 0.3
    assert materials.cited(found.own) == {"bars-6": "bars of June"}


def test_the_commands_of_the_page(run, here):
    """In one folder, one after the other; the design of the page too."""
    page = (Path(__file__).parents[2] / "docs" / "packs.md").read_text("utf-8")
    for line in re.search(r"```sh\n(.*?)```", page, re.DOTALL)[1].splitlines():
        assert run(*line.partition("#")[0].split()[1:]).code == 0
    put(here, "printer", "mine").rename(here / "lab-printer.yaml")
    (here / "design.yaml").write_text(re.search(r"```yaml\n(.*?)```", page, re.DOTALL)[1])
    assert run("check", "design.yaml").code == 0


@pytest.mark.usefixtures("at_rest", "shared_cache", "roughly")
def test_a_synced_log_is_reported_where_its_shape_is_not_trusted(run, here, monkeypatch):
    """Nothing of it runs; the report is of all else, and names what to trust, by the file's own SHA-256."""
    shape = put(here, "shape", "zig")
    content = shape.read_bytes()
    Path("z.yaml").write_text("shape: zig\n", "utf-8")
    assert run("log", "specimen", "Z1", "--design", "z.yaml", "--log", "one.db").code == 0
    for name in ("Z1", "23 triX .2mm"):
        assert run("log", "add", name, "--y", "0.7k", "--z", "OL", "--log", "one.db").code == 0
    assert run("log", "sync", "share", "--log", "one.db").code == 0
    monkeypatch.setenv(packs.PLACE, str(here / "another"))
    shape.unlink()
    assert run("log", "sync", "share", "--log", "two.db").code == 0
    words = ("--log", "two.db", "--format", "md", "-o", "r.md")
    with monkeypatch.context() as patch:
        patch.setattr(shape_files.shape_process, "module_of", lambda *_: pytest.fail("it ran"))
        said = run("report", *words)
    assert said.code == 0
    text, key = said.words, sha256(content).hexdigest()
    assert "Electrode resistance of 23 triX .2mm: measured 700 ohm" in text
    assert "Not compared: shape of Z1, z: zig.py is not trusted and did not run" in text
    assert f"sensorgen pack trust shapes/zig.py (its file, or the design's that contains it), and again after each " \
           f"change; SHA-256 {key}." in text  # fmt: skip
    assert "another version of sensorgen" not in Path("r.md").read_text("utf-8")
    shape.write_bytes(content)
    assert run("pack", "trust", "shapes/zig.py").code == 0
    said = run("report", "Z1", *words).out
    assert said.startswith("Electrode resistance of Z1: measured 700 ohm, predicted")
    assert "Not compared" not in said
