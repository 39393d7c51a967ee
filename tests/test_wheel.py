"""Smoke test and hashes of what is installed; the wheel itself is used by test_new_user.py."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_smoke_runs_every_command():
    from sensorgen.cli import COMMANDS

    text = (ROOT / "scripts" / "smoke").read_text()
    assert [name for name in COMMANDS if not re.search(rf"(ok|at_most 2) {name}\b", text)] == []


def test_the_hashed_files_are_of_the_versions_that_the_tests_ran_with():
    tested, hashed = (
        {name.lower().replace("_", "-"): number for name, number in re.findall(r"^([\w.-]+)==(\S+)", text, re.M)}
        for text in ((ROOT / name).read_text() for name in ("constraints.txt", "constraints-hashes.txt"))
    )
    assert len(hashed) > 60
    assert {name: tested.get(name) for name in hashed} == hashed
