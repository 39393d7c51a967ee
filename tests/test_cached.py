"""The cache of answers: what it keeps, what it forgets, and what it survives."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import pytest

from sensorgen.core import cache as cached
from sensorgen.prediction.capacitance import capacitance
from sensorgen.scene.scene import Body, Scene, box

pytestmark = pytest.mark.own_cache
QUESTION = {"what": "sum", "terms": [1, 2.5], "eps": {"x60": 4.68}}


def never():
    raise AssertionError("solved again")


def entries():
    return [p for p in cached.folder().rglob("*") if p.is_file()]


def test_a_question_is_worked_out_once_whatever_the_order_of_its_keys():
    assert cached.answer(QUESTION, lambda: {"value": 0.1 + 0.2}) == {"value": 0.1 + 0.2}
    assert cached.answer(dict(reversed(QUESTION.items())), never) == {"value": 0.1 + 0.2}
    assert len(entries()) == 1
    for change in ({"what": "product"}, {"terms": [2.5, 1]}, {"eps": {"x60": 4.680000000000001}}, {"more": None}):
        assert cached.known(QUESTION | change) is None


def test_a_capacitance_is_known_of_the_same_sensor_alone():
    plates = (Body("low", "etpu", (box(0, 1, 0, 1, 0, 1),), "bottom"), Body("film", "x60", (box(0, 1, 0, 1, 1, 2),)),
              Body("high", "etpu", (box(0, 1, 0, 1, 2, 3),), "top"))  # fmt: skip
    eps = {"air": 1.0, "x60": 4.68}
    for of, permittivity, known in (
        (Scene(plates, (1.0, 1.0, 3.0)), eps, False),
        (Scene(plates, (1.0, 1.0, 3.0)), eps, True),
        (Scene(plates, (1.0, 1.0, 4.0)), eps, False),
        (Scene(plates, (1.0, 1.0, 3.0)), eps | {"x60": 4.69}, False),
        (Scene((replace(plates[0], material="pla"), *plates[1:]), (1.0, 1.0, 3.0)), eps, False),
    ):
        assert capacitance(of, permittivity, 1e-3).known is known


def test_an_answer_of_nothing_is_asked_again():
    assert cached.answer(QUESTION, lambda: None) is None
    assert cached.answer(QUESTION, lambda: 2) == 2


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[: len(text) // 2], lambda text: text.replace("12345", "12346"),
        lambda text: text.replace("4.68", "4.67"), lambda text: "[" * 100_000, lambda text: '"text"',
    ],
)  # fmt: skip
def test_damaged_entries_are_ignored_and_rewritten(damage):
    cached.answer(QUESTION, lambda: {"value": 12345})
    (file,) = entries()
    sound = file.read_text()
    file.write_text(damage(sound))
    assert file.read_text() != sound
    assert cached.known(QUESTION) is None
    assert cached.answer(QUESTION, lambda: {"value": 12345}) == {"value": 12345}
    assert file.read_text() == sound


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "file" / "below"))
    assert [cached.answer(QUESTION, lambda k=k: k) for k in (1, 2)] == [1, 2]


def test_an_entry_is_replaced_whole_or_not_at_all(monkeypatch):
    """The disk fills up amid the writing: the old entry stays, and no piece of the new one."""
    cached.keep(QUESTION, 1)

    def full(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as now:
        now.setattr(os, "fsync", full)
        cached.keep(QUESTION, 2)
    assert cached.known(QUESTION) == 1
    assert len(entries()) == 1


def test_other_code_asks_anew(monkeypatch):
    cached.answer(QUESTION, lambda: 1)
    monkeypatch.setattr(cached, "_version", lambda: "other")
    assert cached.answer(QUESTION, lambda: 2) == 2


def test_the_version_covers_the_models_and_what_they_stand_on(monkeypatch, tmp_path):
    package = tmp_path / "sensorgen"
    for folder in ("models/_deep", "solvers", "scene", "core"):
        (package / folder).mkdir(parents=True)
    files = ["models/a.py", "models/_deep/b.py", "models/c.yaml", "solvers/d.py", "scene/e.py", "core/units.py"]
    for name in files:
        (package / name).write_text("1")
    monkeypatch.setattr(cached, "__file__", str(package / "core" / "cache.py"))
    found = []
    for name in (None, *files):
        if name:
            (package / name).write_text("2")
        cached._version.cache_clear()
        found.append(cached._version())
    cached._version.cache_clear()
    assert len(set(found)) == len(found)


WRITER = """
import sys
from sensorgen.core import cache as cached
for k in range(60):
    question = {"k": k % 7}
    assert cached.answer(question, lambda: [k % 7] * 1000) == [k % 7] * 1000
    cached.keep(question, [k % 7] * 1000)
"""


def test_writers_at_once():
    """Three processes write and read the same entries: none sees half of one."""
    writers = [subprocess.Popen([sys.executable, "-c", WRITER], stderr=subprocess.PIPE) for _ in range(3)]
    said = [writer.communicate(timeout=120)[1] for writer in writers]
    assert said == [b"", b"", b""]
    assert [w.returncode for w in writers] == [0, 0, 0]
    files = entries()
    assert len(files) == 7
    assert all(json.loads(f.read_text())["answer"] for f in files)


def test_what_is_held_back_is_for_another_to_keep():
    with cached.held_back() as new:
        assert cached.answer(QUESTION, lambda: 3) == 3
    assert (new, entries()) == ([(QUESTION, 3)], [])
    cached.keep(*new[0])
    with cached.held_back() as new:
        assert cached.answer(QUESTION, never) == 3
    assert new == []
