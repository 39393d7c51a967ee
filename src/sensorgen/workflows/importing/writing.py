"""The design of imported bodies, and the file that holds them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sensorgen.core import files
from sensorgen.core.arrays import Real
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding, listed
from sensorgen.design import design as designs
from sensorgen.design import imported
from sensorgen.prediction.bodies import drawn as drawn_body
from sensorgen.scene.geometry.meshes import Mesh
from sensorgen.scene.scene import Piece
from sensorgen.workflows.importing.assigning import Assigned
from sensorgen.workflows.importing.reading import Assembly, ReadBody


@dataclass(frozen=True)
class Imported:
    """A sensor that was imported.

    Attributes
    ----------
    design : str
        Name of the design file.
    geometry : str
        Name of the file of its bodies.
    size_mm : (float, float, float)
        Edges of the box around it.
    moved_mm : (float, float, float)
        What its coordinates were moved by, so that its corner is the origin.
    bodies : mapping of str to str
        Of each body, material, terminal, tool and pieces, in words.
    findings : tuple of Finding
        Electrodes that touch, and what was put right.
    models : mapping of str to str
        Of each model of capacitance, "" where it applies to the sensor as drawn, or why not.
    """

    design: str
    geometry: str
    size_mm: tuple[float, float, float]
    moved_mm: tuple[float, float, float]
    bodies: Mapping[str, str]
    findings: tuple[Finding, ...] = ()
    models: Mapping[str, str] = field(default_factory=dict)

    @property
    def errors(self) -> list[Finding]:
        """Findings with which it cannot be a sensor."""
        return [finding for finding in self.findings if finding.severity == "error"]

    def document(self) -> Iterator[Part]:
        """Files written, and what applies to them."""
        size = " x ".join(f"{edge:g}" for edge in self.size_mm)
        moved = ", ".join(f"{way:g}" for way in self.moved_mm)
        able = [name for name, reason in self.models.items() if not reason]
        reasons: dict[str, list[str]] = {}
        for name, reason in self.models.items():
            reasons.setdefault(reason, []).append(name)
        why = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items())
        as_drawn = ", ".join(able) or f"no model applies, only as printed ({why})"
        rows = [
            ("size", f"{size} mm" + (f"; moved by {moved} mm, its corner to 0, 0, 0" if any(self.moved_mm) else "")),
            *self.bodies.items(),
            ("capacitance as drawn", as_drawn),
            ("written", f"{self.design} and {self.geometry}"),
            (
                "next",
                "correct what is found below, then import again with --force"
                if self.errors
                else f"sensorgen check {self.design}",
            ),
        ]
        yield Facts(tuple(rows))
        if self.findings:
            yield ""
            yield from listed(self.findings)


def write(
    assembly: Assembly,
    assigned: Assigned,
    *,
    name: str,
    folder: Path,
    more: Mapping[str, Any],
    replace_existing: bool = False,
) -> Imported:
    """Write the design of bodies and the file that holds them, both or neither.

    Parameters
    ----------
    assembly : Assembly
        Bodies without errors.
    assigned : Assigned
        As of :func:`assign`.
    name : str
        Of the design.
    folder : Path
        Where to.
    more : mapping
        Other keys of the design file, as printer and quality.
    replace_existing : bool
        Whether a design of that name may be there.

    Raises
    ------
    SensorgenError
        The design is refused, or a file cannot be written.
    """
    from sensorgen.models import capacitance_models

    bodies, low = _placed(assembly)
    content = imported.text(bodies)
    data = {
        "name": name, "shape": imported.SHAPE, **more,
        "bodies": {n: assigned.filled[n].model_dump(exclude_defaults=True) for n in bodies.pieces},
        "tools": dict(assigned.tools),
    }  # fmt: skip
    path, beside = folder / f"{name}.yaml", folder / imported.file_name(name, content)
    design = designs.make({**data, "geometry": imported.packed(content)}, str(path))
    if path.exists() and not replace_existing:
        raise BadInput(f"{path} exists; expected --force to replace it, or another --name")
    head = f"# imported from {assembly.source}; bodies are changed in CAD, then: sensorgen import\n"
    text = head + yaml.safe_dump({**data, "geometry": beside.name}, sort_keys=False, allow_unicode=True)
    old, drawn = _bodies_of(path), drawn_body(design).cells.first()
    files.replace(beside, content.encode())
    files.replace(path, text.encode())
    if old and old != beside:
        _remove_unused(old)
    return Imported(
        str(path), str(beside), bodies.size_mm, tuple((-low.round(9) + 0.0).tolist()),
        {n: _words(design, n, own) for n, own in bodies.pieces.items()},
        (*assigned.shorts, *(f for f in assembly.findings if f.severity != "error")),
        {key: model.why_not_applicable(drawn) or "" for key, model in capacitance_models().items()},
    )  # fmt: skip


def _placed(assembly: Assembly) -> tuple[imported.Bodies, Real]:
    """Bodies with the sensor's corner at 0, and where that corner was [mm]."""
    boxes = np.array([body.box_mm for body in assembly.bodies])
    low, high = boxes[:, 0].min(0), boxes[:, 1].max(0)
    by_height = sorted(assembly.bodies, key=lambda body: body.box_mm[::-1, 2].tolist())
    pieces = {body.name: _exact(body, low, high) or _flat(body, low) for body in by_height}
    length, width, height = (high - low).round(9).tolist()
    chord = max(body.given.chord_mm for body in assembly.bodies)
    return imported.Bodies(pieces, (length, width, height), chord, assembly.source), low


