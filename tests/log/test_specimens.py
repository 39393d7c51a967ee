"""Specimens of any name: bound to a design, measured, reported beside that design's prediction."""

import csv
from pathlib import Path

import pytest

from sensorgen.analysis.comparison import of_iteration
from sensorgen.cli.log_command import DEFECTS as CHOICES
from sensorgen.core.errors import BadInput
from sensorgen.design.design import load, make
from sensorgen.measure.log import Batch, Log, Print, RawFile, Reading, exchange, logbook, notes, prints, sync
from sensorgen.measure.log.entries import DEFECTS
from sensorgen.measure.log.prints import design_row
from sensorgen.prediction import bodies

OWN = "shape: tri\nname: mysensor\nparameters: {length_mm: 120, width_mm: 6, dielectric_mm: 0.3}\n"


@pytest.fixture
def own(tmp_path):
    """A design file whose shape and film are those of the thesis's trix-d0.3, and nothing else."""
    (tmp_path / "mysensor.yaml").write_text(OWN)
    return tmp_path / "mysensor.yaml"


def test_the_command_has_the_defects_of_the_log():
    assert CHOICES == DEFECTS


def test_a_free_name_gets_its_design_in_every_later_row(run, own, path):
    assert "S1: design mysensor" in run("add", "S1", "--design", own, "--y", "4.5k", "--C", "25pF@1kHz").words
    assert run("add", " S1 ", "--z", "OL", "--defect", "hole").code == 0
    assert run("specimen", "S2", "left 3", "--design", "mysensor", "--iteration", "5").out.count("print") == 2
    assert "these specimens with this very design" in run("specimen", "S2", "--design", own).words
    with Log(path) as log:
        first, second = log.readings(specimen="S1")
        assert {first.design_id, second.design_id} == {load(own).id()}
        assert (first.shape, first.film_mm, first.axes) == ("tri", 0.3, "X")
        assert (first.quantity, first.value, second.defects) == (("Cp",), (2.5e-11,), ("hole",))
        assert next(log.entries(Print, specimen="left 3")).iteration == 5
    assert "Cp 25 pF at 1kHz" in run("list").words
    assert "design mysensor" in run("show", "S1").words


WRONG = {
    "unbound": (("add", "S9", "--y", "1"), "log specimen NAME --design FILE"),
    "digits alone": (("specimen", "17", "--design", "FILE"), "a letter among them"),
    "no design": (("specimen", "S1"), "neither of --design and --printed"),
    "unknown design": (("specimen", "S1", "--design", "tri"), "expected a design file"),
    "no print": (("specimen", "S1", "--printed", "23 triX"), "no print '23 triX' in the log"),
    "no frequency": (("add", "23 triX", "--C", "12pF"), "write it behind the value, as 12.3pF@1kHz"),
    "unit of another": (("add", "23 triX", "--C", "12ohm@1kHz"), "unit 'ohm'; expected F"),
    "direct current": (("add", "23 triX", "--R", "12ohm@0Hz"), "DC resistances go to --y and --z"),
    "no number": (("add", "23 triX", "--Z", "much@1kHz"), "no number"),
    "defect": (("add", "23 triX", "--defect", "hol"), "did you mean 'hole'?"),
    "photo": (("add", "23 triX", "--photo", "none.jpg"), "none.jpg"),
}


@pytest.mark.parametrize(("words", "message"), WRONG.values(), ids=WRONG)
def test_wrong_words_are_refused_and_nothing_is_logged(run, own, path, words, message):
    said = run(*(own if word == "FILE" else word for word in words))
    assert said.code == 2
    assert message in said.line
    if path.exists():
        with Log(path) as log:
            assert log.head() == (0, "")


def test_two_designs_under_one_name_are_refused_until_the_first_is_withdrawn(run, own, tmp_path, path):
    other = tmp_path / "other.yaml"
    other.write_text(OWN.replace("120", "110").replace("mysensor", "other"))
    run("specimen", "S1", "--design", own)
    said = run("specimen", "S1", "--design", other)
    assert said.code == 2
    assert "S1" in said.line
    assert "sensorgen log withdraw print 1 --reason TEXT" in said.line
    assert run("withdraw", "print", "1", "--reason", "wrong").code == 0
    assert run("specimen", "S1", "--design", other).code == 0
    with Log(path) as log:
        assert log.bound("S1").design == "other"


def test_a_name_that_was_measured_as_another_design_is_refused(run, own):
    run("add", "23 triX", "--y", "3k")
    assert "was measured as trix-d0" in run("specimen", "23 triX", "--design", own).line


def test_two_machines_with_two_designs_under_one_name_are_told_and_left_out(tmp_path, own):
    other = tmp_path / "other.yaml"
    other.write_text(OWN.replace("120", "110"))
    for machine, design in (("a", own), ("b", other)):
        with Log(tmp_path / f"{machine}.db", create=True) as log:
            prints.bind(log, ["S1"], str(design))
            log.add([notes.reading("S1", "4k", log=log)])
            sync.sync(log, tmp_path / "shared")
    with Log(tmp_path / "a.db") as log:
        sync.sync(log, tmp_path / "shared")
        with pytest.raises(BadInput, match="cannot be"):
            log.bound("S1")
        found = of_iteration(log, None)
        assert not found.predictions
        assert any("withdraw one of the prints" in why for _, why in found.left_out)


