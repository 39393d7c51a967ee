"""Choose the pressure law of a cell, with its uncertainty.

A printed plate is bonded to its electrodes (thesis 4.2: layers adhere to each other), and bracketed by boundary
conditions. Solutions of the prototypes' cells are stored; any other cell with gaps is solved on request, and kept.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from json import dumps
from math import ceil, log
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import MissingValue, OutOfRange, SensorgenError, UnknownName
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.tip import EVEN, STIFF, TOPS, Tip
from sensorgen.design.values import MaterialValue, film, material_value, of_all_materials, permittivities
from sensorgen.models import compression
from sensorgen.models.compression import CapacitanceCurve, Compression, curve_of, extended
from sensorgen.prediction import mesh_ladder
from sensorgen.prediction.capacitance import Answer, is_plate
from sensorgen.prediction.mesh_ladder import Case, PressedPiece, drawn, pressed
from sensorgen.prediction.query import FLAT, LAWS
from sensorgen.scene.scene import Body, Point, Scene, box
from sensorgen.scene.sections import sections

if TYPE_CHECKING:
    from sensorgen.models.press2d import BoundaryConditions, Elastic

CLOSED_FORM = LAWS[:4]
STRESS_PA = (0.0, 5e3, *(1e4 * k for k in range(1, 11)), 1.2e5)  # 6 N on a tip of 5 x 10 mm are 120 kPa
_FURTHER = 1.25  # ratio of stresses beyond those
_PAST = 1.25  # pressure over the last one of a stored curve up to which it is extended [-]
_CLOSED = 8  # pressures beyond the last solved one, at which the closed cell bounds a curve
_PERIODS = 1.5  # height of a block, over the period, above which its pressure is even: exp(-3 pi) [-]
_HEIGHTS = 2.0  # the same over the cell's height, where no period is known [-]
_LANDING = f"feet land at negligible force: the rise of C up to {STRESS_PA[1] / 1e3:g} kPa is mostly their fall"
_STRAIN = np.linspace(0.0, 0.3, 7)  # of infill: lines of its law, which is straight up to there at most
_SAME_RATIO = 1e-3  # difference of Poisson's ratios: 0.4999 and 0.5 are one cell, 0.45 deforms by 11 % more
_SAME_PERMITTIVITY = 2e-3  # relative difference of permittivities, by which a rise differs by 0.16 % in tri [-]
_ENOUGH = 0.5  # of the last of them: a curve that is known so far is extended [-]
_ONSET = 0.25  # largest relative error of a curve's onset, on films of 0.02 to 0.2 mm from 0.5 kPa on
_BENDS = 10.0  # strain by bending electrodes, at most, over that of what stands, at most: softer is no infill [-]
_NONE = 1e-6  # share of a rise that stands for none: curves rise [-]
_FEW = (0.0, 0.4, 0.8, 1.0)  # pressures at which ways to print are told apart, over the last one [-]
_ALIKE = 1.05  # ratio of rises under two tops at some pressures over that at others, which serves for all [-]
_LIKE = {"press2d": "tri", "press3d": "rect", "press_round": "tri"}  # prototypes that other cells should resemble


@dataclass(frozen=True)
class Law:
    """Pressure law of a film.

    Attributes
    ----------
    compression : Compression
        Capacitive strain versus stress.
    taken : tuple of MaterialValue
        Moduli.
    doubts : tuple of str
        Limits of its validity.
    others : tuple of Compression
        Laws within its error: of the mesh, or the other law of a plate.
    tops : mapping of str to Compression
        The cell under an even pressure and under a stiff plate, by ``EVEN`` and ``STIFF``; empty of a solid plate.
    other_boundaries : tuple of Compression
        The cell under other boundary and contact conditions.
    bounded : bool
        Whether its error is known: not where a cell with gaps is approximated by a plate.
    of_mesh : tuple of Compression
        Laws within the error of the mesh alone, where ``others`` hold too that its solution ended early; else empty.
    """

    compression: Compression
    taken: tuple[MaterialValue, ...]
    doubts: tuple[str, ...] = ()
    others: tuple[Compression, ...] = ()
    tops: Mapping[str, Compression] = field(default_factory=dict)
    other_boundaries: tuple[Compression, ...] = ()
    bounded: bool = True
    of_mesh: tuple[Compression, ...] = ()


def law_of(
    design: Design, answer: Answer, name: str = "", *, printed: PressedPiece | None = None, tip: Tip = FLAT,
    until_pa: float = 0.0,
) -> Law:  # fmt: skip
    """The best available pressure law of a design; "solved" takes a minute or two.

    Parameters
    ----------
    design : Design
        As drawn.
    answer : Answer
        Its unloaded capacitance.
    name : str
        One of ``LAWS``, or "" for the best available without solving.
    printed : PressedPiece, optional
        As printed; as drawn where not given.
    tip : Tip
        What presses.
    until_pa : float
        Pressure up to which it is wanted, if more than usual [Pa].

    Raises
    ------
    UnknownName, OutOfRange
        No such law; or a law that does not apply to this shape.
    MissingValue, BadInput
        For "solved": no modulus or Poisson's ratio, no NGSolve, a cell that is no prism.
    """
    if name not in ("", *LAWS):
        raise UnknownName("law of compression", name, LAWS)
    moduli, piece = of_all_materials(design, "youngs_modulus_pa"), printed or drawn(design)
    if is_plate(answer, piece.scene):
        return _plate(design, moduli, name, piece)
    if name in ("bonded", "free"):
        condition = (
            "the law 'bonded' applies to a solid plate" if name == "bonded" else "cells are held by their neighbours"
        )
        raise OutOfRange(f"{condition}; {design.shape} has gaps: expected 'unconfined' or the sides symmetric")
    stored = None if name in ("unconfined", "infill") else _stored(design, printed)
    if stored and until_pa <= _PAST * stored.stress_pa[-1]:
        return _stored_law(design, stored, moduli, tip)
    if name == "solved":
        return solved(design, printed, tip=tip, until_pa=until_pa)
    return _unsolved(design, moduli[film(design)], name, piece)


def _unsolved(design: Design, soft: MaterialValue, name: str, piece: PressedPiece) -> Law:
    """A cell with gaps as infill where it is like that, else as a plate of its soft material, of unknown error."""
    may = name == "infill" or (name != "unconfined" and like_infill(design, piece))
    if may and (by_infill := infill(design, piece)):
        return by_infill
    if name == "infill":
        raise OutOfRange(
            f"the law 'infill' applies to solids that stand between electrodes that stay flat; {design.shape} has none"
        )
    doubt = (
        f"{design.shape} approximated by a free solid plate of {soft.material} (B.49): its cell was not solved; "
        "predict --compression solved does that, in seconds to a minute"
    )
    return Law(compression.unconfined(soft.value), (soft,), (doubt,), bounded=False)


@dataclass(frozen=True)
class LawOption:
    """An available law.

    Attributes
    ----------
    name : str
        Method.
    seconds : float
        Expected time [s].
    expected : Law
        Estimate of the law, to judge its error.
    find : function
        Computes the law; raises as :func:`solved`.
    """

    name: str
    seconds: float
    expected: Law
    find: Callable[[], Law]


def options(
    design: Design, answer: Answer, name: str = "", *, printed: PressedPiece | None = None, tip: Tip = FLAT,
    until_pa: float = 0.0,
) -> list[LawOption]:  # fmt: skip
    """The available laws of a design, the least expensive first; parameters and errors as of :func:`law_of`."""
    piece, moduli = printed or drawn(design), of_all_materials(design, "youngs_modulus_pa")
    asked = name == "solved" and not is_plate(answer, piece.scene)
    at_once = law_of(design, answer, "" if asked else name, printed=printed, tip=tip, until_pa=until_pa)
    known = LawOption(at_once.compression.name, 0.0, at_once, lambda: at_once)
    if at_once.bounded or name == "unconfined":
        return [known]
    model = mesh_ladder.model_of(piece, quick=not asked)
    meshes = [
        LawOption(
            mesh.name,
            mesh.seconds,
            _cell(expected(design, mesh), moduli),
            partial(solved, design, printed, mesh.level, model=model, tip=tip, until_pa=until_pa),
        )
        for mesh in mesh_ladder.mesh_levels(piece, model, len(stresses_pa(until_pa)) - 1)
    ]
    return meshes if asked else [known, *meshes]


def expected(design: Design, mesh: mesh_ladder.MeshLevel) -> CapacitanceCurve:
    """Estimate of an unknown cell's curve on a mesh: that of the prototype that it resembles."""
    modulus_pa = of_all_materials(design, "youngs_modulus_pa")[film(design)].value
    scale = max(modulus_pa / compression.PROTOTYPE_PA, 1 / compression.REACH)  # softer ones could not be extrapolated
    return replace(compression.prototype(_LIKE[mesh.model]).scaled_modulus(scale), within=mesh.rise_error)


