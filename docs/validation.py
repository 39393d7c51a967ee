"""Write docs/validation.md: what was measured of sensors that others made, beside what is predicted of them."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import yaml

from sensorgen.analysis.comparison import of_iteration
from sensorgen.analysis.report.electrodes import usable
from sensorgen.core.bounds import Bounds
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.design import Design, make
from sensorgen.design.values import CONTACTS_OHM
from sensorgen.measure.log import Log
from sensorgen.measure.log.exchange import thesis
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.query import Query

DOCS = Path(__file__).parent
FACTS = DOCS.parent / "tests" / "reference" / "published.yaml"
SERIES = 23  # of Table D.1
PDMS_KPA = (0.0, 10.0)
HEAD = """# Validation

Written by `make docs`: measured by others, predicted by us, with 95 % ranges. Facts and sources:
`tests/reference/published.yaml`, `tests/reference/table_d1.csv`.
"""


class Row(NamedTuple):
    """Readings of one quantity, with what is predicted."""

    device: str
    quantity: str
    measured: tuple[float, ...]
    value: float
    lower: float
    upper: float

    def inside(self) -> int:
        """Number of readings within the range."""
        return sum(self.lower <= one <= self.upper for one in self.measured)


def row(device: str, quantity: str, measured: tuple[float, ...], found: Bounds, unit: float) -> Row:
    """Readings in a unit beside a prediction."""
    return Row(device, quantity, measured, found.value / unit, found.lower / unit, found.upper / unit)


def plate(folder: Path, gap_mm: float, *, length_mm: float, width_mm: float, electrode_mm: float, sources: int = 0,
          permittivity: float | None = None, modulus_pa: float | None = None) -> Design:  # fmt: skip
    """A plain plate; a value of one source stands in a material of its own, one without a source nowhere."""
    given = {"relative_permittivity": permittivity, "youngs_modulus_pa": modulus_pa}
    known = {name: value for name, value in given.items() if value is not None}
    values = [
        f"  {name}: [{{value: {value}, source: page, default: true}}]" for name, value in known.items() if sources
    ]
    (folder / "materials").mkdir(exist_ok=True)
    text = "title: film\nabout: film\ncolour: '#cccccc'\nconductor: false\ncitations: {page: the page}\n"
    text += "properties:" + ("\n" + "\n".join(values) if values else " {}") + "\n"
    (folder / "materials" / "published-film.yaml").write_text(text, "utf-8")
    data: dict[str, Any] = {
        "name": "plate", "shape": "reference", "materials": {"dielectric": "published-film"},
        "tools": {"published-film": 2},
        "parameters": {"length_mm": float(length_mm), "width_mm": float(width_mm), "electrode_mm": electrode_mm,
                       "dielectric_mm": gap_mm},
    }  # fmt: skip
    if known and not sources:
        data["material_values"] = {"published-film": known}
    return make(data, str(folder / "plate.yaml"))


def published(folder: Path) -> Iterator[Row]:
    """Devices of public pages, as drawn."""
    for device in yaml.safe_load(FACTS.read_text("utf-8"))["devices"]:
        name = device["name"]
        for gap_mm, pf in device.get("capacitance_pf", {}).items():
            found = evaluate(bodies.drawn(plate(folder, gap_mm, **device["plate"])), keep=False)
            yield row(name, f"C, {gap_mm:g} mm, pF", (float(pf),), found.capacitance, 1e-12)
        for material, values in device.get("permittivities", {}).items():
            size = device["plate"]
            found = evaluate(bodies.drawn(plate(folder, 1.0, **size)), keep=False)
            per_eps = EPS0_F_PER_M * size["length_mm"] * size["width_mm"] * 1e-6 / 1e-3 * 1e12
            yield row(name, f"C, {material}, pF", tuple(e * per_eps for e in values), found.capacitance, 1e-12)
        for gap_mm, per_n in device.get("sensitivity_pf_per_n", {}).items():
            body = bodies.drawn(plate(folder, gap_mm, **device["plate"]))
            found = evaluate(body, Query(range_kpa=PDMS_KPA), keep=False)
            area_mm2 = body.design.area_mm2
            c, s = found.capacitance.alone(), found.sensitivity  # 1/kPa of C, per N on the whole area
            ends = (c.value * s.value, c.lower * s.lower, c.upper * s.upper)
            yield Row(name, f"dC/dF, {gap_mm:g} mm, pF/N", (per_n,), *(1e12 * 1e3 / area_mm2 * end for end in ends))
        for layer_mm, (near, middle, far) in device.get("resistance_kohm", {}).items():
            least = middle - min(CONTACTS_OHM / 1e3, middle)
            for mm, kohm in ((10, near), (264, far)):
                ends = sorted(middle + (mm - 132) * part / 132 for part in (least, middle))
                yield Row(name, f"R, {mm} mm, layers {layer_mm:g}, kohm", (kohm,), sum(ends) / 2, *ends)


def table_d1(folder: Path) -> Iterator[Row]:
    """Sensors of the thesis, as printed by estimate."""
    with Log(folder / "log.db", create=True) as log:
        thesis(log)
        found = of_iteration(log, SERIES)
        rows = usable(found)
        for k in range(len(rows)):
            one = rows[k]
            expected = getattr(one, "expected_ohm", None) or one.predicted.ry_ohm
            yield row(one.predicted.design, "R along, kohm", (min(one.evidence.ry_ohm) / 1e3,), expected, 1e3)


def merged(rows: list[Row]) -> list[Row]:
    """Readings with one prediction in one row."""
    found: dict[tuple[Any, ...], list[float]] = {}
    for one in rows:
        found.setdefault((one.device, one.quantity, *one[3:]), []).extend(one.measured)
    return [Row(*key[:2], tuple(sorted(values)), *key[2:]) for key, values in found.items()]


def page(rows: list[Row]) -> str:
    """The page: what holds of all, and each number; cells without spaces, as words of the docs are counted."""
    count, inside = sum(len(r.measured) for r in rows), sum(r.inside() for r in rows)
    widths = [r.upper / r.lower for r in rows if r.lower > 0 for _ in r.measured]
    devices = len({r.device for r in rows})
    lines = [
        HEAD,
        f"**{inside} of {count} numbers of {devices} devices ({100 * inside / count:.0f} %) lie inside; the median "
        f"range spans a factor {median(widths):.2g}.**",
        "", "|device|quantity|measured|predicted|range|inside|", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for r in merged(rows):
        measured = ",".join(f"{m:.3g}" for m in r.measured)
        cells = (r.device, r.quantity, measured, f"{r.value:.3g}", f"{r.lower:.3g}–{r.upper:.3g}",
                 f"{r.inside()}/{len(r.measured)}")  # fmt: skip
        lines.append("|" + "|".join(cells) + "|")
    return "\n".join(lines) + "\n"


def outside() -> str:
    """Why numbers lie outside, as far as it is known."""
    devices = yaml.safe_load(FACTS.read_text("utf-8"))["devices"]
    return "".join(f"\nOutside, {d['name']}: {d['outside']}\n" for d in devices if "outside" in d)


def main() -> None:
    """Write the page."""
    with tempfile.TemporaryDirectory() as place:
        rows = [*published(Path(place)), *table_d1(Path(place))]
    (DOCS / "validation.md").write_text(page(rows) + outside(), "utf-8")


if __name__ == "__main__":
    main()
