"""Compensation against real slices: gap and capacitance asked for, printed before, and printed after."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from sensorgen.asprinted.printed import body
from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import make
from sensorgen.export import slicing
from sensorgen.export.slicers import WALLS
from sensorgen.prediction import bodies
from sensorgen.workflows.compensation import compensated, found

RESULT = Path(__file__).parent / "results" / "compensation.md"
CASES = [("x", 0.1, "fine"), ("x", 0.2, "fine"), ("x", 0.1, "extrafine"), ("x", 0.2, "extrafine"),
         ("y", 0.2, "fine"), ("x", 0.3, "fine")]  # fmt: skip


def main() -> None:
    """Write the table."""
    lines = [
        "# Compensation, measured by real slices", "",
        "Asked for: gap and capacitance of the drawing. Errors of the capacitance as printed, PrusaSlicer 2.5.0 "
        "(Arachne) and CuraEngine 4.13.0 (filling outline gaps), 100 x 10 mm.", "",
        "| design | slicer | asked gap [mm] | asked [pF] | gap before | error before | gap after | error after "
        "| slices | changes | processor [s] |", "|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for along, film, quality in CASES:
        for slicer in ("prusa", "cura"):
            lines.append(row(along, film, quality, slicer))
            print(lines[-1], flush=True)
    RESULT.write_text("\n".join(lines) + "\n")


def row(along: str, film: float, quality: str, slicer: str) -> str:
    """One design by one slicer; what is refused with its reason."""
    design = make({"shape": "tri", "quality": quality, "parameters": {"dielectric_mm": film, "along": along}})
    asked, seen = found(bodies.drawn(design)), []

    def sliced(one):
        with TemporaryDirectory() as folder:
            made = slicing.sliced([slicing.alone(one)], slicer, Path(folder))
            seen.append(bodies.sliced(one, lambda: body(one, made.lines), slicer, made.ready.read_bytes()))
            seen[-1].cells  # noqa: B018 - while the files are there
        return seen[-1]

    before, start = found(sliced(design)), time.process_time()
    seen.clear()
    head = f"| tri{along.upper()} {film:g} {quality} | {slicer} | {asked.gap_mm:g} | {asked.capacitance_pf:.4g} | "
    head += f"{before.gap_mm:g} | {before.capacitance_pf / asked.capacitance_pf - 1:+.1%} | "
    try:
        _, changes = compensated(design, WALLS[slicer], sliced=sliced)
    except SensorgenError as error:
        return head + f"refused | | {len(seen)} | {error} | {time.process_time() - start:.1f} |"
    after = found(seen[-1])
    told = ", ".join(f"{c.what} {c.after:.4g}" for c in changes if "printed" not in c.what)
    error = f"{after.capacitance_pf / asked.capacitance_pf - 1:+.1%}"
    return head + f"{after.gap_mm:g} | {error} | {len(seen)} | {told} | {time.process_time() - start:.1f} |"


if __name__ == "__main__":
    main()
