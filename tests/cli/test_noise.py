"""Noise that no user sees: tracebacks of pipes, warnings of libraries, escapes of strangers, and digits of rounding."""

import subprocess
import sys
from math import pi
from pathlib import Path
from typing import get_type_hints

import pytest

from sensorgen.analysis.report.alternating import AcRow
from sensorgen.analysis.report.recordings import ImpedanceRow
from sensorgen.core import document
from sensorgen.measure.signal.results import RecordingResult, RestResult

DIVIDES = (
    "import sensorgen.cli.catalogue as c, numpy as np; f = c.models; "
    "c.models = lambda: (np.ones(1) / np.zeros(1), f())[1]"
)


@pytest.mark.parametrize(
    ("words", "codes"),
    [
        ("list materials | true", (0,)), ("list materials 2>&1 | true", (0,)), ("list materials >&- 2>&-", (0,)),
        ("list nothing >&-", (2,)), ("list nothing 2>&-", (2,)),
        ("--help | true", (0, 1)),  # click's own code for a help that nobody reads
    ],
)  # fmt: skip
def test_closed_pipes_and_outputs_are_no_news(words, codes, tmp_path):
    """The exit code is that of the command, without a message about pipes."""
    script = f"set -o pipefail; {sys.executable} -m sensorgen {words}"
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode in codes, done
    for word in ("Traceback", "Exception", "Broken", "pipe"):
        assert word not in done.stdout + done.stderr


def test_a_build_whose_reader_has_gone_writes_its_files(tmp_path):
    script = f"{sys.executable} -m sensorgen build reference --length 20 --no-cad --name plate | true"
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, encoding="utf-8", check=False)
    assert "cannot" not in done.stderr
    assert (tmp_path / "out" / "plate" / "manifest.json").is_file()


def test_a_command_that_is_stopped_with_words_in_its_buffer(start):
    """SIGTERM after a reader has gone: the end of the interpreter has nothing left to write, and says nothing."""
    before = (
        "import os, signal, sensorgen.cli.catalogue as c; "
        "c.models = lambda: (sys.stdout.write('x'), os.kill(os.getpid(), signal.SIGTERM))"
    )
    process = start("list", "models", before=before, PYTHONUNBUFFERED="")
    process.stdout.close()
    error = process.stderr.read()
    process.stderr.close()
    assert process.wait() == 128 + 15
    assert "stopped; no file is half-written" in str(error)
    assert "Exception" not in str(error)


def test_warnings_of_numpy_are_not_for_users(start):
    out, err = start("list", "models", before=DIVIDES).communicate()
    assert out
    assert not err


def test_escapes_do_not_reach_tables_and_csv_in_files(run):
    """A name with colours, in a file that a terminal shows later."""
    waiver = '{rule: "7", reason: "a\\e[31mb\\x9b2J"}'
    Path("x.yaml").write_text(f"{{shape: tri, waivers: [{waiver}], parameters: {{length_mm: 6}}}}")
    for form in ("csv", "md"):
        assert run("check", "x.yaml", "--output", f"out.{form}").code in (0, 1)
        text = Path(f"out.{form}").read_bytes()
        assert b"\x1b" not in text
        assert "\x9b" not in text.decode()
        assert b"31m" in text or form == "csv"


def test_random_bytes_are_no_photo(run):
    Path("x.jpg").write_bytes(bytes(range(5, 250)))
    assert (
        "'x.jpg' is no photo; expected JPEG, PNG"
        in run("log", "add", "23 triX", "--y", "650", "--photo", "x.jpg", "--log", "log.db").refusal
    )
    Path("x.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(99))
    assert run("log", "add", "23 triX", "--y", "650", "--photo", "x.png", "--log", "log.db").code == 0


def test_a_capacitance_says_how_it_is_meant():
    """A recording of 3 MHz with -11.4936 - 39.3254j ohm: 1349 pF in series (in parallel they are 1243 pF)."""
    one = RestResult(3e6, -11.4936, -39.3254, 0.1, 0.1, 1 / (2 * pi * 3e6 * 39.3254))
    counts = {"samples": 2, "valid": 2}
    whole = RecordingResult("x", 0, "", 140.0, (3e6,), counts, None, 1.0, (), False, None, None, None, (), (one,), ())
    table = next(part for part in whole.document() if isinstance(part, document.Table))
    column = [each.name for each in table.columns].index("Cs")
    assert table.cells[0][column] * 1e12 == pytest.approx(1349, abs=0.5)
    heads = {hint.__metadata__[0].name for kind in (ImpedanceRow, AcRow) for hint in hints(kind)}
    assert {"Cs measured", "Cp measured"} <= heads
    assert "C measured" not in heads


def hints(kind):
    return get_type_hints(kind, include_extras=True).values()
