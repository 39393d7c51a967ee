"""Conductors of an electrode: those that touch it, whatever they are called; others float.

An electrode is the largest connected piece of the bodies that are drawn with its terminal. Pieces that share a face, an
edge or a corner touch.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
import shapely

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.layers import LayerRegions, Region, parts
from sensorgen.scene.scene import FLOATING, SLIVER_MM, Body, Piece, Scene, shadow

Conducts = Callable[[str], bool]  # whether a material, by its name, does


@dataclass(frozen=True)
class Short:
    """Where two electrodes touch.

    Attributes
    ----------
    bodies : (str, str)
        Names of what touches.
    place_mm : (float, float, float)
        Middle of where they do, x, y and z [mm].
    """

    bodies: tuple[str, str]
    place_mm: tuple[float, float, float]

    def words(self) -> str:
        """Names of what touches, and the place."""
        x, y, z = self.place_mm
        return f"{' and '.join(dict.fromkeys(self.bodies))} touch at x {x:.3g}, y {y:.3g}, z {z:.3g} mm"


def groups(count: int, one: Whole, other: Whole) -> Whole:
    """Number of the connected group of each of ``count`` things, of which some pairs are joined.

    Without SciPy's components, which take as long to load as a check to run.

    >>> groups(4, np.array([0, 3]), np.array([3, 1])).tolist()
    [0, 0, 1, 0]
    """
    label = np.arange(count)
    while True:
        low, joined = np.minimum(label[one], label[other]), label.copy()
        for ends in (one, other):  # the first of each group takes the least first of its neighbours
            np.minimum.at(joined, label[ends], low)
        while (joined[joined] != joined).any():
            joined = joined[joined]
        if (joined == label).all():
            return (np.cumsum(label == np.arange(count)) - 1)[label]
        label = joined


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Conducting pieces: what each is of, its outline, and what it spans square to that [mm]."""

    bodies: list[Body]
    outlines: np.ndarray
    spans_mm: Real

    @classmethod
    def along(cls, axis: str, pieces: Sequence[tuple[Body, Piece]]) -> "_Pieces":
        """Prisms along an axis, each with its body."""
        outlines = np.array([shapely.Polygon(shadow(p, axis)) for _, p in pieces])
        return cls([body for body, _ in pieces], outlines, np.array([p.span(axis) for _, p in pieces]))

    def touching(self) -> Whole:
        """Pairs of pieces (2, n) that touch."""
        x0, y0, x1, y1 = shapely.bounds(self.outlines).T
        boxes = shapely.box(x0 - SLIVER_MM, y0 - SLIVER_MM, x1 + SLIVER_MM, y1 + SLIVER_MM)
        one, other = shapely.STRtree(self.outlines).query(boxes)
        low, high = self.spans_mm.T
        meet = (low[one] < high[other] + SLIVER_MM) & (low[other] < high[one] + SLIVER_MM) & (one < other)
        one, other = one[meet], other[meet]
        shapely.prepare(self.outlines)
        near = shapely.dwithin(self.outlines[one], self.outlines[other], SLIVER_MM)
        return np.stack([one[near], other[near]])

    def terminals(self) -> tuple[list[str], list[tuple[int, int]], int]:
        """Terminal of each piece, pairs of pieces that short two of them, and how many connected pieces float."""
        pairs = self.touching()
        label = groups(len(self.bodies), *pairs)
        drawn = np.array([body.terminal for body in self.bodies])
        volume = shapely.area(self.outlines) * np.diff(self.spans_mm)[:, 0]
        terminals_of: dict[int, list[str]] = {}
        for terminal in sorted({*drawn.tolist()} - {"", FLOATING}):
            sizes = np.bincount(label[drawn == terminal], volume[drawn == terminal])
            terminals_of.setdefault(int(sizes.argmax()), []).append(terminal)
        terminals = [
            own if own in (here := terminals_of.get(piece, [FLOATING])) else here[0]
            for own, piece in zip(drawn.tolist(), label.tolist(), strict=True)
        ]
        shorts = [(i, j) for i, j in pairs.T.tolist() if terminals[i] != terminals[j]]
        return terminals, shorts, len(set(label.tolist()) - terminals_of.keys())


@dataclass(frozen=True)
class Connected:
    """Layers of which every conductor has the terminal that it touches.

    Attributes
    ----------
    layers : tuple of LayerRegions
        With the pieces that have another terminal than their body under a name of their own.
    bodies : tuple of Body
        All bodies, those pieces among them.
    shorts : tuple of Short
        Where electrodes touch, one for each pair of bodies.
    floating : int
        Connected pieces of conductor that touch no electrode.
    """

    layers: tuple[LayerRegions, ...]
    bodies: tuple[Body, ...]
    shorts: tuple[Short, ...]
    floating: int = 0

    def remarks(self) -> tuple[str, ...]:
        """Differences from two electrodes apart, in words."""
        one = "a piece of conductor touches no electrode"
        many = f"{self.floating} pieces of conductor touch no electrode"
        floating_words = [] if not self.floating else [f"{one if self.floating == 1 else many}: solved as floating"]
        return (*(f"short: {short.words()}" for short in self.shorts), *floating_words)