def nearest(design: Design, piece: PressedPiece, answer: Answer, until_pa: float) -> Law:
    """The nearest prototype's law for an unsolved cell in 3D, its error unknown up to the last pressure it is used for.

    Beyond that one the cell lies between no rise at all and the closed cell, whose error is bounded.

    Parameters
    ----------
    design, piece
        Whose cell it is, drawn or printed.
    answer : Answer
        Capacitance of the whole sensor, unloaded.
    until_pa : float
        Pressure up to which it is wanted [Pa].
    """
    from sensorgen.models import closed
    from sensorgen.models.press2d import BoundaryConditions

    like = expected(design, mesh_ladder.mesh_levels(piece, "press3d", 1)[0])
    law, last_pa = _cell(like, of_all_materials(design, "youngs_modulus_pa")), like.stress_pa[-1]
    if until_pa <= compression.REACH * last_pa:
        return replace(law, bounded=False)
    case = _case(design, piece, "press3d", BoundaryConditions())
    area_m2 = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    loads = (*like.stress_pa[1:], until_pa)
    try:
        closed_f = [closed_f_per_m2(case, p) * area_m2 for p in loads]
    except ValueError:
        return replace(law, bounded=False)
    most = compression.curve(
        like.name, closed.SOURCE, (0.0, *loads), (1.0, *(c / answer.capacitance_f.lower for c in closed_f))
    )
    slope = min(like.slope_per_pa[-1], max(0.0, most.ratio[-1] - like.ratio[-1]) / (until_pa - last_pa))
    between = extended(like, until_pa, slope)
    doubt = (
        f"up to {until_pa / 1e3:.4g} kPa, where no cell like it was solved, the rise of C lies between none and that "
        f"of the closed cell, {100 * (most.ratio[-1] - 1):.3g} %"
    )
    others = between.scaled_rise(_NONE), most
    return replace(law, compression=between, doubts=(*law.doubts, doubt), others=others, of_mesh=others)


