"""Readings of an iteration, in little memory: numbers side by side, and words once for all readings that share them."""

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from sensorgen.core.lazy import Lazy
from sensorgen.measure.log import Reading


class Words(NamedTuple):
    """Texts that many readings share; attributes as of :class:`sensorgen.measure.log.Reading`."""

    specimen: str
    shape: str
    film_mm: float | None
    axes: str
    baked: bool | None
    batch: str
    defects: str
    instrument: str
    wires: int | None
    remark: str
    doubts: tuple[str, ...]
    source: str


class Measured(NamedTuple):
    """A reading.

    Attributes
    ----------
    number : int
        In the log.
    y_ohm, z_ohm : tuple of float
        Along an electrode and between the electrodes, as logged [ohm].
    words : Words
        Specimen, remark and the like.
    """

    number: int
    y_ohm: tuple[float, ...]
    z_ohm: tuple[float, ...]
    words: Words

    @property
    def specimen(self) -> str:
        """Name of the specimen."""
        return self.words.specimen

    @property
    def shape(self) -> str:
        """Name of the shape."""
        return self.words.shape


@dataclass(frozen=True, eq=False)
class IterationReadings:
    """All readings of an iteration.

    Attributes
    ----------
    rows : Lazy of Measured
        In the order of the log.
    alternating : tuple of Reading
        Those with AC quantities.
    designs : frozenset of (str, str)
        Names and identities of designs that the log has for them.
    """

    rows: Lazy[Measured]
    alternating: tuple[Reading, ...]
    designs: frozenset[tuple[str, str]]


def readings(logged: Iterable[Reading]) -> IterationReadings:
    """Readings one after the other, of which none is kept as it comes."""
    numbers, ends = array("q"), array("q", [0])
    ohms, along, kinds = array("d"), array("q"), array("q")
    known: dict[Words, int] = {}
    designs, alternating = set(), []
    for one in logged:
        words = Words(
            one.specimen, one.shape, one.film_mm, one.axes, one.baked, one.batch, ", ".join(one.defects),
            one.instrument, one.wires, one.remark, one.doubts, one.source,
        )  # fmt: skip
        if one.quantity:
            alternating.append(one)
        kinds.append(known.setdefault(words, len(known)))
        numbers.append(one.number)
        ohms.extend((*one.y_ohm, *one.z_ohm))
        along.append(len(one.y_ohm))
        ends.append(len(ohms))
        designs.add((one.design, one.design_id))
    listed = list(known)

    def made(k: int) -> Measured:
        begin, end = ends[k], ends[k + 1]
        split = begin + along[k]
        return Measured(numbers[k], tuple(ohms[begin:split]), tuple(ohms[split:end]), listed[kinds[k]])

    return IterationReadings(Lazy(made, range(len(numbers))), tuple(alternating), frozenset(designs))
