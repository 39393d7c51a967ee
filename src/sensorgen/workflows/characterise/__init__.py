"""From a printer and two materials to a plate of coupons, and from its readings to values that designs can name."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from sensorgen.analysis.characterise import (
    Coupon,
    CouponTarget,
    Meters,
    catalogue,
    targets,
    unknowns,
)
from sensorgen.analysis.characterise import posterior as posteriors
from sensorgen.analysis.characterise.posterior import CouponPosterior, Interval95, physical, posterior, prior
from sensorgen.analysis.plots.figure import BLUE, Axis, Curve, Figure, Panel
from sensorgen.analysis.plots.static import files, whole
from sensorgen.checks.review import Step
from sensorgen.core import display
from sensorgen.core import files as store
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError
from sensorgen.core.version import __version__
from sensorgen.design import materials, packs
from sensorgen.design.design import Design
from sensorgen.design.materials import Material, SourceValue, source_file, source_path
from sensorgen.export import machine
from sensorgen.export.slicers.loads import load, recipe
from sensorgen.prediction.inference import Parameter
from sensorgen.workflows.build import json_bytes, profiles, versions
from sensorgen.workflows.characterise import form as forms
from sensorgen.workflows.characterise import plate as plates

STEPS = ("catalogue", "selection", "3MF", "profiles", "picture", "done")
FORM = "form.yaml"
MOST, HOURS = 12, 4.0  # coupons with the piece for lines and shorts, and print time
_SLOWER, _CHANGE_S = 1.15, 20.0  # of a print against its flow; two tool changes of a layer [s]


def _pair(loaded: Sequence[Material]) -> tuple[str, str]:
    """Names of the material that conducts, and of the one that does not; refused unless there is one of each."""
    conductors, dielectrics = ([m.name for m in loaded if m.conductor == kind] for kind in (True, False))
    if not len(conductors) == len(dielectrics) == 1:
        words = ", ".join(f"{m.name} ({'conducts' if m.conductor else 'does not conduct'})" for m in loaded)
        raise BadInput(f"materials are {words or 'none'}; expected one that conducts and one that does not")
    return conductors[0], dielectrics[0]


@dataclass(frozen=True)
class Study:
    """A printer and two materials, and all that follows from their sources before anything is measured.

    Attributes
    ----------
    design : Design
        Carries printer, quality, tools and materials.
    conductor, dielectric : str
        Names of the materials.
    """

    design: Design
    conductor: str
    dielectric: str

    @classmethod
    def of(
        cls, printer: str, names: Sequence[str], *, quality: str = "fine", tools: Mapping[str, int] | None = None,
        folder: Path = Path(),
    ) -> "Study":  # fmt: skip
        """Look everything up, as seen from a folder.

        Raises
        ------
        BadInput
            Not one material that conducts and one that does not.
        SensorgenError
            A name that is not known, a material without a tool, or one that the printer cannot print.
        """
        given = packs.with_files({"materials": {str(k): name for k, name in enumerate(names)}}, folder)
        loaded = [materials.load(name, texts=given.get("own", {})) for name in given["materials"].values()]
        conductor, dielectric = _pair(loaded)
        return cls(plates.carrier(conductor, dielectric, printer, quality, tools or {}, folder), conductor, dielectric)

    @cached_property
    def unknowns(self) -> tuple[Parameter, ...]:
        """With what the materials' sources say."""
        return unknowns(*self._pair(), self.design.machine.line_mm())

    def _pair(self) -> tuple[materials.Material, materials.Material]:
        return self.design.material(self.conductor), self.design.material(self.dielectric)

    @cached_property
    def targets(self) -> tuple[CouponTarget, ...]:
        """Quantities that are wanted."""
        return targets(self.conductor, self.dielectric, self.design.machine.line_mm())

    @cached_property
    def coupons(self) -> tuple[Coupon, ...]:
        """All that can be printed."""
        return catalogue(*self._pair(), self.design.machine.line_mm())

    def expected(self) -> dict[str, list[float]]:
        """Readings at the middle of what the sources say, by coupon [ohm, F, N/m]."""
        theta = np.array([u.centre for u in self.unknowns])
        return {
            c.name: [float(v) for v in c.expected(physical(self.unknowns, theta), {s.key: np.asarray(s.drawn) for s in
                                                                                   c.sizes})]
            for c in self.coupons
        }  # fmt: skip

    def head(self, plate: str) -> dict[str, str]:
        """First lines of a form."""
        return {"plate": plate, "printer": _beside(self.design.printer), "quality": _beside(self.design.quality),
                "conductor": self.conductor, "dielectric": self.dielectric,
                "tools": json.dumps({m: self.design.tool(m) for m in (self.conductor, self.dielectric)})}  # fmt: skip

    def fits(self, chosen: Sequence[int], hours: float) -> bool:
        """Test whether bed and print time have room for coupons, by their numbers."""
        coupons = [self.coupons[k] for k in chosen]
        if self.hours(coupons) > hours:
            return False
        try:
            plates.arranged(coupons, self.design)
        except OutOfRange:
            return False
        return True

    def check_printer(self) -> None:
        """Raise BadInput where the printer or the quality of the user's own has a fault."""
        own_files = self.design.own.keys() & {"printers", "qualities"}
        if faults := machine.of_design(self.design) if own_files else []:
            raise BadInput(f"{faults[0].body}: {faults[0].text}")

    def files(self) -> dict[str, str]:
        """Files of the user's own, for the plate's folder: a form is read without the packs that they came from."""
        return {
            _beside(word) if packs.is_path(kind, word) else f"{kind}/{word}{packs.suffix(kind)}": text
            for kind, texts in self.design.own.items() for word, text in texts.items()
        }  # fmt: skip

    def hours(self, chosen: Sequence[Coupon]) -> float:
        """Print time, from volumes, flow and tool changes [h]."""
        machine, layers = self.design.machine, self.design.layers
        flows = []
        for name in (self.conductor, self.dielectric):
            made = recipe(machine, layers, self.design.tool(name), load(self.design, name))
            flows.append(made.speed_mm_s * made.line_mm * layers.layer_mm)
        lines = plates.lines_bodies(self.design, self.conductor, self.dielectric)
        volume = sum(c.volume_mm3 for c in chosen) + sum(body.volume_mm3() for body in lines)
        heights = (s.drawn for c in chosen for s in c.sizes if s.key.startswith(("height_", "film_")))
        tallest = max(heights, default=0.0)
        return (_SLOWER * volume / min(flows) + _CHANGE_S * tallest / layers.layer_mm) / 3600