def like_infill(design: Design, piece: PressedPiece) -> bool:
    """Test whether the law of infill comes first: lines of sparse infill, or a cell that no solver applies to."""
    from sensorgen.checks import estimate

    if piece.period_mm is not None:
        return False
    sparse = any(lines.infill < 1 for lines in estimate.lines(design).values())
    return sparse or all(mesh_ladder.why_not_applicable(piece, model) for model in mesh_ladder.MODELS)


def infill(design: Design, piece: PressedPiece) -> Law | None:
    """Law of what lies between flat electrodes, as infill does, between bounds of its stiffness; None of other cells.

    The upper electrode may bend over the air; None too where that could be most of what the cell yields.

    Parameters
    ----------
    design : Design
        Whose materials it has.
    piece : PressedPiece
        Drawn or printed.
    """
    from sensorgen.models import porous

    moduli = of_all_materials(design, "youngs_modulus_pa")
    filling = porous.filling(piece.scene, {n: t.value for n, t in moduli.items()})
    if not filling or filling.bend_per_pa * filling.modulus_pa.lower > _BENDS:
        return None
    eps = {t.material: t.value for t in permittivities(design)}
    modulus_pa, power = filling.modulus_pa, filling.rise_powers(eps[film(design)])

    def law(modulus: float, power: float) -> CapacitanceCurve:
        ratio = (1 - _STRAIN) ** -power
        own = compression.curve("infill", porous.SOURCE, (modulus * _STRAIN).tolist(), ratio.tolist())
        return replace(own, displacement_m=float(_STRAIN[-1]) * filling.gap_mm * M_PER_MM)

    softest = 1 / (1 / modulus_pa.lower + filling.bend_per_pa)
    others = law(softest, power.upper), law(modulus_pa.upper, power.lower)
    return Law(law(modulus_pa.middle(), power.middle()), tuple(moduli.values()), others=others)


def _stored(design: Design, printed: PressedPiece | None) -> CapacitanceCurve | None:
    """The stored curve of this cell as drawn, or as printed as those of the thesis's designs are; else None.

    Those are of bodies of given materials, of one Poisson's ratio and given permittivities.
    """
    if not _is_solved(design):
        return None
    moduli_pa = {n: t.value for n, t in of_all_materials(design, "youngs_modulus_pa").items()}
    if printed is None:
        return compression.solved(design.shape, vars(design.params), moduli_pa)
    # Estimates; G-code, of which equal slices differ by 4 nm; both as mirror images, as other counts of periods are
    keys = (content(printed, digits, turned=turned) for turned in (False, True) for digits in (6, 3))
    return next(filter(None, (compression.solved_print(key, moduli_pa) for key in keys)), None)


