"""Prediction of specimens beside their measurements."""

from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from math import inf, isfinite, isnan, log, nan
from typing import NamedTuple, TypeVar

from sensorgen.analysis.comparison.expected import Movable, Predicted, stored_or_made
from sensorgen.analysis.comparison.measured import Measured, readings
from sensorgen.core.bounds import Bounds
from sensorgen.core.display import Displayed
from sensorgen.core.errors import SensorgenError
from sensorgen.core.lazy import Lazy
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body, BodyOf
from sensorgen.design.design import Design
from sensorgen.design.specimen_name import SpecimenName, design_of, parse
from sensorgen.design.values import resistivities
from sensorgen.measure import accuracy
from sensorgen.measure.log import BenchRun, Entry, Log, Prediction, Print, Reading, Withdrawal
from sensorgen.measure.log.logbook import conflict
from sensorgen.measure.log.prints import designs as on_beds
from sensorgen.measure.signal.verdicts import (
    INTACT_OHM,
    Evidence,
    SignalVerdict,
    electrode_and_leak,
    expected_from,
    intact_ohm,
    verdict,
)
from sensorgen.prediction import bodies
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.rest_state import electrode_resistance

_MOST_LEFT_OUT = 1000  # readings that are listed for one reason
UNTRUSTED = "shape of"  # a specimen, in the list of what was left out
Row = TypeVar("Row")
_MOST_HELD = 120_000  # rows in memory, in 0.1 GB: a report reads each some 16 times


class Compared(NamedTuple):
    """One reading beside what was predicted of its design.

    Attributes
    ----------
    reading : Measured
        What the log has of it.
    predicted : Predicted or None
        None where no design is known.
    evidence, verdict : Evidence, SignalVerdict
        What the readings say by themselves, of an electrode as it is usual for its prediction and shape.
    across_ohm : float
        The least reading between the electrodes [ohm]; without one, 0 where they touch as printed, else nan.
    expected_ohm : Bounds or None
        Predicted reading along an electrode of the network that was measured [ohm]; None where none is predicted.
    residual : float
        Ln of the least R_Y over the predicted value [-]; nan where one is missing.
    """

    reading: Measured
    predicted: Predicted | None
    evidence: Evidence
    verdict: SignalVerdict
    across_ohm: float
    expected_ohm: Bounds | None
    residual: float

    @property
    def inside(self) -> bool | None:
        """True if a reading of R_Y lies within the prediction's interval; None where one is missing."""
        expected = self.expected_ohm
        if expected is None or not self.evidence.ry_ohm:
            return None
        return any(expected.lower <= value <= expected.upper for value in self.evidence.ry_ohm)


def _beside(reading: Measured, of: Predicted | None, evidence: Evidence, judged: SignalVerdict) -> Compared:
    """A reading with its verdict, beside its prediction."""
    across = 0.0 if isnan(judged.rz_ohm) and evidence.touching else judged.rz_ohm
    ry, expected = min(evidence.ry_ohm, default=nan), of.along_ohm(across) if of else None
    if expected and reading.words.wires == 4:  # which reads the electrode without leads
        expected = expected.alone()
    residual = log(ry / expected.value) if expected and isfinite(ry) and ry > 0 else nan
    return Compared(reading, of, evidence, judged, across, expected, residual)


@dataclass(frozen=True, eq=False)
class Comparison(Displayed):
    """An iteration.

    Attributes
    ----------
    rows : Lazy of Compared
        One for each reading, in the order of the log.
    alternating : tuple of Reading
        Readings with AC quantities.
    bodies : mapping of str to Body
        What was measured, by the design's name.
    names : mapping of str to str
        The design's name by the specimen's.
    predictions : mapping of str to Predicted
        By the design's name.
    left_out : tuple of (str, str)
        What could not be used, and why.
    """

    rows: Lazy[Compared]
    alternating: tuple[Reading, ...]
    bodies: Mapping[str, Body]
    names: Mapping[str, str]
    predictions: Mapping[str, Predicted]
    left_out: tuple[tuple[str, str], ...]

    @cached_property
    def last(self) -> Lazy[Compared]:
        """The last DC reading of each specimen: a yield counts specimens, however often one was measured."""
        return self.direct.at({row.reading.specimen: k for k, row in enumerate(self.direct)}.values())

    @cached_property
    def direct(self) -> Lazy[Compared]:
        """Rows but those with AC quantities alone."""
        ac = {reading.number for reading in self.alternating if not reading.y_ohm and not reading.z_ohm}
        return self.rows.where(lambda row: row.reading.number not in ac) if ac else self.rows

    @cached_property
    def by_bake(self) -> Lazy[Compared]:
        """The last reading of each specimen before the bake, after it, and where that is not known."""
        last = {(row.reading.specimen, row.reading.words.baked): k for k, row in enumerate(self.direct)}
        return self.direct.at(last.values())

    @cached_property
    def movable(self) -> dict[str, Movable]:
        """Sensors of which parameters can be moved, by the design's name."""
        return {name: Movable(body) for name, body in self.bodies.items()}


