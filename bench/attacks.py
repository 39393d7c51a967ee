"""Attacks on what must hold: a stranger's files, the log, the rig; results/attacks.md counts what succeeded.

Each kind is a set of tests whose judge is not the code under attack: files and sockets of the victim, another program's
reading of the log, the record of the simulated mechanism. A test that fails is a success of its attack.

On aarch64 a trusted shape was tried by hand: Debian's kernel 6.1 in QEMU, 57 attempts as root and 57 as nobody, 0
successes; unconfined, 55 of the 57 work there.
"""

import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

HERE = Path(__file__).parent
RESULTS = HERE / "results" / "attacks.md"
KINDS = {
    "a stranger's shape before it is trusted": "tests/cli/test_packs.py -k strangers_folder",
    "a trusted shape leaves its process": "tests/attacks/test_shapes.py -k no_attack",
    "a trusted shape does what it must not": "tests/test_shape_files.py -k wrong_is_one_line",
    "a log on a full or read-only file system": "tests/attacks/test_full_disk.py",
    "a log whose bits flip, edited by SQL": "tests/log/test_chain.py -k edit_by_sql or bits_that_flip or rewrites",
    "log or folder removed during a run": "tests/lab/test_removed.py",
    "run and guardian ended together, computer asleep": "tests/lab/test_watchdog.py",
    "a device of the rig fails": "tests/lab/test_faults.py",
    "two machines correct one reading": "tests/log/test_sync.py -k correction",
    "escapes, closed pipes, bytes that are no photo": "tests/cli/test_noise.py",
    "text of strangers on the terminal": "tests/attacks/test_inputs_words.py",
    "a cluster on a network without TLS": "tests/test_processes_dying.py -k network_needs_tls",
}


def tried(tests: str, folder: str) -> tuple[int, int, str]:
    """Attempts and successes of a kind, and what each of its tests counted by itself."""
    report = Path(folder) / "report.xml"
    words = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        f"--junitxml={report}",
        "-o",
        "junit_family=xunit1",
    ]
    subprocess.run([*words, *tests.split(" ", 2)], cwd=HERE.parent, capture_output=True, check=False)
    attempts, successes, about = 0, 0, list[str]()
    for case in ElementTree.parse(report).iter("testcase"):
        if case.find("skipped") is not None:
            about.append(f"{case.get('name')} skipped")
            continue
        given = {each.get("name"): each.get("value") or "" for each in case.iter("property")}
        attempts += int(given.get("attempts", 1))
        failed = case.find("failure") is not None or case.find("error") is not None
        successes += int(given.get("successes", failed)) or int(failed)
        about += [f"{given['user']}: {given['by_kind']}"] if "by_kind" in given else []
    return attempts, successes, "; ".join(about)


def main() -> None:
    """Run every kind and write the page."""
    rows, total, lost = list[str](), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for kind, tests in KINDS.items():
            attempts, successes, about = tried(tests, folder)
            total, lost = total + attempts, lost + successes
            rows.append(f"| {kind} | {attempts} | {successes} | {about} |")
            print(rows[-1], flush=True)
    about = (__doc__ or "").partition("\n\n")[2].strip()
    table = ["| kind | attempts | successes | of these |", "|---|---:|---:|---|", *rows]
    head = f"# Attacks\n\n{about}\n\n{total} attempts, {lost} successes.\n\n"
    RESULTS.write_text(head + "\n".join(table) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