def _beside(word: str) -> str:
    """A name; of a path, the file's name in the plate's folder."""
    return f"./{Path(word).name}" if packs.is_path("printers", word) else word


_DETERMINED = 0.5  # of an interval before, below which one after counts as measured
_LEAST = 0.01  # of the value: what is drawn at the least


@dataclass(frozen=True)
class IntervalRow:
    """A target before and after.

    Attributes
    ----------
    quantity, material : str
        As a material's file has them.
    value, low, high : float
        Afterwards: median and 95 % interval.
    half_width, goal : float
        Half of the interval, relative to the value, and what is wanted [%].
    before_low, before_high : float
        The 95 % interval before.
    """

    quantity: Annotated[str, Column("quantity")]
    material: Annotated[str, Column("material")]
    before_low: Annotated[float, Column("before", digits=2)]
    before_high: Annotated[float, Column("to", digits=2)]
    value: Annotated[float, Column("after", digits=3)]
    low: Annotated[float, Column("low", digits=3)]
    high: Annotated[float, Column("high", digits=3)]
    half_width: Annotated[float, Column("+-", "%", digits=2)]
    goal: Annotated[float, Column("goal", "%", digits=2)]
    title: Annotated[str, Column("meaning", hidden=True)]

    def determined(self) -> bool:
        """Test whether the readings say more than what was known before."""
        return self.high - self.low < _DETERMINED * (self.before_high - self.before_low)


def compared(
    before: CouponPosterior, after: CouponPosterior, wanted: Sequence[CouponTarget]
) -> tuple[IntervalRow, ...]:
    """All targets, with their intervals before and after."""

    def row(target: CouponTarget, was: Interval95, now: Interval95) -> IntervalRow:
        goal = 100 * target.goal if target.goal else np.nan
        half = 100 * now.half_width() if target.goal else np.nan
        return IntervalRow(target.quantity, target.material, was.low, was.high, now.value, now.low, now.high, half,
                           goal, target.title)  # fmt: skip

    return tuple(row(target, before.interval(target), after.interval(target)) for target in wanted)


