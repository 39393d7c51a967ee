"""Other thicknesses of a printed cell's film, which lies between the electrodes in height.

The tool of the film prints its top, that of the electrode below prints its bottom: by how much the heights of two tools
differ, the film is thicker or thinner, whatever number of layers it has. What stands on the film moves with it. The
nozzle's height decides, not the volume: a nozzle too low presses what has no room aside, one too high leaves it round.
"""

from dataclasses import replace

from sensorgen.scene.scene import Piece, Point, Prism, Scene, rounded


def span_mm(scene: Scene) -> Point | None:
    """From the top of the bottom electrode to the lowest point of the top one [mm]; None where there is no such film.

    Examples
    --------
    >>> from sensorgen.scene.scene import Body, box
    >>> plates = [Body(end, "etpu", (box(0, 1, 0, 1, z, z + 0.3),), end) for end, z in (("bottom", 0.0), ("top", 0.5))]
    >>> span_mm(Scene(tuple(plates), (1.0, 1.0, 0.8)))
    (0.3, 0.5)
    """
    ends = {t: [p.span("z") for b in scene.bodies if b.terminal == t for p in b.pieces] for t in ("bottom", "top")}
    if not all(ends.values()):
        return None
    low, high = max(z for _, z in ends["bottom"]), min(z for z, _ in ends["top"])
    return (low, high) if low < high else None


def thicker(scene: Scene, more_mm: float) -> Scene | None:
    """The scene with a film thicker by a length, or thinner by a negative one [mm]; None where none would be left.

    Air of a layer that was lost counts as film, and is stretched with it.
    """
    span = span_mm(scene)
    if span is None or rounded(span[1] - span[0] + more_mm) <= 0:
        return None
    low, high = span
    factor = 1 + more_mm / (high - low)

    def moved(z: float) -> float:
        return rounded(z + more_mm if z >= high else low + (z - low) * factor if z > low else z)

    def changed(piece: Piece) -> Prism:
        if not isinstance(piece, Prism):
            raise TypeError("a print is made of prisms")
        if piece.axis == "z":
            return replace(piece, start_mm=moved(piece.start_mm), end_mm=moved(piece.end_mm))
        return replace(piece, outline=tuple((u, moved(v)) for u, v in piece.outline))

    bodies = tuple(replace(b, pieces=tuple(changed(p) for p in b.pieces)) for b in scene.bodies)
    return replace(scene, bodies=bodies, size_mm=(*scene.size_mm[:2], moved(scene.size_mm[2])))
