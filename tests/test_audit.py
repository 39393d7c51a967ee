"""Advisories without the network: by the format that OSV and PyPA's database have, for pip-audit's own question."""

import importlib.util
import json
import urllib.request
import zipfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "audit.py"
RECORD = """id: PYSEC-2023-227
modified: 2023-11-03T10:29:41Z
aliases: [CVE-2023-44271]
details: An allocation without a limit.
affected:
- package: {ecosystem: PyPI, name: Pillow}
  ranges:
  - type: GIT
    events: [{introduced: "0"}]
  - type: ECOSYSTEM
    events: [{introduced: "0"}, {fixed: 10.0.0}, {introduced: "11"}, {last_affected: 11.1.0}]
  versions: [12.0.0]
"""


@pytest.fixture(scope="module")
def audit():
    spec = importlib.util.spec_from_file_location("audit", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(params=["folder", "zip"])
def place(request, tmp_path, audit):
    """PyPA's database as a folder of YAML, and OSV's export as a zip of JSON."""
    if request.param == "folder":
        (tmp_path / "vulns" / "pillow").mkdir(parents=True)
        (tmp_path / "vulns" / "pillow" / "PYSEC-2023-227.yaml").write_text(RECORD, "utf-8")
        return tmp_path
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        archive.writestr("PYSEC-2023-227.json", json.dumps(audit.yaml.safe_load(RECORD), default=str))
    return tmp_path / "all.zip"


def asked(port, name, version):
    """Answer to the query that pip-audit sends."""
    body = json.dumps({"package": {"name": name, "ecosystem": "PyPI"}, "version": version}).encode()
    with urllib.request.urlopen(urllib.request.Request(f"http://127.0.0.1:{port}/v1/query", body)) as answer:
        return json.load(answer)


@pytest.mark.parametrize(
    ("version", "affected"),
    [("9.5.0", True), ("10.0.0", False), ("11.0.0", True), ("11.1.0", True), ("11.1.1", False), ("12.0.0", True)],
)  # fmt: skip
def test_an_advisory_is_about_its_versions_alone(audit, place, version, affected):
    with audit.serve(audit.advisories(place, {"pillow", "numpy"})) as server:
        said = asked(server.server_port, "pillow", version)
        assert asked(server.server_port, "numpy", version) == {}
        server.shutdown()
    assert [one["id"] for one in said.get("vulns", [])] == ["PYSEC-2023-227"] * affected


def test_a_place_without_advisories_is_refused(audit, tmp_path):
    (tmp_path / "all.zip").write_text("a page that says: not found")
    for place in (tmp_path, tmp_path / "all.zip"):
        with pytest.raises(SystemExit, match="no advisories; expected"):
            audit.advisories(place, {"pillow"})