def _intervals(title: str, rows: Sequence[IntervalRow]) -> Figure:
    """Intervals before and after, relative to the value after; those that reach 0 are left out.

    Parameters
    ----------
    title : str
        Above the bars.
    rows : sequence of IntervalRow
        In the order of reading.
    """
    shown = [row for row in rows if row.low > 0 and row.before_low > 0]
    names, ones = [_label(row) for row in shown], [1.0] * len(shown)
    before, after = (
        [[max(getattr(row, end) / row.value, _LEAST) for row in shown] for end in ends]
        for ends in (("before_low", "before_high"), ("low", "high"))
    )
    curves = (
        Curve("ranges", "before", ones, names, before[0], before[1]),
        Curve("points", "after", ones, names, after[0], after[1], colour=BLUE),
    )
    panel = Panel(curves, Axis("times the value after, 95 % intervals", log=True), Axis(names=tuple(names)))
    return Figure("intervals", title, title, {"": (panel,)})


def svg(title: str, rows: Sequence[IntervalRow]) -> str:
    """The intervals as a picture."""
    return next(content for name, content in files(_intervals(title, rows)) if name.endswith(".svg")).decode()


def _label(row: IntervalRow) -> str:
    """Quantity of a material with its value, as a label."""
    half = (row.high - row.low) / 2 / row.value
    words = f"{row.value:.3g} +- {100 * half:.2g} %" if row.determined() else "not determined"
    return f"{row.quantity} of {row.material}: {words}"


@dataclass(frozen=True)
class Planned(display.Displayed):
    """A plate of coupons.

    Attributes
    ----------
    name, folder, files : str, Path, tuple of str
        Of the plate, and what was written.
    coupons : tuple of str
        Their names, in the order of the plate.
    hours : float
        Print time, estimated [h].
    rows : tuple of IntervalRow
        Intervals before, and as expected if all coupons are sound.
    exposed : tuple of (str, str)
        Coupons without which an interval is beyond three times its goal, with the quantities.
    """

    name: str
    folder: Path
    files: tuple[str, ...]
    coupons: tuple[str, ...]
    hours: float
    rows: tuple[IntervalRow, ...]
    exposed: tuple[tuple[str, str], ...]

    def document(self) -> Iterator[Part]:
        """Coupons, expected intervals, goals that are missed, and where to go on."""
        yield f"{self.name}: {len(self.coupons)} coupons, about {self.hours:.1f} h of printing"
        yield Facts((("coupons", ", ".join(self.coupons)),))
        yield Table.of("expected", "95 % intervals, before and as expected", self.rows)
        for row in self.rows:
            if row.half_width > row.goal * 1.0005:
                yield f"goal missed: {row.quantity} of {row.material}: {row.half_width:.2g} %, goal {row.goal:g} %"
        yield from (f"rests on {coupon} alone: {quantities}" for coupon, quantities in self.exposed)
        yield f"{self.folder}: {len(self.files)} files; print {self.name}.prusa.3mf (.cura, .orca) as plate.svg shows,"
        yield f"measure, fill in {FORM}, then:"
        yield f"sensorgen characterise read {self.folder / FORM}"


@display.figure.register(Planned)
def _(of: Planned) -> Any:
    return whole(_intervals(of.name, of.rows))