def _remove_unused(old: Path) -> None:
    """Remove a file of bodies that no design beside it names any more."""
    if not any(old.name in other.read_text("utf-8", "replace") for other in old.parent.glob("*.yaml")):
        old.unlink(missing_ok=True)


def _bodies_of(path: Path) -> Path | None:
    """The file of bodies that a design names which is there, and that an import of its name wrote; None for others."""
    try:
        named = yaml.safe_load(path.read_text("utf-8"))["geometry"]
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError):
        return None
    own = isinstance(named, str) and re.fullmatch(re.escape(path.stem) + imported.HASHED, named)
    return path.parent / named if own else None


def _exact(body: ReadBody, low: Real, high: Real) -> tuple[Piece, ...]:
    """A body of revolution in the sensor's coordinates; empty where it is none, or wider than the sensor's box."""
    revolved = body.given.revolved
    if revolved is None:
        return ()
    spans = np.array([revolved.span(axis) for axis in "xyz"])
    if (spans[:, 0] < low - 1e-9).any() or (spans[:, 1] > high + 1e-9).any():
        return ()
    x, y, z = low.tolist()
    outline = tuple((r, round(height - z, 9)) for r, height in revolved.outline)
    return (replace(revolved, x_mm=round(revolved.x_mm - x, 9), y_mm=round(revolved.y_mm - y, 9), outline=outline),)


def _flat(body: ReadBody, low: Real) -> tuple[Piece, ...]:
    """A body as prisms or polyhedra in the sensor's coordinates."""
    from sensorgen.scene.geometry.surfaces import pieces

    return pieces([Mesh(shell.vertices_mm - low, shell.triangles) for shell in body.shells], body.given.rounding_mm)


def _words(design: designs.Design, name: str, own: Sequence[Any]) -> str:
    kinds = [type(piece).__name__.lower() for piece in own]
    shapes = ", ".join(
        f"{kinds.count(kind)} {kind}{'s' if kinds.count(kind) > 1 else ''}" for kind in dict.fromkeys(kinds)
    )
    one = design.bodies[name]
    material = one.material.partition("@")[0]
    end = f", {one.terminal} electrode" if one.terminal else ""
    return f"{one.material} on tool {design.tool(material)}{end}: {shapes}"