def _is_solved(design: Design) -> bool:
    """Test whether bodies, Poisson's ratios and permittivities are those of the stored cells."""
    if {(bool(b.terminal), b.material) for b in design.in_use.bodies} != compression.SOLVED_OF:
        return False
    eps = {t.material: t.value for t in permittivities(design)}
    ratios = [taken.value for taken in of_all_materials(design, "poisson_ratio").values()]
    return all(abs(ratio - compression.SOLVED_RATIO) < _SAME_RATIO for ratio in ratios) and all(
        abs(eps[name] / value - 1) < _SAME_PERMITTIVITY for name, value in compression.SOLVED_PERMITTIVITY.items()
    )


def content(piece: PressedPiece, digits: int = 6, *, turned: bool = False) -> str:
    """Identity of a cell's cross-section or its mirror image, else of its boxes, to a digit of a millimetre.

    "" of other cells.
    """
    parts = _places(piece.scene, turned=turned)
    rounded = sorted((b.material, b.terminal, [[round(v, digits) for v in at] for at in places]) for b, places in parts)
    return sha256(dumps([rounded, piece.period_mm]).encode()).hexdigest()[:16] if parts else ""


def _places(scene: Scene, *, turned: bool) -> list[tuple[Body, Sequence[Point]]]:
    """Bodies of a cell by the corners of their cross-section, else by the spans of their boxes; none of other cells."""
    try:
        section, *others = sections(scene)
    except ValueError:
        return []
    if not others:
        bodies, outlines = zip(*section.regions, strict=True)
        return list(zip(bodies, _mirrored(outlines) if turned else outlines, strict=True))
    boxes: list[tuple[Body, Sequence[Point]]]
    boxes = [(body, [p.span(axis) for axis in "xyz"]) for body, p in scene.pieces if p.is_box()]
    return boxes if len(boxes) == len(scene.pieces) and not turned else []


def _mirrored(outlines: Sequence[tuple[Point, ...]]) -> list[tuple[Point, ...]]:
    """Outlines turned about their middle, each from its lowest corner on, the leftmost of these."""
    middle = sum(f(x for outline in outlines for x, _ in outline) for f in (min, max))
    turned = [tuple((middle - x, z) for x, z in outline[::-1]) for outline in outlines]
    starts = [outline.index(min(outline, key=lambda p: p[::-1])) for outline in turned]
    return [outline[k:] + outline[:k] for outline, k in zip(turned, starts, strict=True)]


def _plate(design: Design, moduli: Mapping[str, MaterialValue], name: str, piece: PressedPiece) -> Law:
    """A plate: bonded to electrodes that it stretches, on a base that holds the lower one; or as ``name`` says.

    A solid with cogs, or of several materials, as one of the film's material between plain electrodes, its range from
    the softest to the stiffest of all in it.
    """
    if name in ("infill", "solved"):
        raise OutOfRange(f"{design.shape} is a solid plate: expected the law 'unconfined', 'bonded' or 'symmetric'")
    soft, ratio = moduli[film(design)], poisson_ratio(design, film(design))
    e = soft.value
    if name == "symmetric":
        return Law(compression.symmetric(e, ratio), (soft,))
    tied, sliding, stiff = _bonded(design, moduli, piece.scene, e, ratio)
    if name in ("unconfined", "free"):
        doubt = "plate free to expand sideways: bonded to its electrodes it would be stiffer"
        return Law(compression.unconfined(e), (soft,), (doubt,), (tied,))
    how = ", ".join(
        f"{law.modulus_pa / e:.3g} E {where}"
        for law, where in ((tied, "on a base that holds the lower one"), (sliding, "on one that slides"),
                           (stiff, "between stiff faces"))
    )  # fmt: skip
    inside = [moduli[name].value / e for name in _inside(piece.scene)]
    others = sliding.scaled_modulus(min(inside)), stiff.scaled_modulus(max(inside))
    return Law(tied, (soft,), (f"plate bonded to electrodes that it stretches: {how}", *_of_cogs(piece.scene)), others)


def _inside(scene: Scene) -> set[str]:
    """Materials below the top of the upper electrode that are no electrode's."""
    roof = max(p.span("z")[1] for body in scene.bodies if body.terminal == "top" for p in body.pieces)
    return {b.material for b in scene.bodies if not b.terminal and min(p.span("z")[0] for p in b.pieces) < roof}


def _of_cogs(scene: Scene) -> Iterator[str]:
    """Remark on a solid that is not even."""
    spans = {(body.terminal, p.span("z")) for body in scene.bodies if body.terminal for p in body.pieces}
    if len(_inside(scene)) > 1 or len(spans) > len({terminal for terminal, _ in spans}):
        yield "a solid with cogs, or of several materials, taken as a plate of its film's material between flat faces"