def plan(
    study: Study, out: Path, *, name: str = "", count: int = MOST, hours: float = HOURS,
    step: Step = lambda _: None,
) -> Planned:  # fmt: skip
    """Choose coupons and write all files of their plate into ``out/<name>``.

    Parameters
    ----------
    study : Study
        Printer and materials.
    out : Path
        Folder that holds the plates' folders.
    name : str
        Of the plate; from the materials unless given.
    count : int
        Most coupons, the piece for lines and shorts among them [-].
    hours : float
        Longest print [h].
    step : callable
        Called with each of ``STEPS``.

    Raises
    ------
    OutOfRange
        Nothing fits on the plate within the print time.
    BadInput
        The plate's form has readings.
    Unwritable
        The place cannot be written to; nothing was written.
    """
    if not 2 <= count <= MOST or not 0 < hours < np.inf:
        raise OutOfRange(f"{count} coupons in {hours:g} h; expected 2 to {MOST} coupons, and a time above 0")
    study.check_printer()
    label = name or f"{study.design.machine.name}-{study.conductor}-{study.dielectric}"
    folder, names = out / label, (study.conductor, study.dielectric)
    forms.refuse_filled(folder / FORM)
    step("catalogue")
    candidates = posteriors.candidates(study.coupons, study.unknowns, study.targets, Meters())
    step("selection")
    chosen = posteriors.select(candidates, count - 1, lambda chosen: study.fits(chosen, hours))
    coupons = named([study.coupons[k] for k in chosen])
    result = compared(prior(study.unknowns), candidates.expected(chosen, study.unknowns), study.targets)
    plate = plates.arranged(coupons, study.design)
    usual = study.expected()
    expected = {c.name: usual[study.coupons[k].name] for c, k in zip(coupons, chosen, strict=True)}
    with store.staging(folder) as stage:
        step("3MF")
        store.write(stage, dict(plates.threemfs(label, coupons, study.design, plate, names)))
        step("profiles")
        store.write(stage, {path: text.encode() for path, text in profiles(study.design).items()})
        step("picture")
        texts = {
            "plate.svg": plates.picture(label, coupons, study.design, plate, names),
            FORM: forms.blank(study.head(label), coupons, expected),
            "intervals.svg": svg(f"{label}: expected", result),
        }
        store.write(stage, {file: text.encode() for file, text in (study.files() | texts).items()})
        made = Planned(label, folder, tuple(sorted(store.hashes(stage))), (*(c.name for c in coupons), "lines"),
                       study.hours(coupons), result, tuple(_exposed(candidates, chosen, coupons, study)))  # fmt: skip
        content = {"files": store.hashes(stage), "versions": versions(), "coupons": list(made.coupons)}
        store.write(stage, {store.MANIFEST: json_bytes(content)})
        store.publish(stage, folder)
    step("done")
    return made


def named(coupons: Sequence[Coupon]) -> list[Coupon]:
    """Coupons with names of their own: copies get a letter."""
    found: list[Coupon] = []
    for coupon in coupons:
        copies = sum(other.name.rpartition("-")[0] == coupon.name or other.name == coupon.name for other in found)
        found.append(replace(coupon, name=coupon.name + ("" if not copies else f"-{'abcd'[copies]}")))
    return found


def _exposed(
    found: posteriors.Candidates, chosen: tuple[int, ...], coupons: Sequence[Coupon], study: Study
) -> Iterator[tuple[str, str]]:
    for k, coupon in enumerate(coupons):
        without = found.expected(chosen[:k] + chosen[k + 1 :], study.unknowns)
        wide = [
            t.title for t in study.targets if t.goal and without.interval(t).half_width() > posteriors.RESERVE * t.goal
        ]
        if wide:
            yield coupon.name, ", ".join(wide)


@dataclass(frozen=True)
class Characterised:
    """Values from a plate's readings.

    Attributes
    ----------
    source : str
        Name by which designs take them.
    conductor, dielectric : str
        Materials that they are of.
    coupons, readings : int
        How many were read.
    rows : tuple of IntervalRow
        Intervals before and after.
    dead : mapping of str to float
        Probability that a coupon is broken, where it exceeds one half [-].
    findings : tuple of str
        Of lines, shorts and tool offset.
    file : str or None
        Where the source is kept.
    """

    source: str
    conductor: str
    dielectric: str
    coupons: int
    readings: int
    rows: tuple[IntervalRow, ...]
    dead: Mapping[str, float]
    findings: tuple[str, ...]
    file: str | None = None

    def document(self) -> Iterator[Part]:
        """Values, coupons that are left out, findings, and how a design takes the values."""
        yield f"{self.source}: {self.readings} readings of {self.coupons} coupons, besides sizes and lines"
        yield Table.of("values", "95 % intervals, before and after", self.rows)
        yield from (
            f"{name} is left out: dead with probability {share:.0%}, against the others or the sources' values"
            for name, share in self.dead.items()
        )
        yield from self.findings
        for row in self.rows:
            if row.low > row.before_high or row.high < row.before_low:
                yield (
                    f"doubtful: {row.quantity} of {row.material} is {row.value:.3g}, outside the known range, "
                    f"{row.before_low:.2g} to {row.before_high:.2g}: check the units of its readings"
                )
        left = ", ".join(f"{row.quantity} of {row.material}" for row in self.rows if not row.determined())
        if left:
            yield f"not determined: {left}"
        if self.file:
            yield f"in {self.file}"
            yield (
                f"take them with --material electrode={self.conductor}@{self.source} "
                f"--material dielectric={self.dielectric}@{self.source}"
            )

    def text(self) -> str:
        """The file of the source: YAML."""
        about = (
            f"coupons of {self.conductor} and {self.dielectric}: {self.readings} readings of {self.coupons} coupons; "
            f"95 % intervals; sensorgen {__version__}"
        )
        known = [(r.material, SourceValue(r.quantity, r.value, r.low, r.high, r.title)) for r in self.rows
                 if r.determined()]  # fmt: skip
        names = (self.conductor, self.dielectric)
        materials = {name: [value for of, value in known if of == name] for name in names}
        return source_file(about, materials, self.findings)