def of_iteration(
    log: Log, iteration: int | None, step: Callable[[str], None] = lambda _: None,
    body_of: BodyOf = bodies.default_body, *, specimens: Sequence[str] = (),
) -> Comparison:  # fmt: skip
    """Everything in the log about an iteration or some specimens, compared.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int or None
        Of the design; of all if None, and no specimens are given.
    step : callable
        Called with the name of each design before it is predicted.
    body_of : callable
        Makes the body of a design.
    specimens : sequence of str
        Names of specimens, in place of an iteration.
    """
    measured = readings(log.about(Reading, iteration, specimens))
    logged = _in_memory(measured.rows)
    left_out = list(_superseded(log, iteration, specimens))
    printed = _printed(log, left_out)
    refused = dict[str, str]()
    by_specimen = _by_specimen(log, iteration, specimens, printed, refused, left_out)
    names, designs = _labelled(by_specimen)
    ids = {name: design.ids() for name, design in designs.items()}
    for specimen in by_specimen.keys() & printed.keys():
        ids[names[specimen]].add(printed[specimen].design_id)  # another version of sensorgen may have named it
    left_out += _other_designs(measured.designs, set(refused).union(*ids.values()))
    begun = _begun(log, iteration, specimens, names)
    built, expected = {}, {}
    for name, design in designs.items():
        step(name)
        built[name] = body_of(design)
        stored = [p for each in ids[name] for p in log.entries(Prediction, superseded=True, design_id=each)]
        expected[name] = stored_or_made(built[name], log, stored, begun.get(name, []), left_out)
    of_rows = [expected.get(names.get(reading.specimen, "")) for reading in logged]
    usual_ohm = _usual_ohm(logged, of_rows)
    partner = _partners(logged)

    def compared(place: int) -> Compared:
        reading, of = logged[place], of_rows[place]
        evidence = _evidence(reading, of, usual_ohm(reading.shape, of))
        both = evidence
        if place in partner:
            other = _evidence(logged[partner[place]], of)
            both = evidence._replace(ry_ohm=evidence.ry_ohm or other.ry_ohm, rz_ohm=evidence.rz_ohm or other.rz_ohm)
        return _beside(reading, of, evidence, verdict(both, _intact_ohm(of, reading.words.instrument)))

    rows = _in_memory(Lazy(compared, range(len(logged))))
    ac = {reading.number for reading in measured.alternating}
    return Comparison(rows, measured.alternating, built, names, expected, (*left_out, *_first(_unused(rows, ac))))


def _in_memory(rows: Lazy[Row]) -> Lazy[Row]:
    """Rows, made once where memory has room for all of them."""
    return Lazy([*rows].__getitem__, range(len(rows))) if len(rows) <= _MOST_HELD else rows


def _partners(rows: Iterable[Measured]) -> dict[int, int]:
    """Places of readings along or across alone, each with that of the specimen's other resistance in the same state.

    The latest before it counts, else the next.
    """
    partner, latest = dict[int, int](), dict[tuple[str, bool | None, int], int]()
    waiting: dict[tuple[str, bool | None, int], list[int]] = defaultdict(list)
    for place, reading in enumerate(rows):
        known = max(reading.y_ohm, default=-1.0) >= 0, max(reading.z_ohm, default=-1.0) >= 0
        words = reading.words
        for k, has in enumerate(known):
            key = words.specimen, words.baked, k
            if has:
                latest[key] = place
                if key in waiting:
                    partner |= dict.fromkeys(waiting.pop(key), place)
            elif known[1 - k] and key in latest:
                partner[place] = latest[key]
            elif known[1 - k]:
                waiting[key].append(place)
    return partner


def _labelled(by_specimen: Mapping[str, Design]) -> tuple[dict[str, str], dict[str, Design]]:
    """Label of each specimen's design: its name, with its identity where another one has that name; designs by it."""
    by_id = {design.id(): design for design in {id(d): d for d in by_specimen.values()}.values()}
    alike = Counter(design.name for design in by_id.values())

    def label(design: Design) -> str:
        return design.name if alike[design.name] < 2 else f"{design.name} ({design.id()[:8]})"

    designs = {name: by_id[key] for name, key in sorted((label(d), key) for key, d in by_id.items())}
    return {name: label(design) for name, design in by_specimen.items()}, designs


