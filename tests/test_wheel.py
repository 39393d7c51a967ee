"""An installed sensorgen has its data with it."""

import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_wheel_works_without_the_repository(tmp_path):
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT, check=True, capture_output=True,
    )  # fmt: skip
    (wheel,) = tmp_path.glob("*.whl")
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    assert {p.name for p in site.iterdir() if p.suffix != ".dist-info"} == {"sensorgen"}
    # -S -I would hide the libraries, too; the extracted folder comes first on the path instead.
    code = (
        f"import sys; site = {str(site)!r}; sys.path.insert(0, site); import sensorgen;"
        "assert sensorgen.__file__.startswith(site);"
        "from sensorgen.cli import main; "
        "sys.argv = ['sensorgen', 'build', 'tri', '--length', '6', '--no-cad', '--force']; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "trix-d0.2-length6" / "manifest.json").exists()


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
