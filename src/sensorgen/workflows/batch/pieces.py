"""The specimens of a plan: each with its name and its design, in the order in which the plate is filled."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.design.design import Design
from sensorgen.design.materials import Texts
from sensorgen.design.specimen_name import SpecimenName, named
from sensorgen.workflows.batch.plan import BatchPlan


@dataclass(frozen=True, eq=False)
class PrintPiece:
    """One specimen to be printed.

    Attributes
    ----------
    specimen : SpecimenName
        Its name.
    design : Design
        What it is; copies share one.
    design_id : str
        The design's hash, worked out once for all copies.
    """

    specimen: SpecimenName
    design: Design
    design_id: str

    @property
    def name(self) -> str:
        """The specimen's name."""
        return self.specimen.name


def pieces(plan: BatchPlan, folder: Path) -> tuple[PrintPiece, ...]:
    """All specimens of a plan, in its own order.

    Parameters
    ----------
    plan : BatchPlan
        Checked.
    folder : Path
        What the plan's design files are relative to.

    Raises
    ------
    BadInput
        Two specimens of one name, or designs that cannot be printed together.
    SensorgenError
        A design is unknown or wrong; the message names its place in the plan.
    """
    found: list[PrintPiece] = []
    for number, item in enumerate(plan.designs):
        try:
            design = plan.made(item, folder)
        except SensorgenError as error:
            raise error.within(f"designs.{number}") from None
        copies, key = range(item.first, item.first + item.replicates), design.id()
        found += [PrintPiece(named(design, plan.iteration, copy), design, key) for copy in copies]
    _refuse_twins(found)
    _refuse_strangers([piece.design for piece in found])
    return tuple(found)


def shuffled(found: Sequence[PrintPiece], seed: int) -> tuple[PrintPiece, ...]:
    r"""The specimens in the order in which the plate is filled.

    Parameters
    ----------
    found : sequence of PrintPiece
        In any order.
    seed : int
        Another seed, another order.

    Notes
    -----
    They are sorted by the SHA-256 of seed and name, ``"7\n26 triX .2mm 1 fine"`` in UTF-8: no generator of random
    numbers whose next version draws otherwise, and the order in the plan does not count.
    """
    return tuple(sorted(found, key=lambda piece: sha256(f"{seed}\n{piece.name}".encode()).digest()))


def _refuse_twins(found: Iterable[PrintPiece]) -> None:
    seen: dict[str, PrintPiece] = {}
    for piece in found:
        other = seen.setdefault(piece.name, piece)
        if other is not piece:
            raise BadInput(
                f"two specimens are called {piece.name!r}, of the designs {other.design.name} and {piece.design.name}: "
                "let the copies of one count on from another number, as in 'first: 6'"
            )


def _refuse_strangers(designs: Sequence[Design]) -> None:
    """One plate has one printer, one quality, one nozzle, and one spool on each tool."""
    first = designs[0]
    for design in designs[1:]:
        for word, one, other in (
            ("printer", first.machine.name, design.machine.name),
            ("quality", first.layers.name, design.layers.name),
            ("nozzle [mm]", f"{first.machine.nozzle_mm:g}", f"{design.machine.nozzle_mm:g}"),
        ):
            if one != other:
                key = word.partition(" ")[0]
                raise BadInput(
                    f"one plate, two of a kind: {word} {one} for {first.name} and {other} for {design.name}; "
                    f"give both the same {key}, or make two plans"
                )
    tools(designs)
    texts(designs)


def texts(designs: Iterable[Design]) -> Texts:
    """Material files of all designs.

    Raises
    ------
    BadInput
        Two of one name that differ.
    """
    found: dict[str, str] = {}
    for design in designs:
        for name, text in design.own.get("materials", {}).items():
            if found.setdefault(name, text) != text:
                raise BadInput(f"one plate, two materials {name}, from different files: give each a name of its own")
    return {"materials": found}


def tools(designs: Iterable[Design]) -> dict[int, str]:
    """Materials by the printer's own tool number.

    Raises
    ------
    BadInput
        Two materials on one tool, or one on two.
    """
    found: dict[int, str] = {}
    for design in designs:
        for material in design.used():
            tool = design.tool(material)
            clash = {t: m for t, m in found.items() if (t == tool) != (m == material)}
            if clash:
                other, loaded = clash.popitem()
                raise BadInput(
                    f"{design.name} wants {material} on tool {tool}, but {loaded} is on tool {other}: "
                    "one plate has one spool on each tool"
                )
            found[tool] = material
    return dict(sorted(found.items()))