def _bonded(
    design: Design, moduli: Mapping[str, MaterialValue], scene: Scene, e: float, ratio: float
) -> tuple[compression.Plate, compression.Plate, compression.Plate]:
    """A bonded plate on a base that holds the lower electrode, on one that slides, and between stiff faces."""
    width = min(design.params.width_mm, design.params.length_mm) * M_PER_MM
    rubber = e, width, gap_m(scene), e / (3 * (1 - 2 * ratio)) if ratio < 0.5 else np.inf
    stiff = compression.bonded(*rubber)
    if any(body.material not in moduli for body in scene.bodies if body.terminal):
        return stiff, stiff, stiff
    ends = [_electrode(moduli, scene, end) for end in ("bottom", "top")]
    return _between(rubber, ends, "bonded"), _between(rubber, ends, "sliding"), stiff


def _between(rubber: tuple[float, ...], ends: Sequence[tuple[float, float]], base: str) -> compression.Plate:
    """A film between its electrodes on a base."""
    from sensorgen.models import sandwich

    (low_pa, low_m), (top_pa, top_m) = ends
    modulus = sandwich.modulus_pa(*rubber, electrode_pa=(low_pa, top_pa), electrode_m=(low_m, top_m), base=base)
    return compression.Plate("bonded", f"bonded to both electrodes: {modulus / rubber[0]:.4g} E", modulus)


def poisson_ratio(design: Design, material: str) -> float:
    """Poisson's ratio [-]; that of rubber where no source gives one."""
    try:
        return design.material(material).value("poisson_ratio", design.used()[material]).value
    except MissingValue:
        return 0.5


def _electrode(moduli: Mapping[str, MaterialValue], scene: Scene, end: str) -> tuple[float, float]:
    """Young's modulus [Pa] and thickness [m] of an electrode."""
    bodies = [body for body in scene.bodies if body.terminal == end]
    spans = [p.span("z") for body in bodies for p in body.pieces]
    return moduli[bodies[0].material].value, (max(z for _, z in spans) - min(z for z, _ in spans)) * M_PER_MM


def _cell(
    curve: CapacitanceCurve, moduli: Mapping[str, MaterialValue], tops: Mapping[str, CapacitanceCurve] | None = None
) -> Law:
    """Law of a solved cell, with the errors of its rise and onset, and under other boundary conditions."""
    other_boundaries = tuple(curve.scaled_rise(1 + change) for change in curve.boundary_changes)
    return Law(curve, tuple(moduli.values()), curve.doubts, _ends(curve), tops or {}, other_boundaries)


def _ends(curve: CapacitanceCurve) -> tuple[CapacitanceCurve, CapacitanceCurve]:
    """A curve with the least and the largest rise within its error."""
    least, most = (replace(curve.scaled_rise(1 + s * curve.within), onset=1 + s * _ONSET) for s in (-1, 1))
    return least, most


def _stored_law(design: Design, even: CapacitanceCurve, moduli: Mapping[str, MaterialValue], tip: Tip) -> Law:
    """Law of a stored cell, solved under an even pressure, and under a block at least as high as the usual one."""
    tops = {EVEN: even, STIFF: even.scaled_rise(1 + even.stiff_change)}
    modulus_pa = design.material(Tip.block).value("youngs_modulus_pa").value
    usual = tip.block == Tip.block and tip.height_m >= Tip.height_m and modulus_pa == compression.BLOCK_PA
    return _cell(tops.get(tip.block) or even.under_block(usual=usual), moduli, tops)


def stresses_pa(until_pa: float) -> tuple[float, ...]:
    """Pressures at which a cell is solved, from 0 to the usual last one or beyond [Pa]."""
    more = max(0, ceil(log(max(until_pa, 1.0) / STRESS_PA[-1]) / log(_FURTHER)))
    return (*STRESS_PA, *(STRESS_PA[-1] * _FURTHER**k for k in range(1, more + 1)))


