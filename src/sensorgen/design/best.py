"""The best printable designs that are known of a shape, as ``sensorgen optimise`` found them."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from sensorgen.core import yamlfile
from sensorgen.core.records import Strict, checked


class KnownDesign(Strict):
    """A good design of a shape, of the default materials and printer.

    Attributes
    ----------
    about, numbers : str
        What it is best at, and its numbers as printed, with their source.
    seconds : float
        Processor time that its prediction takes [s].
    quality, parameters
        As in a design file; other parameters are as they are.
    """

    about: str
    numbers: str
    seconds: float
    quality: str
    parameters: dict[str, float]

    def changes(self) -> Iterator[tuple[tuple[str, ...], float | str]]:
        """Keys of a design file with their values."""
        yield ("quality",), self.quality
        yield from ((("parameters", name), value) for name, value in self.parameters.items())

    def data(self) -> dict[str, Any]:
        """Keys of a design file, but for the shape."""
        return {"quality": self.quality, "parameters": dict(self.parameters)}


@cache
def of(shape: str) -> tuple[KnownDesign, ...]:
    """Those of a shape; empty where none is known."""
    file = Path(__file__).with_name("best.yaml")
    return tuple(checked(KnownDesign, one) for one in yamlfile.read(file).get(shape, ()))