def _begun(
    log: Log, iteration: int | None, specimens: Sequence[str], names: Mapping[str, str]
) -> dict[str, list[Entry]]:
    """The first reading and the first recording of each design; all of them where several machines wrote the log."""
    first: dict[str, dict[object, Entry]] = {}
    kinds: tuple[type[Reading | BenchRun], ...] = (Reading, BenchRun)
    for kind in kinds:
        if log.merged:
            rows = log.about(kind, iteration, specimens, superseded=True)
        else:
            each = (log.about(kind, None, [specimen], superseded=True) for specimen in names)
            rows = iter(sorted(filter(None, (next(of, None) for of in each)), key=lambda row: row.number))
        for row in rows:
            if row.specimen in names:
                first.setdefault(names[row.specimen], {}).setdefault((kind, row.number * log.merged), row)
    return {name: list(rows.values()) for name, rows in first.items()}


def _superseded(log: Log, iteration: int | None, specimens: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Readings out of use, and why."""
    for old in log.about(Reading, iteration, specimens, replaced=True):
        reason = next((row.reason for row in log.superseding(old) if isinstance(row, Withdrawal)), "")
        rival = log.rival(old)
        why = f"withdrawn: {reason}" if reason else conflict(rival) if rival else "a later reading corrects it"
        yield f"reading {old.number}, {old.specimen}", why


def _first(left_out: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Omitted readings, and the number of those beyond what a person reads."""
    more = Counter[str]()
    for what, why in left_out:
        more[why] += 1
        if more[why] <= _MOST_LEFT_OUT:
            yield what, why
    for why, count in more.items():
        if count > _MOST_LEFT_OUT:
            yield f"{count - _MOST_LEFT_OUT} more readings", why


def _printed(log: Log, left_out: list[tuple[str, str]]) -> dict[str, Print]:
    """The latest print of each specimen; one that two machines have bound to different designs is left out."""
    latest: dict[str, Print] = {}
    for row in log.entries(Print):
        before = latest.setdefault(row.specimen, row)
        if before.design_id != row.design_id:
            both = f"{before.design} ({before.design_id}) and {row.design} ({row.design_id})"
            left_out.append((f"design of {row.specimen}", f"bound to {both}: withdraw one of the prints"))
            row = replace(row, design_id="", design="")
        latest[row.specimen] = row
    return latest


def _by_specimen(
    log: Log, iteration: int | None, specimens: Sequence[str], printed: Mapping[str, Print],
    refused: dict[str, str], left_out: list[tuple[str, str]],
) -> dict[str, Design]:  # fmt: skip
    """The designs of specimens: those that they are bound to, else what their names stand for."""
    by_name: dict[str, Design] = {}
    recorded = on_beds(log, refused)
    by_kind = cache(design_of)
    for specimen in log.specimens(iteration=iteration):
        name, of = specimen.specimen, printed.get(specimen.specimen)
        if specimens and name not in specimens:
            continue
        if of and of.design_id in recorded:
            by_name[name] = recorded[of.design_id]
        elif of and of.design_id in refused:
            left_out.append((f"{UNTRUSTED} {name}, {of.design}", refused[of.design_id]))
        else:
            design = _by_name(name, of, by_kind)
            if isinstance(design, str):
                left_out.append((f"design of {name}", design))
            elif design:
                by_name[name] = design
    return by_name


def _by_name(name: str, of: Print | None, by_kind: Callable[[SpecimenName], Design | None]) -> Design | str | None:
    """Design that a specimen's name stands for, or why it has none; None where its print may be of several."""
    try:
        design = by_kind(replace(parse(name), iteration=None, replicate=None, place=""))
    except SensorgenError as error:
        return str(error)
    if of is None:
        return design or "its name stands for no design"
    if of.design_id and (design is None or design.name != of.design):  # of the same name it is another version's
        return f"printed of {of.design} ({of.design_id}), which the log does not have: sensorgen log predict its file"
    return design if of.design_id else None


def _other_designs(logged: Iterable[tuple[str, str]], known: Container[str]) -> list[tuple[str, str]]:
    """Entries of the log on designs that the names do not stand for."""
    others = {(name, uid) for name, uid in logged if uid and uid not in known}
    return [
        (f"design {name} ({uid})", "the log names it for a specimen whose name stands for another design, or for this "
         "one in another version of sensorgen: drawn and predicted is what the name stands for now")
        for name, uid in sorted(others)
    ]  # fmt: skip


def _usual_ohm(
    rows: Iterable[Measured], of_rows: Iterable[Predicted | None]
) -> Callable[[str, Predicted | None], float]:
    """Reading that is usual along an electrode of a shape and prediction [ohm].

    The prediction times the median of measured over predicted of its shape, of the readings within their predicted
    ranges where there are any: else broken prints vouch for each other, and against a sound one. No further than the
    prediction's range; the shape's median where none is predicted.
    """
    within: dict[tuple[str, bool], array[float]] = defaultdict(lambda: array("d"))
    every: dict[tuple[str, bool], array[float]] = defaultdict(lambda: array("d"))
    for reading, of in zip(rows, of_rows, strict=True):
        alone, ohm = of.ry_ohm if of else None, min(_possible(reading.y_ohm), default=inf)
        key = reading.shape, alone is not None
        if ohm < inf:
            every[key].append(ohm / alone.value if alone else ohm)
        if alone and alone.lower <= ohm <= alone.upper and ohm < inf:
            within[key].append(ohm / alone.value)
    medians = {key: expected_from(within[key] or values) for key, values in every.items()}

    def usual(shape: str, of: Predicted | None) -> float:
        alone = of.ry_ohm if of else None
        median = medians.get((shape, alone is not None), nan)
        if alone is None:
            return median
        return alone.value if isnan(median) else min(max(alone.value * median, alone.lower), alone.upper)

    return usual


def _evidence(reading: Measured, of: Predicted | None, expected_ohm: float = nan) -> Evidence:
    ry, rz = _possible(reading.y_ohm), _possible(reading.z_ohm)
    return Evidence(reading.specimen, ry, rz, expected_ohm, of is not None and of.touches, reading.words.batch)


def _possible(ohm: tuple[float, ...]) -> tuple[float, ...]:
    """Readings that a resistance can have; a slip below 0 is kept in the log, with a doubt."""
    return ohm if min(ohm, default=0.0) >= 0 else tuple(v for v in ohm if v >= 0)


def _intact_ohm(of: Predicted | None, instrument: str) -> float:
    """Least resistance of a film that is intact, by the meter and the design [ohm]."""
    meter, c = accuracy.find(instrument) if instrument else None, of.prediction.capacitance if of else None
    highest = meter.ranges[-1].ohm if meter and meter.ranges else INTACT_OHM
    return intact_ohm(c.value if c else 0.0, TONES_HZ[0], highest)


def _unused(rows: Iterable[Compared], alternating: Container[int]) -> Iterator[tuple[str, str]]:
    """Readings that are of no use or of little, and why; what another one of the specimen adds is not missing."""
    for row in rows:
        number, y, z, words = row.reading
        name = f"reading {number}, {words.specimen}"
        if row.predicted is None:
            yield name, "no design is known: nothing to compare it with"
        if number in alternating:
            continue
        if row.verdict.word == "unknown" and not (y and z):
            why = f"no {'R_Z' if y else 'R_Y'}: counts for nothing where both are needed"
            yield name, why if y != z else "no measurement in it"
        if min(*y, *z, 0.0, 0.0) < 0:
            yield name, "a resistance below 0 is no reading"


@dataclass(frozen=True, slots=True)
class AllowedValues:
    """ln of resistivities [ohm m] that a reading allows, and of the leak per area [S/m2]; nan unknown, -inf tight.

    ``print`` is the plate of the specimen, "" where that is unknown.
    """

    low: float
    high: float
    leak: float = nan
    print: str = ""


def usable(row: Compared) -> bool:
    """Test whether a reading is one of a sound electrode."""
    return row.verdict.electrode == "sound" and isfinite(row.verdict.ry_ohm) and row.verdict.ry_ohm > 0


def allowed(row: Compared, body: Body) -> AllowedValues | None:
    r"""Resistivity that a reading allows; None without one above 0. A film without a reading is taken for tight.

    An electrode's resistance over its resistivity is known between bounds, and R_Z says how far the other electrode
    carries current through the film (:mod:`sensorgen.measure.signal.verdicts`). The log does not say which electrode
    was read: each reading allows a range of :math:`\varrho`.
    """
    ry, rz = row.verdict.ry_ohm, row.across_ohm
    if not 0 < ry < inf:
        return None
    ends, design = _per_resistivity(body), body.design
    area = design.area_mm2 * M_PER_MM**2
    known = [
        (this, *electrode_and_leak(ry, inf if isnan(rz) else rz, other.value / this.value))
        for this, other in zip(ends, ends[::-1], strict=True)
    ]
    leak = nan if isnan(rz) else max(leak for *_, leak in known)
    low, high = min(ohm / this.upper for this, ohm, _ in known), max(ohm / this.lower for this, ohm, _ in known)
    ln_leak = nan if not leak < inf else log(leak / area) if leak else -inf
    return AllowedValues(log(low), log(high), ln_leak, row.evidence.plate)


@lru_cache(maxsize=64)
def _per_resistivity(body: Body) -> list[Bounds]:
    """Resistance of each electrode over its resistivity, without what the material leaves open [1/m]."""
    rho = resistivities(body.design)
    return [
        Bounds.of(r.value, r.unit, model=r.model, print=r.print).times(1 / rho[end].value, "1/m")
        for end, r in electrode_resistance(body).items()
    ]
