"""Look for advisories on every version in constraints.txt, without the network: `make audit ADVISORIES=PLACE`.

PLACE is a copy of github.com/pypa/advisory-database (a folder with `vulns/`, or a bare git repository), or OSV's
export of PyPI (`all.zip`). pip-audit asks a server on loopback that answers from it as OSV does. The exit code is
pip-audit's; the age of the newest advisory is printed, since advisories after it are not known.
"""

import argparse
import io
import json
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import yaml
from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion, Version

ROOT = Path(__file__).parents[1]
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def texts(place: Path) -> Iterator[str]:
    """Advisories as text, YAML or JSON.

    Raises
    ------
    SystemExit
        No advisories there.
    """
    if zipfile.is_zipfile(place):
        with zipfile.ZipFile(place) as archive:
            yield from (archive.read(name).decode() for name in archive.namelist())
    elif (place / "vulns").is_dir():
        yield from (path.read_text("utf-8") for path in (place / "vulns").rglob("*.yaml"))
    elif (place / "HEAD").is_file():
        git = ["git", "-C", str(place), "archive", "--format=zip", "HEAD", "vulns"]
        archive = subprocess.run(git, capture_output=True, check=True).stdout
        with zipfile.ZipFile(io.BytesIO(archive)) as members:
            yield from (members.read(name).decode() for name in members.namelist() if name.endswith(".yaml"))
    else:
        raise SystemExit(f"{place}: no advisories; expected github.com/pypa/advisory-database or OSV's all.zip")


def advisories(place: Path, names: set[str]) -> dict[str, list[dict[str, Any]]]:
    """Advisories by package, of those packages alone."""
    found: dict[str, list[dict[str, Any]]] = {}
    for text in texts(place):
        record = json.loads(text) if text.startswith("{") else yaml.load(text, LOADER)
        for affected in record.get("affected", ()):
            name = canonicalize_name(affected["package"]["name"])
            if affected["package"]["ecosystem"] == "PyPI" and name in names:
                found.setdefault(name, []).append(record)
    return found


def affects(record: dict[str, Any], name: str, version: str) -> bool:
    """Test whether an advisory is about a version: in its list, or in one of its ranges."""
    ours = [one for one in record["affected"] if canonicalize_name(one["package"]["name"]) == name]
    return not record.get("withdrawn") and any(
        version in map(str, one.get("versions", ())) or any(_inside(each, version) for each in one.get("ranges", ()))
        for one in ours
    )


def _inside(span: dict[str, Any], version: str) -> bool:
    """Test whether a version is in a range of versions: after the last introduction, and not after its end."""
    if span["type"] != "ECOSYSTEM":
        return False
    inside, ours = False, Version(version)
    for event in span["events"]:
        ((kind, text),) = event.items()
        try:
            bound = Version(str(text))
        except InvalidVersion:
            continue
        if kind == "introduced" and ours >= bound:
            inside = True
        elif (kind == "fixed" and ours >= bound) or (kind == "last_affected" and ours > bound):
            inside = False
    return inside


def serve(known: dict[str, list[dict[str, Any]]]) -> ThreadingHTTPServer:
    """Server on loopback that answers OSV's query for one version."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            name, version = canonicalize_name(asked["package"]["name"]), asked["version"]
            vulns = [record for record in known.get(name, ()) if affects(record, name, version)]
            body = json.dumps({"vulns": vulns} if vulns else {}, default=str).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    return server


def main(arguments: list[str]) -> int:
    """Serve the advisories, and run pip-audit on them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("place", type=Path)
    parser.add_argument("--audit", default="out/tools/bin/pip-audit", help="pip-audit")
    chosen = parser.parse_args(arguments)
    constraints = ROOT / "constraints.txt"
    pinned = [line.split("==")[0] for line in constraints.read_text("utf-8").splitlines() if "==" in line]
    known = advisories(chosen.place, {canonicalize_name(name) for name in pinned})
    newest = max((str(record["modified"])[:10] for records in known.values() for record in records), default="none")
    print(f"{len(pinned)} versions; advisories on {len(known)} of their packages, the newest of {newest}", flush=True)
    with serve(known) as server:
        url = f"http://127.0.0.1:{server.server_port}/v1/query"
        command = [chosen.audit, "-s", "osv", "--osv-url", url, "--strict", "--disable-pip", "--no-deps", "-r"]
        code = subprocess.run([*command, constraints, "--progress-spinner", "off"], check=False).returncode
        server.shutdown()
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
