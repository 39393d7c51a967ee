"""Bodies of a design: the drawing, a print by the rules of slicers, a print by a tool path."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.files import reading
from sensorgen.design.body import DRAWN, Body, Cells, FilmThickness
from sensorgen.design.design import Design, make
from sensorgen.design.walls import WALLS
from sensorgen.design.walls import rules as wall_rules
from sensorgen.scene.scene import Prism

if TYPE_CHECKING:
    from sensorgen.asprinted.printed import Printed
    from sensorgen.prediction.print_files import PrintFile
    from sensorgen.scene.scene import Scene


def drawn(design: Design) -> Body:
    """The body as drawn, support removed; of an array one crossing."""
    design = _one(design)
    return Body(design, DRAWN, "drawn", _identity(design, DRAWN), partial(_drawn_cells, design))


def _drawn_cells(design: Design) -> Cells:
    if design.border:
        return _inside(design, _drawn_cells(design.unbordered))
    period, ((scene, count), *beside) = getattr(design.params, "period_mm", None), _parts(design)
    scene = _connected(design, scene)
    if any(isinstance(p, Prism) and p.axis == "z" and not p.is_box() for b in scene.bodies for p in b.pieces):
        scene, periods = _one_period(scene)
        count *= periods
    rims = tuple((_connected(design, part), number) for part, number in beside)
    rimless = "its cells leave rims without structures: compression is that of the cells, as if there were no rims"
    remarks: dict[str, tuple[str, ...]] = {DRAWN: (rimless,) if rims else ()}
    return Cells({DRAWN: scene}, count, period, partial(_drawn_gap, design), remarks=remarks, beside=rims)


def _connected(design: Design, scene: "Scene") -> "Scene":
    """The scene, each electrode one body of one conductor."""
    conducting = [b.terminal for b in scene.bodies if b.terminal or design.conducts(b.material) for _ in b.pieces]
    if "" in conducting or len(set(conducting)) < len(conducting):  # else each electrode is one piece
        from sensorgen.scene.connections import connected_scene

        return connected_scene(scene, design.conducts)
    return scene


def _parts(design: Design) -> "list[tuple[Scene, float]]":
    """Parts of the sensor as drawn, with their numbers: of an array that is no prisms one cell, and its rims.

    Other patterns are whole: models of prisms find the cell, and what the sensor's ends cut off.
    """
    scene, params = design.in_use, design.params
    if all(isinstance(p, Prism) for b in scene.bodies for p in b.pieces):
        return [(scene, 1.0)]
    from sensorgen.scene.patterns import ArrayParams

    if not isinstance(params, ArrayParams):
        return [(scene, 1.0)]
    given = design.model_dump(exclude_defaults=True, mode="json")
    parts = []
    for length, width, count in params.parts():
        one = replace(params, length_mm=length, width_mm=width)
        parts.append((make(given | {"parameters": asdict(one)}).in_use, count))
    return parts


def _one_period(scene: "Scene") -> "tuple[Scene, float]":
    """One period of upright prisms of any outline, as of a print, and how many of it there are; else the whole."""
    from shapely import clip_by_rect
    from shapely.affinity import translate

    from sensorgen.asprinted.printed import window
    from sensorgen.scene.layers import drawn as layers
    from sensorgen.scene.layers import scene_of

    pieces = [p for body in scene.bodies for p in body.pieces]
    if not all(p.is_constant("z") for p in pieces):
        return scene, 1.0
    heights = tuple(sorted({z for p in pieces for z in p.span("z")}))
    plan, area = window(scene, heights), scene.size_mm[0] * scene.size_mm[1]
    if plan.area_mm2() > 0.99 * area:
        return scene, 1.0
    (x0, x1), (y0, y1) = plan.x_mm, plan.y_mm
    inside = [
        layer.mapped({n: translate(clip_by_rect(r, x0, y0, x1, y1), -x0, -y0) for n, r in layer.regions.items()})
        for layer in layers(scene, heights)
    ]
    like = replace(scene, size_mm=(*plan.sides_mm(), scene.size_mm[2]), repeats=plan.repeats)
    return scene_of(inside, like), area / plan.area_mm2()


def _inside(design: Design, whole: Cells) -> Cells:
    """Cells of a rectangle, counted inside the border of a design."""
    from sensorgen.asprinted.printed import window
    from sensorgen.design import borders
    from sensorgen.scene.border import share

    scene = design.unbordered.drawn
    plan = window(scene, design.layers.boundaries_mm(scene.size_mm[2]))
    sides = whole.first().size_mm[:2] if whole.beside else plan.sides_mm()
    left = share(scene, borders.region(design.border or ""), sides)
    remark = (
        f"{100 * left.area:.3g} % of the rectangle is inside the border: its capacitance is that share of the cells', "
        f"to {100 * left.error:.2g} %; resistances and loads are those of the rectangle"
    )
    remarks = {name: (*whole.remarks.get(name, ()), remark) for name in whole.scenes}
    beside = tuple((part, number * left.area) for part, number in whole.beside)
    return replace(whole, count=whole.count * left.area, beside=beside, count_error=left.error, remarks=remarks)


def _drawn_gap(design: Design) -> dict[str, float]:
    from sensorgen.asprinted.printed import drawn_gap_mm

    return {DRAWN: drawn_gap_mm(design)}


def estimated(design: Design, walls: str = "") -> Body:
    """The body as slicers should print it, without a tool path.

    Parameters
    ----------
    design : Design
        What is printed.
    walls : str
        One of ``WALLS`` alone; if not given, all that the design's walls can come out as, the likeliest first.

    Raises
    ------
    UnknownName
        No such walls.
    """
    if walls not in ("", *WALLS):
        raise UnknownName("walls", walls, WALLS)
    design = _one(design)
    rules = (walls,) if walls else wall_rules(design.profile.walls)
    provenance = f"printed, estimated ({WALLS.get(rules[0], rules[0])})"
    identity = _identity(design, "estimated", *rules, _height_error(design))
    return Body(design, "estimated", provenance, identity, partial(_estimated_cells, design, rules))


def _estimated_cells(design: Design, rules: Sequence[str]) -> Cells:
    if design.border:
        return _inside(design, _estimated_cells(design.unbordered, rules))
    from sensorgen.asprinted import printed
    from sensorgen.checks.estimate import SHIFTS, lines

    prints = {rule: printed.body(design, walls=rule) for rule in rules}
    if any(of.infill < 1 for of in lines(design).values()):
        for shift, rule in product(SHIFTS, rules):
            prints[f"{rule}, infill {shift[0]:g}/{shift[1]:g}"] = printed.body(design, walls=rule, shift=shift)
    return _printed_cells(prints)


def sliced(design: Design, printed: "Callable[[], Printed]", source: str, content: bytes) -> Body:
    """The body as a tool path prints it.

    Parameters
    ----------
    design : Design
        What is printed.
    printed : callable
        Reads the tool path, as :func:`sensorgen.asprinted.printed.body`.
    source : str
        Of the tool path: slicer, version, file.
    content : bytes
        Of the file.
    """
    identity = _identity(design, "sliced", sha256(content).hexdigest(), _height_error(design))
    return Body(design, "sliced", f"printed, {source}", identity, partial(_sliced_cells, printed, source))


def _sliced_cells(printed: "Callable[[], Printed]", source: str) -> Cells:
    return _printed_cells({source: printed()})


def from_gcode(design: Design, file: str | Path) -> Body:
    """The body by a file of G-code that somebody has sliced; of an array that of one crossing.

    Parameters
    ----------
    design : Design
        That was sliced.
    file : str or Path
        The file; where on the bed, and whether turned by 90 degrees, is found out.

    Raises
    ------
    BadInput
        No such file; when the cells are needed, as :func:`sensorgen.asprinted.beads.placed`.
    """
    path, design = Path(file), _one(design)
    with reading(path):
        content = path.read_bytes()
    return sliced(design, partial(registered, design, path), path.name, content + _of_another(design, path).encode())


def registered(design: Design, path: Path) -> "Printed":
    """Print of a design by a file of G-code; parameters and errors as of :func:`from_gcode`."""
    from sensorgen.asprinted import agreement, beads, printed

    try:
        placement = beads.placed(design, path)
        wrong = agreement.misfits(design, placement.paths, placement.centre_mm)
        body = printed.body(design, placement.paths, slicer=path.name, centre_mm=placement.centre_mm)
    except BadInput as error:
        raise error.within(str(path)) from None
    more = f" ({len(wrong) - 1} more by gcode check --design)" if len(wrong) > 1 else ""
    return replace(body, doubts=(*filter(None, [_of_another(design, path)]), *(f.message + more for f in wrong[:1])))


def _of_another(design: Design, path: Path) -> str:
    """That the record beside a file of G-code names another design; "" without one."""
    for note in (path.with_name(f"{path.name}.json"), path.with_suffix(".json")):
        try:
            record = json.loads(note.read_bytes())
            if record["sha256"] == sha256(path.read_bytes()).hexdigest() and record["design"] not in design.ids():
                name = record["name"]
                return (
                    f"the record beside {path.name} names another design, {name!r:.40}: gcode check --design compares"
                )
        except (OSError, ValueError, KeyError, TypeError, RecursionError):  # no record of ours
            continue
    return ""


def default_body(design: Design, folder: Path | None = None) -> Body:
    """The print of a design: by the G-code in its folder, else by a slicer that is installed, else by its rules.

    Parameters
    ----------
    design : Design
        What is printed.
    folder : Path, optional
        With the design's files; ``out/NAME`` in the working folder if not given.
    """
    from sensorgen.prediction import print_files

    return of_file(design, print_files.at_hand(design, folder)[0])


def of_file(design: Design, file: "PrintFile | None") -> Body:
    """The print by a G-code file of this very design; by the rules of slicers where there is none.

    Of an array it is one crossing, sliced alone by the same slicer.
    """
    if design.layout and file:
        from sensorgen.prediction import print_files

        slicer = file.record["slicer"]["name"]
        return of_file(design.crossing, print_files.at_hand(design.crossing, slicer=slicer)[0])
    if file is None:
        return estimated(design)
    return sliced(design, partial(file.printed, design), file.source, file.content)


def _printed_cells(prints: "Mapping[str, Printed]") -> Cells:
    """Cells by every rule: of walls for estimates, of bead widths for a tool path."""
    from sensorgen.asprinted import film
    from sensorgen.scene.sections import sections

    cells, remarks = {}, {}
    for rule, printed in prints.items():
        words = printed.remarks()
        for name, cell in printed.cells.items():
            key = rule if len(printed.cells) == 1 else name
            cells[key], remarks[key] = cell, words[name]
    first, (printed, *_) = next(iter(cells.values())), prints.values()
    period = None
    if getattr(printed.design.params, "period_mm", None) is not None:
        try:
            period = first.scene.size_mm["xy".index(sections(first.scene)[0].across)]
        except ValueError:  # no constant cross-section
            period = first.scene.size_mm[0]
    scenes = {name: cell.scene for name, cell in cells.items()}
    error_mm = printed.design.machine.tool_height_error_mm
    thicker = film.thicker(first.scene, error_mm)
    less = map(partial(film.thicker, first.scene), (-error_mm, -printed.design.layers.layer_mm))
    films = FilmThickness(error_mm, next(less), thicker, next(less)) if thicker else None
    whole = Cells(scenes, first.count, period, partial(_printed_gaps, scenes), printed.lines, remarks, films)
    return _inside(printed.design, whole) if printed.design.border else whole


def _printed_gaps(scenes: "Mapping[str, Scene]") -> dict[str, float]:
    from sensorgen.asprinted.printed import gap_mm

    return {name: gap_mm(scene) for name, scene in scenes.items()}


def _height_error(design: Design) -> str:
    return f"tools to {design.machine.tool_height_error_mm:g} mm"


def _one(design: Design) -> Design:
    """Design to predict: one crossing of an array, any other sensor as a whole."""
    return design.crossing if design.layout else design


def _identity(design: Design, *parts: str) -> str:
    return sha256(json.dumps([design.id(), *parts]).encode()).hexdigest()
