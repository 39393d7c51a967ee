"""Write what can be derived: docs/reference.md from the --help texts, docs/thesis.md, and pictures from the designs."""

import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
DESIGNS = DOCS.parent / "designs"
PICTURES = {"trix-d0.2": ["tri"], "sqxy-d0.2": ["rect"], "trix-upside-down": ["tri", "--orientation", "upside-down"]}
PAGES = (
    [], ["build"], ["build", "tri"], ["build", "rect"], ["build", "reference"], ["check"], ["draw"],
    ["slice"], ["slice", "tri"], ["gcode"], ["gcode", "check"], ["batch"], ["batch", "PLAN.yaml"], ["batch", "verify"],
    ["predict"], ["predict", "tri"], ["cell"], ["cell", "tri"], ["chart"], ["compress"], ["compress", "tri"],
    ["invert"], ["sheet"], ["stack"],
    ["bench"], ["bench", "plan"], ["bench", "plan", "tri"], ["bench", "show"],
    ["bench", "hysteresis"], ["bench", "sets"], ["bench", "live"],
    ["log"], *(["log", w] for w in ("multimeter", "import", "bench", "predict", "list", "show", "export", "verify")),
    ["report"], ["fit"], ["thesis"], ["list"], ["schema"], ["completion"],
)  # fmt: skip


def sensorgen(*words: str) -> str:
    """What the command prints, on a terminal of 100 columns."""
    command = [sys.executable, "-m", "sensorgen", *words]
    environment = {"COLUMNS": "100", "TERMINAL_WIDTH": "100", "PYTHONIOENCODING": "utf-8", "PATH": ""}
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def reference() -> str:
    """The command reference."""
    head = "# Command reference\n\nWritten by `make docs` from the `--help` texts; a test holds the two together.\n"
    pages = (f"## {' '.join(['sensorgen', *p])}\n\n```text\n{sensorgen(*p, '--help').rstrip()}\n```\n" for p in PAGES)
    return "\n".join([head, *pages])


def main() -> None:
    """Write reference, the thesis's page and pictures."""
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
