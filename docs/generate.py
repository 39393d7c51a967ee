"""Write what can be derived: docs/reference.md from the --help texts, docs/thesis.md, and pictures from the designs."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
README = DOCS.parent / "README.md"
FIRST_SCREEN = ["build", "tri", "--dielectric", "0.2"]
LINES = 30  # of the first screen
PICTURES = {"trix-d0.2": ["tri", "--drawn"]}
PAGES = (
    [], ["build"], ["build", "tri"], ["build", "rect"], ["build", "reference"], ["check"], ["show"], ["draw"],
    ["optimise"], ["slice"], ["slice", "tri"], ["export"], ["import"], ["gcode"], ["gcode", "check"],
    ["gcode", "drags"], ["gcode", "pinholes"], ["batch"], ["batch", "PLAN.yaml"], ["batch", "verify"],
    ["predict"], ["predict", "tri"], ["cell"], ["cell", "tri"], ["chart"], ["chart", "tri"],
    ["compress"], ["compress", "tri"],
    ["invert"], ["array"], ["sheet"], ["stack"],
    ["bench"], ["bench", "run"], ["bench", "array"], ["bench", "plan"], ["bench", "plan", "tri"], ["bench", "show"],
    ["bench", "hysteresis"], ["bench", "sets"], ["bench", "live"],
    ["log"],
    *(["log", w] for w in ("specimen", "add", "import", "bench", "predict", "list", "show", "export", "verify")),
    ["report"], ["fit"], ["characterise"], ["characterise", "PRINTER"], ["characterise", "read"],
    ["calibrate"], ["thesis"], ["new"], ["pack"], ["pack", "test"],
    ["pack", "trust"], ["list"], ["schema"], ["completion"],
)  # fmt: skip


def sensorgen(*words: str, folder: str = ".") -> str:
    """Output of a command in a folder, on a terminal of 100 columns."""
    command = [sys.executable, "-m", "sensorgen", *words]
    environment = {
        "COLUMNS": "100",
        "TERMINAL_WIDTH": "100",
        "PYTHONIOENCODING": "utf-8",
        "PATH": os.environ.get("PATH", ""),  # the first screen is of a real slice
        "SENSORGEN_BUDGET": "0",
        "SENSORGEN_CACHE": str(Path(tempfile.gettempdir()) / "sensorgen-docs"),  # without advice of other builds
    }
    environment["PYTHONPATH"] = os.environ.get("PYTHONPATH", "")
    done = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment, cwd=folder)
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:  # 1: the design has findings
        raise SystemExit(f"{' '.join(words)}: {done.stderr}")
    return done.stdout


def reference() -> str:
    """The command reference."""
    from click.testing import CliRunner  # in this process: seventy others take seconds to start

    from sensorgen.cli import cli

    def text(page: list[str]) -> str:
        words = [*page, "--help"]
        return CliRunner().invoke(cli, words, prog_name="sensorgen", terminal_width=98).output.rstrip()

    head = "# Command reference\n\nWritten by `make docs` from the `--help` texts; a test holds the two together.\n"
    pages = (f"## {' '.join(['sensorgen', *page])}\n\n```text\n{text(page)}\n```\n" for page in PAGES)
    return "\n".join([head, *pages])


def first_screen() -> str:
    """README.md with what its first command prints, at most 30 lines of it."""
    with tempfile.TemporaryDirectory() as folder:
        lines = sensorgen(*FIRST_SCREEN, "--no-cad", folder=folder).rstrip().splitlines()
    shown = "\n".join(lines if len(lines) <= LINES else [*lines[:12], "..."])
    block = f"\n```text\n$ sensorgen {' '.join(FIRST_SCREEN)}\n{shown}\n```\n"
    marks = re.compile(r"(<!-- first screen.*?-->\n).*?(<!-- end of first screen -->)", re.DOTALL)
    return marks.sub(lambda mark: mark[1] + block + mark[2], README.read_text("utf-8"))


def main() -> None:
    """Write reference, the thesis's page and pictures."""
    README.write_text(first_screen(), "utf-8")
    sensorgen("thesis", "--format", "md", "--output", str(DOCS))
    (DOCS / "reference.md").write_text(reference(), "utf-8")
    (DOCS / "pictures").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, words in PICTURES.items():
            out = Path(folder) / f"{name}.svg"
            sensorgen("draw", *words, "--output", str(out))
            (DOCS / "pictures" / out.name).write_bytes(out.read_bytes())
        sensorgen("batch", str(DOCS / "examples" / "film-study.yaml"), "--no-gcode", "--out", folder)
        plate = Path(folder) / "film-study" / "plate.svg"
        (DOCS / "pictures" / "film-study-plate.svg").write_bytes(plate.read_bytes())


if __name__ == "__main__":
    main()