@pytest.mark.usefixtures("at_rest")
def test_an_own_design_is_never_compared_with_the_thesis_design_of_a_similar_name(log, own):
    """As a newcomer's sensor was: predicted as trix-d0.3, for its shape and film."""
    prints.bind(log, ["1 triX .3mm 1 fine"], str(own), iteration=1)
    log.add([notes.reading("1 triX .3mm 1 fine", "4.5k", log=log)])
    found = of_iteration(log, 1, body_of=bodies.drawn)
    assert {of.design_id for of in found.predictions.values()} == {load(own).id()}
    assert found.rows[0].predicted.design == "mysensor"


def test_a_print_whose_design_the_log_lacks_is_not_taken_for_what_its_name_stands_for(log):
    bed = Batch(uid="b", batch="bed", file="f" * 64)
    log.add([
        RawFile(uid="f" * 64, name="batch.json", size=1), bed,
        Print(uid="p", specimen="1 triX .3mm", iteration=1, batch_uid="b", design_id="0" * 16, design="mysensor"),
        notes.reading("1 triX .3mm", "4.5k"),
    ])  # fmt: skip
    found = of_iteration(log, 1, body_of=bodies.drawn)
    assert not found.predictions
    assert ("design of 1 triX .3mm", f"printed of mysensor ({'0' * 16}), which the log does not have: sensorgen log "
            "predict its file") in found.left_out  # fmt: skip


@pytest.mark.usefixtures("at_rest")
def test_two_designs_of_one_name_stay_apart(log, own, tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "mysensor.yaml").write_text(OWN.replace("120", "60"))
    for name, file in (("S1", own), ("S2", tmp_path / "b" / "mysensor.yaml")):
        prints.bind(log, [name], str(file))
        log.add([notes.reading(name, "4.5k", log=log)])
    found = of_iteration(log, None, body_of=bodies.drawn)
    long, short = (row.predicted.ry_ohm.value for row in found.rows)
    assert long / short == pytest.approx(2, rel=0.05)


def test_a_name_on_a_bed_is_bound_to_the_place_on_it(log):
    design = make({"shape": "tri", "parameters": {"length_mm": 50.0}, "name": "short"})
    log.add([
        RawFile(uid="f" * 64, name="batch.json", size=1), Batch(uid="b", batch="bed 7", file="f" * 64),
        design_row(design.id(), design.name, design.resolved()),
        Print(uid="p", specimen="26 triX .2mm 2", iteration=26, batch_uid="b", design_id=design.id(), design="short"),
    ])  # fmt: skip
    prints.bind(log, ["S1"], printed="26 triX .2mm 2")
    log.add([notes.reading("S1", "4.5k", log=log)])
    (reading,) = log.readings()
    assert (reading.batch, reading.design, reading.iteration) == ("bed 7", "short", 26)
    assert log.bound("S1").printed == "26 triX .2mm 2"


def test_an_export_of_the_first_version_is_read_and_quantities_come_back(run, own, path, tmp_path):
    run("add", "S1", "--design", own, "--y", "4.5k", "--C", "25/26±0.1pF@1kHz", "--temperature", "21", "--unbaked")
    run("export", "new")
    with Path("new/readings.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["quantity"], row["temperature_c"]) == ('["Cp", "Cp"]', "21.0")
    first = list(row)[: list(row).index("quantity")]
    with Path("old.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, first, extrasaction="ignore")
        writer.writeheader()
        writer.writerow(row)
    for source, quantity in (("new", ("Cp", "Cp")), ("old.csv", ())):
        with Log(tmp_path / f"{source}.db", create=True) as other:
            exchange.import_file(other, Path(source), {})
            (back,) = other.entries(Reading)
            assert (back.quantity, back.y_ohm) == (quantity, (4500.0,))


def test_a_reading_whose_parts_do_not_match_is_no_reading():
    with pytest.raises(BadInput, match="expected as many of each"):
        Reading(uid="1", specimen="S1", written="S1", quantity=("Cp",), value=(1.0, 2.0), frequency_hz=(1e3,))
    with pytest.raises(BadInput, match="expected some of"):
        Reading(uid="1", specimen="S1", written="S1", quantity=("C",), value=(1.0,), frequency_hz=(1e3,))


def test_a_withdrawn_print_binds_no_more(log, own):
    prints.bind(log, ["S1"], str(own))
    logbook.withdraw(log, "print", 1, "wrong")
    assert log.bound("S1") is None
    with pytest.raises(BadInput, match="log specimen NAME"):
        notes.named("S1", log)


@pytest.mark.parametrize(
    ("readings", "intact"),
    [
        pytest.param([(100, 2e6)] * 3, 0, id="prints that all broke do not vouch for each other"),
        pytest.param([(20, 280), (20, 2e6), (20, 3e6)], 1, id="no k was lost beside two broken tracks"),
        pytest.param([(20, 420), (20, 392), (20, 448), (100, 2100)], 4, id="a long print beside short ones"),
    ],
)
def test_a_print_is_judged_by_others_only_as_far_as_they_are_sound(run, tmp_path, path, shared_cache, readings, intact):
    """Plates by their length [mm] and reading: 280 ohm and 1.4 kohm by rho l / (w t), of 0.042 ohm m and 0.3 mm."""
    for k, (length, ohm) in enumerate(readings):
        design = tmp_path / f"plate{length}.yaml"
        design.write_text(f"shape: reference\nparameters: {{length_mm: {length}}}\n")
        assert run("add", f"P{k}", "--design", design, "--y", f"{ohm:g}", "--z", "OL").code == 0
    with Log(path) as log:
        found = of_iteration(log, None, specimens=[f"P{k}" for k in range(len(readings))])
    words = ["intact"] * intact + ["open electrode"] * (len(readings) - intact)
    assert [row.verdict.word for row in found.last] == words