def solved(
    design: Design,
    printed: PressedPiece | None = None,
    level: int = mesh_ladder.USUAL,
    boundary: "BoundaryConditions | None" = None,
    model: str = "",
    *,
    tip: Tip = FLAT,
    until_pa: float = 0.0,
) -> Law:
    """The law of a cell by finite elements on one mesh, its error by the next coarser one.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : PressedPiece, optional
        As printed; as drawn where not given.
    level : int
        Of the mesh, as of :func:`sensorgen.prediction.mesh_ladder.pressed`.
    boundary : BoundaryConditions, optional
        Boundary and contact conditions, in place of those of the tip.
    model : str, optional
        One that applies to the cell; the first if not given.
    tip : Tip
        What presses.
    until_pa : float
        Pressure up to which it is wanted, if more than usual [Pa].

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        No modulus or Poisson's ratio, no NGSolve; a cell that is no prism; a solution that is not to be trusted.
    """
    moduli, ratios = of_all_materials(design, "youngs_modulus_pa"), of_all_materials(design, "poisson_ratio")
    piece = printed or drawn(design)
    model = model or mesh_ladder.model_of(piece)
    loads = stresses_pa(until_pa)
    case = _case(design, piece, model, boundary) if boundary else case_of(design, piece, model, tip)
    estimate = mesh_ladder.estimated(case, loads, level, sound=True)
    solution = estimate.found
    if solution.converged_pa < _ENOUGH * STRESS_PA[-1]:
        solution = pressed(case, loads, level)
    curve = curve_of(solution)
    shares = estimate.rise_error_f_per_m2[1:] / estimate.rise_f_per_m2[1:]
    known = shares[np.isfinite(shares)]
    if not known.size:
        raise OutOfRange("the error of the solved cell is unknown: the next coarser mesh did not converge")
    curve = replace(
        curve, within=float(known.max()), displacement_m=float(solution.displacement_m[-1]) - solution.fall_m
    )
    short = curve.stress_pa[-1] < loads[-1]
    ended = [f"the solution of the cell ended at {curve.stress_pa[-1] / 1e3:.3g} kPa"] if short else []
    doubts = (*solution.doubts, *([_LANDING] if solution.fall_m else []), *ended)
    tops = {} if boundary else under_tops(design, piece, model, tip, curve, level=level)
    law = _cell(replace(curve, doubts=doubts), {**moduli, **{f"{n}'s ratio": t for n, t in ratios.items()}}, tops)
    at_rest = solution.capacitance_f_per_m2[0]
    return _further(law, replace(curve, doubts=doubts), tops, replace(case, piece=piece), until_pa, at_rest)


def closed_f_per_m2(case: Case, stress_pa: float) -> float:
    """Capacitance per area that a case does not exceed under a pressure [F/m2]; ValueError where it has no columns."""
    from sensorgen.models import closed

    scene = case.piece.scene
    softest_pa = min(case.solids[b.material].youngs_modulus_pa for b in scene.bodies if not b.terminal)
    return closed.most_f_per_m2(scene, case.permittivity, softest_pa, stress_pa)


def _further(
    law: Law, own: CapacitanceCurve, tops: Mapping[str, CapacitanceCurve], case: Case, until_pa: float,
    at_rest: Interval | None,
) -> Law:  # fmt: skip
    """A law up to a pressure that its cell was not solved for: between no further rise and that of the closed cell."""
    last_pa, (least, upper) = own.stress_pa[-1], _ends(own)
    if not at_rest or until_pa <= last_pa:
        return law
    highest = upper
    try:
        for pressure_pa in np.linspace(last_pa, until_pa, _CLOSED + 1)[1:].tolist():  # a cell may close at any of them
            ratio = max(closed_f_per_m2(case, pressure_pa) / at_rest.lower, highest.ratio[-1])
            slope = (ratio - highest.ratio[-1]) / (pressure_pa - highest.stress_pa[-1])
            highest = extended(highest, pressure_pa, slope)
    except ValueError:
        return law
    most = highest.ratio[-1]
    slope = min(own.slope_per_pa[-1], (most - own.ratio[-1]) / (until_pa - last_pa))
    between = extended(own, until_pa, slope)
    doubt = (
        f"from {last_pa / 1e3:.3g} to {until_pa / 1e3:.4g} kPa the rise of C lies between none more, "
        f"{100 * (least.ratio[-1] - 1):.3g} %, and that of the closed cell, {100 * (most - 1):.3g} %"
    )
    return replace(
        law,
        compression=between,
        doubts=(*law.doubts, doubt),
        others=(extended(least, until_pa, 0.0), highest),
        tops={name: _as_far(top, between) for name, top in tops.items()},
        of_mesh=tuple(extended(c, until_pa, slope) for c in (least, upper)),
    )


