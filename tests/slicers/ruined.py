"""Prints ruined on purpose, by kind, in the file of any slicer; and edits that ruin nothing.

An edit knows of each line of the file what it prints (place, tool, layer, body), so that it works for all slicers. What
is changed is where material lies, how much of it, which, and when; and the nozzle, heat and time.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from sensorgen.asprinted import agreement
from sensorgen.asprinted.beads import beads, pieces
from sensorgen.core.errors import BadInput
from sensorgen.export.gcode.check import check_motion
from sensorgen.export.gcode.motion import executed

FILAMENT_MM2 = math.pi / 4 * 1.75**2


class Print:
    """A good file: its lines, and for each what it prints of the design."""

    def __init__(self, design, text):
        self.design, self.lines = design, text.decode().splitlines()
        self.motion = executed(text, design.machine)
        (piece,) = pieces(design, self.motion)
        self.beads = beads(design, piece.paths, piece.centre_mm)
        self.corner = np.array(piece.bed_mm) - np.array(design.printed.size_mm[:2]) / 2
        self.conductor, self.film = (design.tool(name) for name in ("etpu", "x60"))

    @cached_property
    def layers(self):
        """Layers of each tool in which it prints."""
        return {
            tool: sorted(set(self.beads.layer[self.beads.tool == tool].tolist()))
            for tool in (self.conductor, self.film)
        }

    @cached_property
    def film_layers(self):
        """Layers that the film's tool fills alone."""
        return [k for k in self.layers[self.film] if k not in self.layers[self.conductor]]

    @cached_property
    def cog_layers(self):
        """Layers in which both tools print."""
        return [k for k in self.layers[self.film] if k in self.layers[self.conductor]]

    def rows(self, layer=None, tool=None, box=None):
        """Numbers of lines of the piece, from 0 in ``lines``; ``box`` is x0, y0, x1, y1 from its corner, of middles."""
        b, keep = self.beads, np.ones(len(self.beads.number), bool)
        if layer is not None:
            keep &= np.isin(b.layer, layer)
        if tool is not None:
            keep &= b.tool == tool
        if box is not None:
            middle = (b.start_mm + b.end_mm) / 2
            keep &= ((middle >= box[:2]) & (middle <= box[2:])).all(1)
        return sorted(set((b.number[keep] - 1).tolist()))

    def cut(self, layer, box, factor):
        """Lines of a layer with the extrusion inside a box scaled: crossing lines are parted at its sides."""
        b, new = self.beads, list(self.lines)
        for k in np.flatnonzero(np.isin(b.layer, layer)).tolist():
            low, high = _inside(b.start_mm[k], b.end_mm[k], np.array(box))
            if high <= low:
                continue
            way, full = b.end_mm[k] - b.start_mm[k], b.volume_mm3[k] / FILAMENT_MM2
            old, made = self.lines[b.number[k] - 1], []
            feed = re.search(r"F[0-9.]+", old)
            for a, c, share in ((0.0, low, 1.0), (low, high, factor), (high, 1.0, 1.0)):
                if c - a > 1e-6:
                    x, y = b.start_mm[k] + c * way + self.corner
                    made.append(f"G1 X{x:.4f} Y{y:.4f} E{full * (c - a) * share:.5f} {feed[0] if feed else ''}".strip())
            new[b.number[k] - 1] = "\n".join(made)
        assert new != self.lines
        return new

    def stroke(self, layer, tool, start, end, share=1.0, nth=0):
        """Lines with one more line, from the piece's corner, as wide as the printer's, after a line of a layer."""
        at = self.rows(layer, tool)[nth]
        height = self.beads.height_mm[self.beads.layer == layer][0]
        e = math.dist(start, end) * self.design.machine.line_mm() * height / FILAMENT_MM2 * share
        (a, b), (c, d) = (np.array(place) + self.corner for place in (start, end))
        x, y = self.motion.end_mm[self.motion.number == at + 1][-1][:2]
        feed = self.motion.feed_mm_min[self.motion.number == at + 1][-1]
        new = [f"G1 X{a:.3f} Y{b:.3f} F7200", f"G1 X{c:.3f} Y{d:.3f} E{e:.5f} F1200", f"G1 X{x:.3f} Y{y:.3f} F{feed:g}"]
        return [*self.lines[: at + 1], *new, *self.lines[at + 1 :]]

    def amid(self, *new, layer=None, tool=None):
        """Lines with others after a line in the middle of a layer."""
        rows = self.rows(layer, tool)
        at = rows[len(rows) // 2] + 1
        return [*self.lines[:at], *new, *self.lines[at:]]

    def each(self, rows, change):
        """Lines with some of them changed, or left out."""
        rows = set(rows)
        new = [change(line) if k in rows else line for k, line in enumerate(self.lines)]
        new = [line for line in new if line is not None]
        return new if new != self.lines else None

    def sub(self, pattern, by, count=0):
        """Lines with a pattern replaced, which must be there."""
        text, changes = re.subn(pattern, by, "\n".join(self.lines), count=count, flags=re.MULTILINE)
        assert changes, pattern
        return text.split("\n")


def _inside(start, end, box):
    """Shares of a line, from and to, inside a box."""
    low, high = 0.0, 1.0
    for axis in (0, 1):
        way = end[axis] - start[axis]
        if abs(way) < 1e-9:
            if not box[axis] < start[axis] < box[axis + 2]:
                return 1.0, 0.0
            continue
        a, b = sorted(((box[axis] - start[axis]) / way, (box[axis + 2] - start[axis]) / way))
        low, high = max(low, a), min(high, b)
    return low, high


def scaled_e(factor):
    """Change of a line: its E times a factor."""
    return lambda line: re.sub(r"E(-?[0-9.]+)", lambda m: f"E{float(m[1]) * factor:.6f}", line)


def moved(x, y=0.0):
    """Change of a line: its places shifted."""

    def change(line):
        for letter, by in (("X", x), ("Y", y)):
            line = re.sub(rf"{letter}(-?[0-9.]+)", lambda m, n=letter, b=by: f"{n}{float(m[1]) + b:.4f}", line)
        return line

    return change


def dry(line):
    """A line moved without extrusion."""
    return re.sub(r"\s*E-?[0-9.]+", "", line)


def middle(p, wide, deep=None):
    """A box about the middle of the piece."""
    x, y = np.array(p.design.printed.size_mm[:2]) / 2
    return x - wide / 2, y - (deep or wide) / 2, x + wide / 2, y + (deep or wide) / 2


def longest(p, layer, tool):
    """The longest line of a tool in a layer that is no edge, as the row of the file."""
    b, size = p.beads, np.array(p.design.printed.size_mm[:2])
    centre = (b.start_mm + b.end_mm) / 2
    inner = (b.layer == layer) & (b.tool == tool) & ((centre > 1) & (centre < size - 1)).all(1)
    length = np.hypot(*(b.end_mm - b.start_mm).T) * inner
    return int(b.number[length.argmax()]) - 1


def repeated(p, rows):
    """Some lines printed a second time, where each is printed."""
    rows, new = set(rows), []
    for k, line in enumerate(p.lines):
        new.append(line)
        if k in rows:
            own = p.motion.number == k + 1
            x, y = p.motion.start_mm[own][0][:2]
            feed = p.motion.feed_mm_min[own][0]
            new += [f"G1 X{x:.4f} Y{y:.4f} F7200", re.sub(r"\s*F[0-9.]+", "", line) + f" F{feed:g}"]
    return new


def swapped_layers(p, one, other):
    """Places and extrusion of a tool's lines in one layer replaced by those of another layer."""
    tool = p.film
    rows, source = p.rows(one, tool), p.rows(other, tool)
    take = {row: p.lines[source[k % len(source)]] for k, row in enumerate(rows)}
    return [take.get(k, line) for k, line in enumerate(p.lines)]


def drags(p, count, layer):
    """Travels over the film in contact, after a line of the conductor."""
    rows = {k: (p.rows(k, p.conductor), p.rows(k, p.film)) for k in p.cog_layers}
    after = [k for k, (own, film) in rows.items() if own[-1] > film[-1]]  # the film is printed first
    if not after:
        return None
    at = rows[min(after, key=lambda k: abs(k - layer))][0][-5]
    width = p.design.printed.size_mm[1]
    x, y = p.motion.end_mm[p.motion.number == at + 1][-1][:2]
    x0, y0 = p.corner + 0.5
    new = [f"G1 X{x0 + k * 0.6:.3f} Y{y0 + (width - 1) * (k % 2):.3f} F7200" for k in range(2 * count)]
    feed = p.motion.feed_mm_min[p.motion.number == at + 1][-1]
    return [*p.lines[: at + 1], *new, f"G1 X{x:.3f} Y{y:.3f} F{feed:g}", *p.lines[at + 1 :]]


def still(p, sign):
    """Rows of the file that push filament without printing, or draw it back."""
    own = (np.sign(p.motion.filament_mm) == sign) & (p.motion.across_mm == 0)
    near = np.isin(p.motion.number, np.arange(p.beads.number.min(), p.beads.number.max()))
    return sorted(set((p.motion.number[own & near] - 1).tolist()))


@dataclass(frozen=True)
class Fault:
    """A fault: its kind, its name, and the lines of the file with it."""

    kind: str
    name: str
    edit: Callable


def film(p):
    """The last layer that the film's tool fills alone."""
    return p.film_layers[-1]


def cogs(p):
    """A layer of cogs, in the middle."""
    return p.cog_layers[len(p.cog_layers) // 2]


def plate(p):
    """The second layer."""
    return p.layers[p.conductor][1]


def top(p):
    """The last layer."""
    return p.layers[p.conductor][-1]


def faults():
    """Every fault that a file of both tools can have."""
    f = Fault
    where = [
        f("missing", "hole of 4 mm2 in one film layer", lambda p: p.cut(film(p), middle(p, 2.0), 0.0)),
        f("missing", "hole of 14 mm2 through the film", lambda p: p.cut(p.film_layers, middle(p, 3.75), 0.0)),
        f("missing", "hole of 2 mm2 through the film", lambda p: p.cut(p.film_layers, middle(p, 1.4), 0.0)),
        f("missing", "hole of 4 mm2 in the bottom plate", lambda p: p.cut(plate(p), middle(p, 2.0), 0.0)),
        f("missing", "hole of 4 mm2 in the top layer", lambda p: p.cut(top(p), middle(p, 2.0), 0.0)),
        f("missing", "a slit of 0.5 x 6 mm in the film", lambda p: p.cut(p.film_layers, middle(p, 0.5, 6.0), 0.0)),
        f("missing", "one line of the film", lambda p: p.each([longest(p, film(p), p.film)], dry)),
        f("missing", "one line of the bottom plate", lambda p: p.each([longest(p, plate(p), p.conductor)], dry)),
        f("missing", "every tenth line of the film", lambda p: p.each(p.rows(film(p))[::10], dry)),
        f("missing", "3 mm of every cog", lambda p: p.cut(cogs(p), middle(p, 200.0, 3.0), 0.0)),
        f("missing", "one cog", lambda p: p.each(p.rows(cogs(p), p.conductor, middle(p, 2.0, 20)), dry)),
        f("missing", "all cogs of a layer", lambda p: p.each(p.rows(cogs(p), p.conductor), dry)),
        f("missing", "film material between the cogs", lambda p: p.each(p.rows(cogs(p), p.film), dry)),
        f("missing", "2 mm at the end", lambda p: p.cut(film(p), (0, -1, 2, 99), 0.0)),
        f("missing", "a whole film layer", lambda p: p.each(p.rows(film(p)), dry)),
        f("missing", "the layer's last third", lambda p: p.each(p.rows(film(p))[-len(p.rows(film(p))) // 3 :], dry)),
    ]
    much = [
        f("amount", "cog layer of both tools twice", lambda p: repeated(p, p.rows(cogs(p)))),
        f("amount", "cogs twice", lambda p: repeated(p, p.rows(cogs(p), p.conductor))),
        f("amount", "film layer twice", lambda p: repeated(p, p.rows(film(p)))),
        f("amount", "one long line twice", lambda p: repeated(p, [longest(p, film(p), p.film)])),
        f("amount", "a patch of 3 mm twice", lambda p: p.cut(film(p), middle(p, 3.0), 2.0)),
        f("amount", "a patch of 3 mm with half", lambda p: p.cut(film(p), middle(p, 3.0), 0.5)),
        f("amount", "film of a cog layer x 1.6", lambda p: p.each(p.rows(cogs(p), p.film), scaled_e(1.6))),
        f("amount", "cogs x 0.65", lambda p: p.each(p.rows(cogs(p), p.conductor), scaled_e(0.65))),
        f("amount", "cogs of all layers x 0.65", lambda p: p.each(p.rows(p.cog_layers, p.conductor), scaled_e(0.65))),
        f("amount", "film layer x 1.2", lambda p: p.each(p.rows(film(p)), scaled_e(1.2))),
        f("amount", "film layer x 0.85", lambda p: p.each(p.rows(film(p)), scaled_e(0.85))),
        f("amount", "everything x 1.2", lambda p: p.each(p.rows(), scaled_e(1.2))),
        f("amount", "everything x 0.85", lambda p: p.each(p.rows(), scaled_e(0.85))),
        f("amount", "plate x 1.5", lambda p: p.each(p.rows(plate(p)), scaled_e(1.5))),
        f("amount", "one line x 5", lambda p: p.each([longest(p, film(p), p.film)], scaled_e(5.0))),
    ]
    what = [
        f("material", "a line of conductor over the film", lambda p: p.stroke(cogs(p), p.conductor, *_across(p))),
        f("material", "a line of conductor in the first cog layer",
            lambda p: p.stroke(p.cog_layers[0], p.conductor, *_across(p))),
        f("material", "3 mm of conductor on the last film layer", lambda p: _swap_tool(p, film(p), 3.0)),
        f("material", "a film layer of conductor", lambda p: _swap_tool(p, film(p), 1e9)),
        f("material", "a line of film over the top plate", lambda p: p.stroke(top(p), p.conductor, *_across(p))),
        f("material", "tools swapped", lambda p: [
            re.sub(r"^(T|M116 P|M568 P)([34])", lambda m: m[1] + {"3": "4", "4": "3"}[m[2]], line) for line in p.lines
        ]),
    ]  # fmt: skip
    place = [
        f("place", "film moved by 0.4 mm", lambda p: p.each(_all(p, p.film), moved(0.4))),
        f("place", "one cog layer moved by 0.5 mm", lambda p: p.each(_all(p, p.conductor, cogs(p)), moved(0.5))),
        f("place", "a layer moved by 1 mm", lambda p: p.each(_all(p, None, film(p)), moved(1.0))),
        f("place", "a layer moved by 0.5 mm across", lambda p: p.each(_all(p, None, film(p)), moved(0.0, 0.5))),
        f(
            "place",
            "one long line moved by a line width",
            lambda p: p.each([longest(p, film(p), p.film)], moved(0.5, 0.5)),
        ),
        f("place", "a cog layer as the film", lambda p: swapped_layers(p, cogs(p), film(p))),
        f("place", "lines beyond the edge", lambda p: p.stroke(film(p), p.film, *_beyond(p))),
        f("place", "a line in air beside it", lambda p: p.stroke(film(p), p.film, (-9.0, 1.0), (-2.5, 1.0))),
        f("place", "a layer 0.05 mm too high", lambda p: _raised(p, film(p), 0.05)),
        f("place", "a layer after the one above it", lambda p: _raised(p, film(p), 0.1)),
    ]
    return [*where, *much, *what, *place, *_nozzle(), *_machine()]


def _nozzle():
    f = partial(Fault, "nozzle")
    return [
        f("all retractions removed, primes kept", lambda p: p.each(still(p, -1), lambda _: None)),
        f("all primes removed", lambda p: p.each(still(p, 1), lambda _: None)),
        f("no retraction and no prime", lambda p: p.each([*still(p, 1), *still(p, -1)], lambda _: None)),
        f("one prime removed", lambda p: p.each(_near(p, 1)[:1], lambda _: None)),
        f("one retraction removed", lambda p: p.each(_near(p, -1)[:1], lambda _: None)),
        f("retraction of 0.2 mm", lambda p: p.each(still(p, -1), lambda line: re.sub(r"E-4.7", "E-0.2", line))),
        f("retraction of 9.5 mm", lambda p: p.each(still(p, -1), lambda line: re.sub(r"E-4.7", "E-9.5", line))),
        f("prime of 5.4 mm", lambda p: p.each(still(p, 1), lambda line: re.sub(r"E4.7", "E5.4", line))),
        f("prime of 5.1 mm", lambda p: p.each(still(p, 1), lambda line: re.sub(r"E4.7", "E5.1", line))),
        f("prime of 3.5 mm", lambda p: p.each(still(p, 1), lambda line: re.sub(r"E4.7", "E3.5", line))),
        f("retraction and prime of 0.2 mm", lambda p: p.sub(r"E(-?)4\.7\b", r"E\g<1>0.2")),
        f("retraction and prime of 12 mm", lambda p: p.sub(r"E(-?)4\.7\b", r"E\g<1>12")),
        f("a blob of 3 mm of filament", lambda p: p.amid("G1 E3 F600", layer=film(p))),
        f("3 mm of filament drawn back and left", lambda p: p.amid("G1 E-3 F600", layer=film(p))),
        f("G10 without G11", lambda p: p.amid("G10", layer=film(p))),
        f("20 drags over the film", lambda p: drags(p, 20, cogs(p))),
        f("dwell of 600 s", lambda p: p.amid("G4 S600", layer=film(p))),
        f("dwell of 90 s", lambda p: p.amid("G4 P90000", layer=film(p))),
        f("dwell of 10 s on the part", lambda p: p.amid("G4 S10", layer=film(p))),
        f("twenty dwells of 4 s", lambda p: p.amid(*["G4 S4"] * 20, layer=film(p))),
        f("a line at 1 mm/min", lambda p: p.each([longest(p, film(p), p.film)],
            lambda line: re.sub(r"\s*F[0-9.]+", "", line) + " F1")),
        f("a pause", lambda p: p.amid("M25", layer=film(p))),
        f("a pause by M226", lambda p: p.amid("M226", layer=film(p))),
        f("first layer at 60 mm/s", lambda p: p.sub(r"F1200\b", "F3600", 40)),
        f("all at 80 mm/s", lambda p: p.sub(r"F1200\b", "F8000")),
        f("lines of a layer at 200 mm/s", lambda p: p.each(p.rows(film(p)),
            lambda line: re.sub(r"\s*F[0-9.]+", "", line) + " F12000")),
        f("no purge", lambda p: p.each(_waste(p), dry)),
        f("no purge of one change", lambda p: p.each(_waste(p, 2), dry)),
    ]  # fmt: skip


def _machine():
    f = partial(Fault, "machine")
    return [
        f("fan never on", lambda p: p.sub(r"^M106 P3 S255", "M106 P3 S0")),
        f("fan at 10 %", lambda p: p.sub(r"^M106 P3 S255", "M106 P3 S25")),
        f("fan left out", lambda p: p.sub(r"^M106 P3 S255\n", "")),
        f("fan off from the middle", lambda p: p.amid("M107", layer=film(p))),
        f("standby at 0 C", lambda p: p.sub(r" R180", " R0")),
        f("standby at 230 C", lambda p: p.sub(r" R180", " R230")),
        f("standby at 100 C", lambda p: p.sub(r" R180", " R100")),
        f("no wait for a tool", lambda p: p.sub(r"^M116 P4\n", "")),
        f("a wait for the wrong tool", lambda p: p.sub(r"^M116 P4", "M116 P3")),
        f("one wait for the wrong tool", lambda p: p.sub(r"^(T4\n)M116 P4", r"\1M116 P3", 1)),
        f("conductor at 180 C", lambda p: p.sub(r"^(G10 P3 S)210", r"\g<1>180")),
        f("film material 20 C too hot from the middle", lambda p: p.amid("G10 P4 S275", layer=film(p))),
        f("bed off from the middle", lambda p: p.amid("M140 S0", layer=film(p))),
        f("an object cancelled", lambda p: p.amid("M486 P0", layer=film(p))),
        f("the current object cancelled", lambda p: p.amid("M486 C", layer=film(p))),
        f(
            "Z not stated after changes",
            lambda p: p.sub(r"^((?:M568 P\d A2\n)?T\d\n(?:.*\n){1,14}?)(.*?) ?Z[0-9.]+", r"\1\2"),
        ),
        f("no homing", lambda p: p.sub(r"^G28\nG32\n", "G32\n")),
        f("probing before homing", lambda p: p.sub(r"^G28\nG32\n", "G32\nG28\n")),
        f("flow of 80 %", lambda p: p.amid("M221 S80", layer=film(p))),
        f("speed of 300 %", lambda p: p.amid("M220 S300", layer=film(p))),
        f("pressure advance of 2 s", lambda p: p.amid("M572 D0 S2", layer=film(p))),
        f("another tool's offset", lambda p: p.amid("G10 P4 X0.5", layer=film(p))),
    ]


def _across(p):
    """A line of 6 mm in the middle of the piece."""
    x, y = np.array(p.design.printed.size_mm[:2]) / 2
    return (x - 2.75, y), (x + 3.25, y)


def _beyond(p):
    length, width, _ = p.design.printed.size_mm
    return (length / 2, width + 0.3), (length / 2 + 5, width + 0.3)


def _all(p, tool, layer=None):
    """Rows of all moves with places in the piece, of a tool and layer."""
    rows = p.rows(layer, tool)
    part = range(rows[0] - 1, rows[-1] + 1)
    size = np.array(p.design.printed.size_mm[:2])
    near = ((p.motion.end_mm[:, :2] > p.corner - 1) & (p.motion.end_mm[:, :2] < p.corner + size + 1)).all(1)
    if tool is not None:
        near &= p.motion.tools.column(len(p.motion.rows)) == tool
    return sorted(set((p.motion.number[near] - 1).tolist()) & set(part))


def _near(p, sign):
    """Rows of primes or retractions between lines of the piece."""
    printed = set(p.rows())
    first, last = min(printed), max(printed)
    rows = [row for row in still(p, sign) if first < row < last]
    return rows[len(rows) // 2 :]


def _waste(p, nth=None):
    """Rows of lines beside the piece after its first layer, of one change of tool or of all."""
    far = (p.motion.extruded_mm > 0) & (p.motion.across_mm > 0) & ~np.isin(p.motion.number, p.beads.number)
    changes = [change.row for change in p.motion.changes] + [len(far)]
    if nth is not None:
        far[: changes[nth]], far[changes[nth + 1] :] = False, False
    return sorted(set((p.motion.number[far] - 1).tolist()))


def _swap_tool(p, layer, length):
    """Some length of a layer printed by the conductor's tool."""
    rows, total = [], 0.0
    b = p.beads
    for k in np.flatnonzero((b.layer == layer) & (b.tool == p.film)).tolist():
        if total < length:
            rows.append(int(b.number[k]) - 1)
            total += float(np.hypot(*(b.end_mm[k] - b.start_mm[k])))
    first, last = rows[0], rows[-1]
    z = p.motion.start_mm[p.motion.number == first + 1][0][2]
    before = [f"T{p.conductor}", f"M116 P{p.conductor}", f"G1 Z{z:g} F3000"]
    after = [f"T{p.film}", f"M116 P{p.film}", f"G1 Z{z:g} F3000", "G1 F1200"]
    return [*p.lines[:first], *before, "G1 F1200", *p.lines[first : last + 1], *after, *p.lines[last + 1 :]]


def _raised(p, layer, by):
    """Heights of a layer's lines changed."""
    rows = p.rows(layer)
    z = p.motion.start_mm[p.motion.number == rows[0] + 1][0][2]
    return [*p.lines[: rows[0]], f"G1 Z{z + by:g} F3000", *p.lines[rows[0] :]]


def _numbered(lines):
    def one(n, line):
        code = f"N{n} {line}"
        return f"{code}*{np.bitwise_xor.reduce(np.frombuffer(code.encode(), np.uint8))}"

    return [one(n, line) for n, line in enumerate(_bare(lines), 1)]


def _bare(lines):
    return [bare for line in lines if (bare := line.partition(";")[0].rstrip())]


def _whole(p, change):
    """All places of the print changed."""
    first = next(k for k, line in enumerate(p.lines) if line.startswith("M116"))
    return [change(line) if k > first and re.match(r"G[01] ", line) else line for k, line in enumerate(p.lines)]


HARMLESS = {
    "comments stripped": lambda p: _bare(p.lines),
    "G0 for travels": lambda p: [
        re.sub(r"^G1 ", "G0 ", line) if re.match(r"G1 .*[XYZ]", line) and "E" not in line.partition(";")[0] else line
        for line in p.lines
    ],
    "moved on the bed": lambda p: _whole(p, moved(-20.0, -15.0)),
    "flow of 0.95": lambda p: p.each(p.rows(), scaled_e(0.95)),
    "all E x 0.95": lambda p: [scaled_e(0.95)(line) if line.startswith("G1") else line for line in p.lines],
    "line numbers with checksums": lambda p: _numbered(p.lines),
    "lower case": lambda p: [line.lower() for line in _bare(p.lines)],
    "three decimals": lambda p: [
        re.sub(r"([XY]-?[0-9]+\.[0-9]{2})[0-9]+", r"\1", line) if line.startswith("G") else line for line in p.lines
    ],
    "feeds 10 % lower": lambda p: [
        re.sub(r"F([0-9.]+)", lambda m: f"F{float(m[1]) * 0.9:g}", line) if line.startswith("G1") else line
        for line in p.lines
    ],
    "blank lines and blanks": lambda p: [text for line in p.lines for text in (f"  {line}  ", "")],
    "messages and progress": lambda p: p.amid("M117 half way", "M73 P50 R3", "G4 P0", "M400"),
    "labels of objects": lambda p: p.amid("M486 S0", 'M486 A"sensor"', "M486 S-1"),
    "carriage returns": lambda p: [line + "\r" for line in p.lines],
}


def findings(design, lines):
    """Rules of the errors that a check against the design finds; "unreadable" if it refuses to read."""
    try:
        motion = executed("\n".join(lines).encode() + b"\n", design.machine)
        found = check_motion(motion, design.machine, {design.tool(n): n for n in design.used()}, others_empty=True)
        found = found.with_more(agreement.check_motion(design, motion))
    except BadInput as error:
        return {f"unreadable: {error}"}
    return {f.rule for f in found.errors()}