def _source_name(given: str, plate: str) -> str:
    """Name of the source: as given, else the plate's with "lab-" before it."""
    label = given or "lab-" + "".join(c if c.isalnum() else "-" for c in plate.lower()).strip("-")
    if not packs.is_name("sources", label):
        raise BadInput(f"--name {label!r}; expected lower-case letters, digits, '.' and '-', as in lab-spool7")
    if label in materials.shipped_citations():
        raise BadInput(f"--name {label} is a source that ships with sensorgen; expected another, as lab-spool7")
    return label


def read(path: Path, source: str = "", *, keep: bool = True, force: bool = False) -> Characterised:
    """Evaluate a filled-in form, and keep the values as a source.

    Parameters
    ----------
    path : Path
        Of the form.
    source : str
        Name of the source; the plate's with "lab-" before it unless given.
    keep : bool
        Write the source's file.
    force : bool
        Replace a source of that name.

    Raises
    ------
    SensorgenError
        The form or a name in it is wrong, or there is a source of that name; nothing was written.
    """
    form = forms.read(path)
    label = _source_name(source, form.plate)
    file = source_path(label)
    if keep and not force and os.path.lexists(file):
        raise BadInput(f"{file}: there is a source {label} already; choose another --name, or --force replaces it")
    try:
        names = [form.conductor, form.dielectric]
        folder = path.parent if (path.parent / store.MANIFEST).exists() else Path()  # a plate keeps what it needs
        study = Study.of(form.printer, names, quality=form.quality, tools=form.tools, folder=folder)
        piece = forms.lines_of(form)
        observed = forms.observations(form, study.coupons, study.expected())
        values = posterior(observed, study.unknowns)
    except SensorgenError as error:
        raise error.within(str(path)) from None
    made = Characterised(
        label, study.conductor, study.dielectric, sum(bool(o.read.any()) for o in observed),
        sum(int(o.read.sum()) for o in observed), compared(prior(study.unknowns), values, study.targets), values.dead(),
        tuple(_findings(piece, study.design.machine.line_mm())),
    )  # fmt: skip
    if not keep:
        return made
    store.replace(file, made.text().encode())
    return replace(made, file=str(file))


def _findings(piece: forms.LineReadings, line_mm: float) -> Iterator[str]:
    """Line width, shortest film, smallest distance and tool offset, as far as they were read."""
    yield from _line_width(piece.walls_mm, line_mm)
    yield from _smallest("film", piece.films_short, "layers")
    yield from _smallest("distance", piece.combs_short, "lines")
    along = [f"{axis} {value:+.2f} mm" for axis, value in zip("xy", piece.offsets_mm, strict=True) if value is not None]
    if along:
        yield f"dielectric's tool against the conductor's: {', '.join(along)} (+-{plates.STEP_MM / 2:g} mm)"


def _line_width(walls_mm: Sequence[float | None], line_mm: float) -> Iterator[str]:
    """Width of a line by walls of 1, 2, ... lines; walls that are not printed."""
    walls = [(k, w) for k, w in enumerate(walls_mm, 1) if w]
    if len(walls) > 1:
        lines, widths = np.array(walls, float).T
        slope, over = np.polyfit(lines, widths, 1)
        differs = f"{abs(over):.3f} mm {'wider' if over > 0 else 'narrower'} than" if round(over, 3) else "as wide as"
        yield f"line width {slope:.3f} mm (set {line_mm:g}); a wall is {differs} its lines"
    missing = [k for k, w in enumerate(walls_mm, 1) if w == 0]
    if missing:
        yield f"walls of {max(missing)} lines or fewer are not printed"


def _smallest(what: str, short: Sequence[bool | None], unit: str) -> Iterator[str]:
    """Smallest size from which on none is short."""
    tight = [k for k, one in enumerate(short, 1) if one is not None and not any(short[k - 1 :])]
    if tight:
        yield f"smallest {what} without a short: {tight[0]} {unit} (one piece each)"
    elif any(short):
        yield f"{what}: all are short; expected one that insulates"
