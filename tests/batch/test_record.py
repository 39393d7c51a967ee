"""The record of a batch: whole, traceable, and what differs from it is found."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from sensorgen.core import document
from sensorgen.core.errors import BadInput, Unprintable, Unwritable
from sensorgen.design import design
from sensorgen.design.specimen_name import parse
from sensorgen.measure.log import Log, exchange
from sensorgen.prediction.bodies import estimated
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import to_json
from sensorgen.workflows.batch import make
from sensorgen.workflows.batch.record import RECORD
from sensorgen.workflows.sealed import Differences, batch_differences, seal

TRI = design.make({"shape": "tri", "parameters": {"length_mm": 20.0, "width_mm": 10.0}})


WRITTEN = ("it does not hold what was written",)


def differences(folder, log=None):
    return batch_differences(folder, RECORD, log)


def read(folder):
    return json.loads((folder / RECORD).read_text("utf-8"))


@pytest.fixture
def copy(small, tmp_path):
    """The small batch in a folder that a test may spoil."""
    return Path(shutil.copytree(small.folder, tmp_path / "copy"))


def test_every_file_has_its_hash(small, contents):
    record = read(small.folder)
    assert record == json.loads(document.to_json(small.record))
    files = {k: hashlib.sha256(v).hexdigest() for k, v in contents(small.folder).items() if k != RECORD}
    assert record["files"] == files
    plates = {f"small.{slicer}.3mf" for slicer in ("prusa", "cura", "orca")}
    assert {"plan.yaml", "plate.svg", "labels.html"} | plates <= set(files)


def test_every_specimen_is_traced_to_its_design_and_has_what_it_should_measure(small):
    record = read(small.folder)
    found = record["specimens"]
    assert sorted(found) == ["26 SX60 1 fine", "26 triX .2mm 1 fine", "26 triX .2mm 2 fine"]
    assert [s["order"] for s in found.values()] == [1, 2, 3]
    tri = found["26 triX .2mm 2 fine"]
    assert (tri["design_id"], tri["copy"], tri["iteration"]) == (TRI.id(), 2, 26)
    predicted = json.loads(to_json(evaluate(estimated(TRI))))
    assert record["predictions"][TRI.id()] == predicted
    # The plate's C by hand: eps0 4.68 A/d = 8.854e-12 x 4.68 x 2e-4 / 6e-4.
    plate = record["predictions"][found["26 SX60 1 fine"]["design_id"]]["capacitance"]["value"]
    assert plate == pytest.approx(8.8541878128e-12 * 4.68 * 20e-3 * 10e-3 / 0.6e-3, rel=1e-8)
    assert record["designs"][TRI.id()]["resolved"] == json.loads(json.dumps(TRI.resolved()))
    assert all(parse(name).name == name for name in found)


def test_the_design_files_beside_it_make_the_same_designs(small):
    for key in small.record.designs:
        data = json.loads((small.folder / "designs" / f"{key}.json").read_text("utf-8"))
        assert design.make(data).id() == key


def test_tools_lots_and_the_checklist(small):
    tools = read(small.folder)["tools"]
    assert {tool: (t["material"], t["lot"], t["cam_dial"]) for tool, t in tools.items()} == {
        "3": ("etpu", "PI-2026-014", 3.0), "4": ("x60", None, 5.0),
    }  # fmt: skip
    lines = read(small.folder)["checklist"]
    text = "\n".join(lines)
    for said in (
        "Dry etpu (lot PI-2026-014): 65 C for 5 h", "Load T4 with x60 (lot not named", "Cam dial of T3: 3",
        "Cam dial of T4: 5", "Clean the nozzles of T3, T4", "level", "Bake at 150 C for 24 h",
    ):  # fmt: skip
        assert said in text
    words = ("Dry", "Load", "level", "not baked", "Bake")
    order = [next(k for k, line in enumerate(lines) if word in line) for word in words]
    assert order == sorted(order)


@pytest.mark.own_cache
def test_made_again_it_is_the_same_to_the_byte(small, tmp_path, contents):
    plan = tmp_path / "small.yaml"
    plan.write_bytes((small.folder / "plan.yaml").read_bytes())
    assert contents(make(plan, tmp_path / "out", gcode=False).folder) == contents(small.folder)


def test_a_record_of_an_earlier_version_verifies(tmp_path):
    """Written by hand: version 0.1.0 had the prediction of a specimen in ``expected``."""
    (tmp_path / "plate.svg").write_text("<svg/>")
    files = {"plate.svg": hashlib.sha256(b"<svg/>").hexdigest()}
    content = {"batch": "26", "specimens": {"26 triX": {"expected": {"capacitance_f": 1e-5}}}, "files": files}
    seal = hashlib.sha256(json.dumps(content, sort_keys=True, ensure_ascii=False).encode()).hexdigest()
    (tmp_path / RECORD).write_text(json.dumps(content | {"sha256": seal}))
    assert not differences(tmp_path)
    (tmp_path / RECORD).write_text(json.dumps(content | {"sha256": seal, "batch": "27"}))
    assert differences(tmp_path) == Differences(record=WRITTEN)


def test_the_keys_of_a_record_stay(small):
    record = read(small.folder)
    assert set(record) == {
        "batch", "iteration", "seed", "printer", "quality", "layout", "tower", "tools", "checklist", "bake",
        "specimens", "predictions", "designs", "slicers", "versions", "files", "sha256",
    }  # fmt: skip
    (piece, *_), (spool, *_) = list(record["specimens"].values()), list(record["tools"].values())
    assert set(piece) == {"order", "design", "design_id", "iteration", "copy", "centre_mm", "size_mm"}
    assert set(spool) == {"material", "title", "lot", "drying", "cam_dial", "note"}


def test_verify_finds_what_is_missing_changed_and_extra(copy):
    (copy / "plate.svg").unlink()
    with (copy / "small.prusa.3mf").open("r+b") as file:
        file.seek(100)
        file.write(b"x")
    (copy / "notes.txt").write_text("mine")
    assert differences(copy) == Differences(("plate.svg",), ("small.prusa.3mf",), ("notes.txt",))


def test_verify_finds_a_record_that_was_rewritten(copy):
    path = copy / RECORD
    text = path.read_text("utf-8")
    path.write_text(text.replace("PI-2026-014", "PI-2026-015"), "utf-8")
    found = differences(copy)
    assert found == Differences(record=WRITTEN)
    assert found  # which decides the exit code


def test_verify_finds_links_and_keys_that_stand_twice(copy, tmp_path):
    path = copy / RECORD
    path.write_text(path.read_text("utf-8").replace('"batch":', '"batch": "another",\n  "batch":', 1), "utf-8")
    assert differences(copy).record == ("key 'batch' stands twice",)
    (copy / "plate.svg").replace(tmp_path / "plate.svg")
    (copy / "plate.svg").symlink_to(tmp_path / "plate.svg")  # of the same content
    assert differences(copy).links == ("plate.svg",)


def test_a_record_that_was_sealed_anew_is_found_by_the_log(copy, tmp_path):
    with Log(tmp_path / "log.db", create=True) as log:
        exchange.import_file(log, copy / RECORD, {})
        assert not differences(copy, log)
        data = read(copy)
        data["tools"][next(iter(data["tools"]))]["lot"] = "another"
        (copy / RECORD).write_text(json.dumps(data | {"sha256": seal(data)}), "utf-8")
        assert not differences(copy)
        assert differences(copy, log).record == ("batch.json is not the one that the log has of batch small",)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "expected the folder of a batch"),
        (b"", "not the record of a batch"),
        (b"{", "not the record"),
        (b"[]", "'files' is None"),
        (b'{"files": 3}', "'files' is 3; expected names to hashes"),
        (b'{"files": {"a": 3}}', "expected names to hashes"),
        (b"\xff\xfe\x00", "not the record of a batch"),
        (b"[" * 100_000, "not the record of a batch"),
    ],
)
def test_verify_of_what_is_no_batch(tmp_path, content, said):
    if content is not None:
        (tmp_path / RECORD).write_bytes(content)
    with pytest.raises(BadInput) as error:
        differences(tmp_path)
    assert said in str(error.value)


def test_tabs_take_room_and_files_of_an_earlier_batch_go_and_others_stay(plan, tmp_path):
    """Labels have the head of the log, which proves what was in it before the print."""
    path = plan("labels: {tab: true}\n" + plan().read_text("utf-8"))
    folder = make(path, tmp_path / "out", gcode=False, log_head="0123456789abcdef" * 4).folder
    assert folder.joinpath("labels.html").read_text("utf-8").count("<p>log 0123456789abcdef</p>") == 3
    assert all(piece["size_mm"][0] > 30 for piece in read(folder)["specimens"].values())
    assert not differences(folder)
    (folder / "mine.txt").write_text("mine")
    path.write_text(path.read_text("utf-8").replace("tab: true", "sheet: false"), "utf-8")
    make(path, tmp_path / "out", gcode=False)
    assert not (folder / "labels.html").exists()
    assert differences(folder) == Differences(extra=("mine.txt",))


@pytest.mark.usefixtures("roughly")
def test_a_design_that_cannot_be_printed_stops_the_batch(plan, tmp_path):
    size = "length_mm: 20, width_mm: 10"
    sound, short = (f"{{shape: tri, parameters: {{{size}{film}}}}}" for film in ("", ", dielectric_mm: 0.0"))
    path = plan(f"iteration: 26\ndesigns: [{sound}, {short}]\n")
    with pytest.raises(Unprintable, match=r"^trix-d0-length20: .*electrodes touch") as error:
        make(path, tmp_path / "out", gcode=False)
    assert error.value.findings
    assert not (tmp_path / "out").exists()
    found = make(path, tmp_path / "out", gcode=False, force=True)
    expected = read(found.folder)["predictions"][read(found.folder)["specimens"]["26 triX 1 fine"]["design_id"]]
    assert expected["drawn"]["status"] == "short"
    assert expected["drawn"]["reason"]


def test_a_plan_too_large_says_how_many_plates(plan, tmp_path):
    path = plan("iteration: 26\ndesigns: [{shape: tri, replicates: 70}]\n")
    with pytest.raises(BadInput, match=r"70 specimens need 3 plates, 33 of them on the first"):
        make(path, tmp_path / "out", gcode=False)


def test_a_place_that_cannot_be_written_to(plan, tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(Unwritable, match="is a file; expected a folder"):
        make(plan(), tmp_path / "out", gcode=False)
