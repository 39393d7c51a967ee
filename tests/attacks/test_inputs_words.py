"""Text of strangers does not move the cursor, set the title or colour the terminal."""

import pytest
from child import ADDRESSES

BAD = "a\\e]0;title\\x07\\e[31m\\x9b2J\\u202eb"  # as YAML writes it
FORMS = ("check",), ("check", "--csv"), ("check", "--markdown")
CODES = "\x1b\x07\x9b\u202e"


@pytest.mark.parametrize("words", FORMS, ids=" ".join)
def test_a_waivers_reason_is_shown_harmless(forked, tmp_path, words):
    waivers = ", ".join(f'{{rule: "{rule}", reason: "{BAD}"}}' for rule in (5, 7))
    text = f"{{shape: tri, waivers: [{waivers}], parameters: {{length_mm: 6}}}}"
    (tmp_path / "x.yaml").write_text(text)
    done = forked(words[0], tmp_path / "x.yaml", *words[1:], cwd=tmp_path, AS=8 << 30)
    said = done.out + done.err
    assert not set(CODES) & set(said), said
    assert done.code in (0, 1), said


def test_errors_and_names_are_harmless(forked, tmp_path):
    for content in (f'shape: "{BAD}"', f'"{BAD}": 1', f'{{shape: tri, name: "{BAD}"}}'):
        (tmp_path / "x.yaml").write_text(content)
        done = forked("check", tmp_path / "x.yaml", cwd=tmp_path, AS=ADDRESSES)
        assert not set(CODES) & set(done.out + done.err)
    done = forked("check", "a\x1b[31m.yaml", cwd=tmp_path, AS=ADDRESSES)
    assert (done.code, set(CODES) & set(done.err)) == (2, set())
