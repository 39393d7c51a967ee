"""Bodies of files as ``sensorgen import --list`` shows them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sensorgen.core.document import Column, Part, Table
from sensorgen.core.findings import Finding, listed
from sensorgen.workflows.importing.assigning import suggested
from sensorgen.workflows.importing.reading import Assembly

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class ListedBody:
    """A body of a file, as ``--list`` shows it."""

    name: Annotated[str, Column("body")]
    volume_mm3: Annotated[float, Column("volume", "mm3")]
    x_mm: Annotated[str, Column("x", "mm", right=True)]
    y_mm: Annotated[str, Column("y", "mm", right=True)]
    z_mm: Annotated[str, Column("z", "mm", right=True)]
    colour: Annotated[str, Column("colour")]
    faces: Annotated[str, Column("faces")]
    material: Annotated[str, Column("material")]


@dataclass(frozen=True)
class BodyListing:
    """Bodies of files, what was repaired or is wrong, and a map to start from.

    Attributes
    ----------
    source : str
        Names of the files.
    bodies : tuple of ListedBody
        All of them, with a suggested material; "?" where nothing suggests one.
    findings : tuple of Finding
        As of :class:`Assembly`.
    """

    source: str
    bodies: tuple[ListedBody, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, assembly: Assembly, folder: Path) -> "BodyListing":
        """The listing of an assembly, with materials that ship, are beside a folder, or the user's."""
        rows = []
        for body in assembly.bodies:
            x, y, z = (f"{low:g} to {high:g}" for low, high in (body.box_mm.round(6) + 0.0).T.tolist())
            chord = body.given.chord_mm
            faces = f"curved, met to {chord:g} mm" if chord else "flat"
            material = suggested(body.name, body.given.colour, folder) or "?"
            rows.append(ListedBody(body.name, body.volume_mm3(), x, y, z, body.given.colour, faces, material))
        return cls(assembly.source, tuple(rows), assembly.findings)

    def document(self) -> Iterator[Part]:
        """All of it."""
        yield Table.of("bodies", "", self.bodies)
        if self.findings:
            yield ""
            yield from listed(self.findings)
        yield ""
        yield f"To import it: {self.words()}"

    def words(self) -> str:
        """Words to type to import it."""
        maps = " ".join(f"--map {body.name}={body.material.replace('?', 'MATERIAL')}" for body in self.bodies)
        return f"sensorgen import {self.source} {maps}"
