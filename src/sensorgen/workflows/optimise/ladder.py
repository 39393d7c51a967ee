"""Knowledge of one design, the least expensive first: design rules, bounds at rest, a coarse mesh, everything."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from sensorgen.checks.review import review
from sensorgen.core import cache
from sensorgen.core.bounds import Bounds
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.tip import TOPS
from sensorgen.design.walls import rules as wall_rules
from sensorgen.prediction import bodies
from sensorgen.prediction.compression_law import at_a_few_pressures
from sensorgen.prediction.identifiability.fisher import bounds, slopes
from sensorgen.prediction.mesh_ladder import COARSEST
from sensorgen.prediction.print_files import NONE
from sensorgen.prediction.query import DEFAULT, Query
from sensorgen.prediction.rest_state import RestState, rest_state
from sensorgen.prediction.sensor_model import build_sensor, piece, pressure_pa
from sensorgen.workflows.moves import EarlyNumber, short
from sensorgen.workflows.optimise.target import NUMBERS
from sensorgen.workflows.trial import Numbers, Trial, trial

AT_REST = frozenset({"gap_mm", "capacitance_pf", "top_electrode_ohm", "bottom_electrode_ohm"})
COARSE = AT_REST | {"force_resolution_n", "position_resolution_mm", "sensitivity_per_kpa"}
_PA_PER_KPA = 1e3
_TRIAL = 5  # version of the stored trials


def rules(design: Design) -> list[tuple[str, str]]:
    """Rule and severity of the findings that the design does not waive, of a few of its periods."""

    def work() -> list[list[str]]:
        return [[f.rule, f.severity] for f in review(short(design)).findings if not f.waiver]

    waived = [w.model_dump() for w in design.waivers]
    return [(r, s) for r, s in cache.answer({"what": "rules", "short": design.id(), "waivers": waived}, work)]


def known(
    design: Design, query: Query, solve: bool, rule: str = "", tops: Sequence[str] = TOPS, level: int = COARSEST
) -> dict[str, EarlyNumber]:
    """Numbers by the least expensive models: certified bounds at rest, and, if ``solve``, under load on a coarse mesh.

    Of the print by a rule for walls, the most likely one if not given; under the worst of some tops, on a mesh of a
    level. Empty where no model applies, as of a short.
    """
    query = query.of(design)
    body = bodies.estimated(design, rule or wall_rules(design.profile.walls)[0])
    question = {"what": "known", "body": body.identity, "query": asdict(query), "solve": solve}
    question |= {"tops": list(tops), "level": level} if solve else {}

    def work() -> dict[str, list[float]]:
        try:
            numbers = _known(body, query, solve, tops, level)
            return {key: [k.lower, k.upper, float(k.certified)] for key, k in numbers.items()}
        except SensorgenError:
            return {}

    found = cache.answer(question, work)
    return {key: EarlyNumber(low, high, bool(certified)) for key, (low, high, certified) in found.items()}


def _known(body: Body, query: Query, solve: bool, tops: Sequence[str], level: int) -> dict[str, EarlyNumber]:
    rule, gap_mm = next(iter(body.cells.gap_mm.items()))
    body = body.printed_otherwise(rule)
    rest = rest_state(body, ranges=False)
    numbers = Numbers(
        Bounds.of(gap_mm * M_PER_MM, "m", certified=True) if 0 < gap_mm < np.inf else None,
        rest.capacitance, rest.resistance["top"], rest.resistance["bottom"],
    )  # fmt: skip
    found = {}
    for key in AT_REST:
        value = NUMBERS[key].of(numbers)
        if value:
            found[key] = EarlyNumber(value.model.lower, value.model.upper, value.certified)
    if not solve:
        return found
    pressed = _under_load(body, rest, query, tops, level)
    return found | {k: EarlyNumber(v, v, False) for k, v in pressed.items() if np.isfinite(v)}


def _under_load(body: Body, rest: RestState, query: Query, tops: Sequence[str], level: int) -> dict[str, float]:
    """Numbers under the reference load on a coarse mesh, the worse of an even pressure and a stiff plate.

    Those of a block lie between, or near one of both.
    """
    load, tip, found = query.load(body.design), query.tip_of(body.design), list[tuple[float, float, float]]()
    pressed_pa = pressure_pa(body, tip, load.force_n)
    low_pa, high_pa = (_PA_PER_KPA * kpa for kpa in query.range_kpa) if query.range_kpa else (0.0, pressed_pa)
    for top in (replace(tip, block=block) for block in tops):
        law = at_a_few_pressures(body.design, piece(body), rest.answer, max(pressed_pa, high_pa), tip=top, level=level)
        if law:
            sensor = build_sensor(body, law, top, rest=rest).sensor
            force_n, position_m, _ = bounds(
                slopes(sensor, load.frequency_hz, load.force_n, load.position_m), query.noise
            )
            low, high = law.compression.capacitive_strain(np.array([low_pa, high_pa]))[0].tolist()
            rise = ((1 - low) / (1 - high) - 1) / (high_pa - low_pa) * _PA_PER_KPA
            found.append((float(force_n), float(position_m) / M_PER_MM, rise))
    if not found:
        return {}
    forces, places, rises = zip(*found, strict=True)
    return {
        "force_resolution_n": max(forces), "position_resolution_mm": max(places), "sensitivity_per_kpa": min(rises),
    }  # fmt: skip


def everything(design: Design, query: Query, slicer: str) -> Trial:
    """The design tried: estimated, or sliced now."""
    query = query.of(design)
    question: dict[str, Any] = {
        "what": "trial",
        "version": _TRIAL,
        "design": design.id(),
        "name": design.name,
        "query": asdict(query),
        "slicer": slicer,
    }
    question["waivers"] = [w.model_dump() for w in design.waivers]

    def work() -> Trial:
        found = trial(design, query, slicer=slicer or NONE, drawn=False)
        if design.layout and found.status == "predicted":
            found = replace(found, printed=_of_array(design, query, slicer, found.printed))
        return found

    return cache.record(question, Trial, work)


def _of_array(design: Design, query: Query, slicer: str, numbers: Numbers) -> Numbers:
    """Numbers of a crossing with the resolution of the array, guarded, and its wires."""
    from sensorgen.prediction.array.model import array_model
    from sensorgen.prediction.array.readout import ArrayReadout
    from sensorgen.prediction.array.study import study

    body = None if slicer else bodies.estimated(design.crossing)
    tones = ArrayReadout().frequency_hz if query.frequency_hz == DEFAULT.frequency_hz else query.frequency_hz
    found = study(array_model(design, body=body), ArrayReadout(frequency_hz=tones, noise=query.noise))
    sigma = found.sigma_kpa[found.model.here & found.determined]
    resolution = float(np.median(sigma)) if sigma.size else float("inf")
    return replace(numbers, pressure_resolution=resolution, wires=float(len(found.model.wires())))