def connected_layers(layers: Sequence[LayerRegions], bodies: Sequence[Body], conducts: Conducts) -> Connected:
    """Terminals of the conducting pieces of some layers.

    Parameters
    ----------
    layers : sequence of LayerRegions
        From below.
    bodies : sequence of Body
        Whose regions they are, by name.
    conducts : callable
        Whether a material does.
    """
    named = {body.name: body for body in bodies if _is_conductor(body, conducts)}
    pieces = list(_parts(layers, named))
    if not pieces:
        return Connected(tuple(layers), tuple(bodies), ())
    numbers, owners, outlines = zip(*pieces, strict=True)
    spans = np.array([(layers[number].bottom_mm, layers[number].top_mm) for number in numbers])
    conductors = _Pieces(list(owners), np.array(outlines), spans)
    terminals, pairs, floating = conductors.terminals()
    renamed: dict[tuple[str, str], Body] = {}
    regions: list[dict[str, list[shapely.Polygon]]] = [{} for _ in layers]
    for (number, body, part), terminal in zip(pieces, terminals, strict=True):
        own = renamed.setdefault((body.name, terminal), _as(body, terminal))
        regions[number].setdefault(own.name, []).append(part)
    renamed_layers = [_replaced(layer, named.keys(), here) for layer, here in zip(layers, regions, strict=True)]
    others = [own for (name, terminal), own in renamed.items() if named[name].terminal != terminal]
    return Connected(tuple(renamed_layers), (*bodies, *others), tuple(_shorts(conductors, pairs)), floating)


def _parts(layers: Sequence[LayerRegions], named: Mapping[str, Body]) -> Iterator[tuple[int, Body, Region]]:
    """Connected parts of some bodies in each layer, with the layer's number."""
    for number, layer in enumerate(layers):
        for name in filter(named.__contains__, layer.regions):
            yield from ((number, named[name], part) for part in parts(layer.regions[name]))


def _replaced(
    layer: LayerRegions, names: Collection[str], parts_of: Mapping[str, list[shapely.Polygon]]
) -> LayerRegions:  # fmt: skip
    """A layer with other regions in place of those of some names."""
    others = {name: region for name, region in layer.regions.items() if name not in names}
    united = {name: shapely.multipolygons(own) if len(own) > 1 else own[0] for name, own in parts_of.items()}
    return layer.mapped(others | united)


def _as(body: Body, terminal: str) -> Body:
    """A piece of a body at a terminal, under a name of its own where that is not the body's."""
    return body if body.terminal == terminal else replace(body, name=f"{body.name}, {terminal}", terminal=terminal)


def _shorts(pieces: _Pieces, pairs: Sequence[tuple[int, int]]) -> Iterator[Short]:
    seen = set()
    for i, j in pairs:
        names = (pieces.bodies[i].name, pieces.bodies[j].name)
        if names not in seen:
            seen.add(names)
            at = shapely.shortest_line(pieces.outlines[i], pieces.outlines[j]).centroid
            shared = shapely.intersection(pieces.outlines[i], pieces.outlines[j])
            at = at if shared.is_empty else shared.representative_point()
            low = float(max(pieces.spans_mm[i][0], pieces.spans_mm[j][0]))
            yield Short(names, (float(at.x), float(at.y), low))


def connected_scene(scene: Scene, conducts: Conducts) -> Scene:
    """A scene of which every conductor has the terminal that it touches; itself where nothing changes.

    Pieces that are no prisms of one axis are left as they are.
    """
    conducting = [_is_conductor(body, conducts) for body, _ in scene.pieces]
    pieces = list(compress(scene.pieces, conducting))
    axis = _axis([piece for _, piece in pieces])
    if not axis:
        return scene
    terminals, *_ = _Pieces.along(axis, pieces).terminals()
    if [body.terminal for body, _ in pieces] == terminals:
        return scene
    by_name: dict[str, tuple[Body, list[Piece]]] = {}
    given = iter(terminals)
    for (body, piece), conductor in zip(scene.pieces, conducting, strict=True):
        own = _as(body, next(given)) if conductor else body
        by_name.setdefault(own.name, (own, []))[1].append(piece)
    return replace(scene, bodies=tuple(replace(body, pieces=tuple(own)) for body, own in by_name.values()))


def _is_conductor(body: Body, conducts: Conducts) -> bool:
    return bool(body.terminal or conducts(body.material))


def _axis(pieces: Sequence[Piece]) -> str:
    """The axis along which all of some pieces are prisms, or ""."""
    return next((axis for axis in "zyx" if all(p.is_constant(axis) for p in pieces)), "") if pieces else ""
