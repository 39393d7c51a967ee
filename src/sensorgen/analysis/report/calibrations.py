"""Calibrations of the specimens of a report: by how much each differs from its prediction."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

from sensorgen.core.document import Column, Table
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import Calibration as Row
from sensorgen.measure.log import Log
from sensorgen.prediction.calibration.calibration import Calibration, from_json

NOTE = (
    "Ratios of a calibrated specimen to its prediction, with intervals in the JSON of `sensorgen calibrate`. Covered: "
    "presses held back in turn that lie in their 90 % intervals."
)


@dataclass(frozen=True)
class CalibrationRow:
    """The latest calibration of a specimen."""

    specimen: Annotated[str, Column("specimen")]
    design: Annotated[str, Column("design")]
    presses: Annotated[int, Column("known presses")]
    r_ratio: Annotated[float, Column("R", "", "over the predicted one")]
    c_ratio: Annotated[float, Column("C", "", "over the predicted one")]
    rise_ratio: Annotated[float, Column("rise of C at 4 N", "", "over the predicted one")]
    scatter_percent: Annotated[float, Column("scatter of the rise", "%", digits=2)]
    force_covered: Annotated[str, Column("force covered")]
    position_covered: Annotated[str, Column("position covered")]
    force_width_n: Annotated[float | None, Column("width of force", "N", "median of the intervals", digits=3)]
    position_width_mm: Annotated[float | None, Column("width of position", "mm", "median of the intervals", digits=3)]


def latest(log: Log, specimens: Container[str], left_out: list[tuple[str, str]]) -> list[Calibration]:
    """The latest calibration of each specimen; those that cannot be read go to ``left_out``."""
    rows = {row.specimen: row for row in log.entries(Row) if row.specimen in specimens}
    calibrated = []
    for name, row in rows.items():
        try:
            calibrated.append(from_json(row.data))
        except BadInput as error:
            left_out.append((f"calibration {row.number}, {name}", str(error)))
    return calibrated


def table(calibrations: Sequence[Calibration]) -> Table:
    """A row for each."""
    return Table.of("calibrations", "Specimens by their calibration", [_row(one) for one in calibrations])


def _row(one: Calibration) -> CalibrationRow:
    values, held_out, sensor = {v.name: v.value for v in one.values()}, one.held_out, one.model.sensor
    return CalibrationRow(
        one.specimen, one.design, one.posterior.presses, values["resistance"] / sensor.resistance_ohm(),
        values["capacitance"] * 1e-12 / sensor.capacitance_f(), values["rise at 4 N"], 100 * one.posterior.scatter,
        f"{held_out.force} of {held_out.presses}" if held_out else "",
        f"{held_out.position} of {held_out.presses}" if held_out else "",
        held_out.force_width_n if held_out else None, held_out.position_width_m * 1e3 if held_out else None,
    )  # fmt: skip


def findings(calibrations: Sequence[Calibration]) -> Iterator[str]:
    """One sentence for each specimen."""
    for one in calibrations:
        row = _row(one)
        yield (
            f"{one.specimen} is calibrated by {row.presses} known presses: R {row.r_ratio:.3g}, C {row.c_ratio:.3g} "
            f"and rise of C {row.rise_ratio:.3g} times the predicted ones."
        )
