"""``sensorgen thesis``: what it writes, and how it ends."""

import json

import pytest

from sensorgen.verification import thesis
from sensorgen.verification.thesis.items import UNEXPLAINED, ItemVerdict, ReproducedItem, chapter, row


@pytest.fixture
def few(monkeypatch):
    """Appendix C only, in place of everything."""
    found = [row("C", kind, item) for kind, item in chapter("C").items()]
    monkeypatch.setattr(thesis, "rows", lambda _: found)
    return found


def test_page_and_markdown_are_written(run, few, tmp_path):
    said = run("thesis", "-o", "out/here").ok
    assert said.out.split("\n")[:2] == ["out/here/thesis.html", "out/here/thesis.md"]
    assert said.out.split("\n")[2] == "3 misprint confirmed, 3 differs, 1 cannot be reproduced"
    assert (tmp_path / "out/here/thesis.html").read_text("utf-8") == thesis.html(few)
    assert (tmp_path / "out/here/thesis.md").read_text("utf-8") == thesis.markdown(few)
    assert not (tmp_path / "out/here/thesis.json").exists()


def test_a_format_alone(run, few, tmp_path):
    assert run("thesis", "-o", ".", "--format", "json", "--format", "json").code == 0
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.json"]
    data = json.loads((tmp_path / "thesis.json").read_text("utf-8"))
    assert [(d["kind"], d["number"]) for d in data] == [(r.kind, r.item.number) for r in few]


def test_what_nobody_can_explain_is_told_and_ends_with_1(run, few, monkeypatch):
    bad = ReproducedItem("C", "equation", few[0].item, few[0].parts, ItemVerdict(UNEXPLAINED, "(off: C 3 % more)"))
    monkeypatch.setattr(thesis, "rows", lambda _: [bad, *few[1:]])
    said = run("thesis")
    assert said.code == 1
    assert said.line == "sensorgen: Eq. C.1: unexplained (off: C 3 % more)"
    assert "1 unexplained" in said.out


def test_wrong_words(run, few, tmp_path):
    assert "did you mean 'html'" in run("thesis", "--format", "htm").line
    (tmp_path / "file").write_text("x")
    assert "cannot write 'file/below/thesis.html'" in run("thesis", "-o", "file/below").refusal