def _as_far(top: CapacitanceCurve, own: CapacitanceCurve) -> CapacitanceCurve:
    """A curve continued in proportion to another one, from its last point on."""
    last_pa = top.stress_pa[-1]
    thinning = float(own.capacitive_strain(np.asarray(last_pa))[0])
    share, n = (top.ratio[-1] - 1) / (thinning / (1 - thinning)), sum(p <= last_pa for p in own.stress_pa)
    return replace(
        top, stress_pa=(*top.stress_pa, *own.stress_pa[n:]),
        ratio=(*top.ratio, *(1 + share * (g - 1) for g in own.ratio[n:])),
        slope_per_pa=(*top.slope_per_pa, *(share * m for m in own.slope_per_pa[n:])),
    )  # fmt: skip


def under_tops(
    design: Design, piece: PressedPiece, model: str, tip: Tip, own: CapacitanceCurve,
    boundary: "BoundaryConditions | None" = None, level: int = mesh_ladder.USUAL,
) -> dict[str, CapacitanceCurve]:  # fmt: skip
    """Curves under an even pressure and a stiff plate, by the ratio of rises on the next coarser mesh.

    Where a quarter of the last pressure has another one, as gaps close under one top before they do under another, it
    is solved at every pressure of ``own``: at 10 kPa it may be half of that at 25 kPa.

    Parameters
    ----------
    design, piece, model, tip, boundary
        As of :func:`case_of`.
    own : CapacitanceCurve
        Under the tip.
    level : int
        Of its mesh.
    """
    stress, rise = np.array(own.stress_pa), np.array(own.ratio) - 1
    level = max(mesh_ladder.coarsest(model), level - 1)

    def over_own(block: str, loads: Sequence[float]) -> tuple[Real, Real]:
        """Pressures (n,) [Pa], and rises on the coarse mesh over those of ``own`` [-]; none where it is not solved."""
        try:
            solution = pressed(case_of(design, piece, model, replace(tip, block=block), boundary), loads, level).sound()
        except SensorgenError:
            return np.zeros(0), np.zeros(0)
        c = np.array([c.middle() if c else np.nan for c in solution.capacitance_f_per_m2])
        ratio = (c[1:] / c[0] - 1) / rise[np.searchsorted(stress, solution.stress_pa[1:])]
        return solution.stress_pa[1:][np.isfinite(ratio)], ratio[np.isfinite(ratio)]

    few, curves = mesh_ladder.few(own.stress_pa), {tip.block: own} if not tip.soft else {}
    of_mesh, blocks = over_own(tip.block, few), [top for top in TOPS if top != tip.block]
    for block in blocks if of_mesh[0].size else ():
        for loads in (sorted({*few[:2], few[-1]}), own.stress_pa):
            at, ratio = over_own(block, loads)
            ratio = ratio / np.interp(at, *of_mesh)
            if len(at) == len(loads) - 1 and ratio.max() < _ALIKE * ratio.min():
                break
        if at.size:
            known = stress[stress <= at.max()]
            curves |= _rising(block, own, rise[: len(known)] * np.interp(known, at, ratio))
    return curves


def _rising(name: str, own: CapacitanceCurve, rise: Real) -> dict[str, CapacitanceCurve]:
    """A curve of other rises at the first pressures of one, by its name, as far as it rises; none if nowhere."""
    end = 1 + int(np.argmin(np.append(np.diff(rise) > 0, False)))  # a coarse mesh may fall after a contact
    if end == 1:
        return {}
    curve = compression.curve(own.name, own.source, own.stress_pa[:end], (1 + rise[:end]).tolist())
    return {name: replace(curve, within=own.within)}


def _few_pa(stress_pa: float) -> list[float]:
    """A few pressures up to beyond one; to the usual last one, where it is far beyond that [Pa]."""
    last_pa = STRESS_PA[-1] if stress_pa > _PAST * STRESS_PA[-1] else _PAST * stress_pa
    return [last_pa * share for share in _FEW]


def at_a_few_pressures(
    design: Design, printed: PressedPiece, answer: Answer, stress_pa: float, name: str = "", *, tip: Tip = FLAT,
    level: int = mesh_ladder.COARSEST,
) -> Law | None:  # fmt: skip
    """The stored law of a printed cell; else a section or round cell solved at a few pressures on the coarsest mesh.

    Of a cell in 3D the law of infill, where it applies.

    Its own error is not known: it tells by how much ways to print differ, which is far more.

    Parameters
    ----------
    design, printed, answer, name
        As of :func:`law_of`.
    stress_pa : float
        Up to which it is wanted [Pa].
    tip : Tip
        What presses.
    level : int
        Of the mesh.

    Returns
    -------
    Law or None
        None where there is none, and where the solver gives up.
    """
    if name == "infill":
        return infill(design, printed)
    if name in ("bonded", "symmetric") and not is_plate(answer, printed.scene):
        name = ""
    known = law_of(design, answer, name, printed=printed, tip=tip, until_pa=stress_pa)
    if known.bounded:
        return known
    model = mesh_ladder.model_of(printed, quick=True)
    if model == "press3d":
        law = infill(design, printed) or nearest(design, printed, answer, stress_pa)
        return law if law.bounded else None
    try:
        case = case_of(design, printed, model, tip)
        solution = pressed(case, _few_pa(stress_pa), level)
        curve = curve_of(solution)
    except SensorgenError:
        return None
    fallen_m = float(solution.displacement_m[-1]) - solution.fall_m
    curve = replace(curve, displacement_m=fallen_m)
    law, at_rest = replace(known, compression=curve, doubts=()), solution.capacitance_f_per_m2[0]
    return _further(law, curve, {}, replace(case, piece=printed), stress_pa, at_rest)


def _case(design: Design, piece: PressedPiece, model: str, boundary: "BoundaryConditions") -> Case:
    eps = {t.material: t.value for t in permittivities(design)}
    return Case(piece, model, elastic(design, piece.scene), eps, boundary)


def case_of(
    design: Design, piece: PressedPiece, model: str, tip: Tip, boundary: "BoundaryConditions | None" = None
) -> Case:  # fmt: skip
    """A piece under a tip: an even pressure, a stiff plate, or a block that is bonded to its top.

    Parameters
    ----------
    design, piece, model
        As of :class:`sensorgen.prediction.mesh_ladder.Case`.
    tip : Tip
        What presses; of a high block the part that spreads the pressure, and none where sides are free or every body
        is a layer, which any top presses evenly.
    boundary : BoundaryConditions, optional
        All but the top.

    Raises
    ------
    MissingValue, UnknownName
        A modulus or Poisson's ratio that no source gives; no such material.
    """
    from sensorgen.models.press2d import BoundaryConditions, Elastic
    from sensorgen.solvers.contact.cell import BLOCK

    boundary = replace(boundary or BoundaryConditions(), top="rigid" if tip.block == STIFF else "even")
    case = _case(design, piece, model, boundary)
    if not tip.soft or boundary.period == "free" or _is_layered(piece.scene):
        return case
    material = design.material(tip.block)
    block = Elastic(*(material.value(q).value for q in ("youngs_modulus_pa", "poisson_ratio")))
    return replace(
        case, piece=_under_block(piece, tip.height_m / M_PER_MM, BLOCK), solids={**case.solids, BLOCK: block},
        permittivity={**case.permittivity, BLOCK: 1.0},
    )  # fmt: skip


def _is_layered(scene: Scene) -> bool:
    """True where every body is a layer over the whole plan: any top presses it evenly."""
    plans = {(p.is_box(), p.span("x"), p.span("y")) for body in scene.bodies for p in body.pieces}
    return len(plans) == 1 and all(is_box for is_box, *_ in plans)


def _under_block(piece: PressedPiece, height_mm: float, name: str) -> PressedPiece:
    """A piece with a block of some name and material on all of its top."""
    parts = [p for body in piece.scene.bodies for p in body.pieces]
    (x0, x1), (y0, y1), (z0, z1) = (
        (min(a for a, _ in spans), max(b for _, b in spans)) for spans in ([p.span(n) for p in parts] for n in "xyz")
    )
    height_mm = min(height_mm, _PERIODS * piece.period_mm if piece.period_mm else _HEIGHTS * (z1 - z0))
    block = Body(name, name, (box(x0, x1, y0, y1, z1, round(z1 + height_mm, 6)),))
    return replace(piece, scene=replace(piece.scene, bodies=(*piece.scene.bodies, block)))


def elastic(design: Design, scene: Scene) -> "dict[str, Elastic]":
    """Elastic constants of each material of a scene."""
    from sensorgen.models.press2d import Elastic

    used = design.used()
    loaded = {name: design.material(name) for name in sorted({body.material for body in scene.bodies})}
    return {
        name: Elastic(*(material_value(m, used[name], q).value for q in ("youngs_modulus_pa", "poisson_ratio")))
        for name, m in loaded.items()
    }


def gap_m(scene: Scene) -> float:
    """Distance between the electrodes' plates, without their teeth [m]."""
    spans = {
        end: [p.span("z") for b in scene.bodies if b.terminal == end for p in b.pieces] for end in ("top", "bottom")
    }
    return (max(low for low, _ in spans["top"]) - min(high for _, high in spans["bottom"])) * M_PER_MM
