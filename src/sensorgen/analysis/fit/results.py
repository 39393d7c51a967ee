"""What a fit gives: values with their uncertainty, what the data do not determine, and errors before and after."""

from dataclasses import dataclass

LEVEL = 0.95  # of the intervals


@dataclass(frozen=True)
class Fitted:
    """A value.

    Attributes
    ----------
    material, quantity : str
        As material files call them.
    value, low, high : float
        In the unit of the quantity's name; the interval holds scatter and what the model leaves open.
    note : str
        What it rests on.
    """

    material: str
    quantity: str
    value: float
    low: float
    high: float
    note: str


@dataclass(frozen=True)
class Untold:
    """A parameter that the data do not determine, and why."""

    parameter: str
    why: str


@dataclass(frozen=True)
class Error:
    """Root mean square of ln(measured / predicted) on specimens that the fit did not see.

    Attributes
    ----------
    observable : str
        What was predicted.
    count : int
        Readings.
    before, after : float
        With the values of the sources, and with the fitted ones [-].
    """

    observable: str
    count: int
    before: float
    after: float


@dataclass(frozen=True)
class Fit:
    """A fit.

    Attributes
    ----------
    iteration, seed : int
        What was fitted, and how the specimens were split.
    values : tuple of Fitted
        From all specimens but those held back.
    untold : tuple of Untold
        What stays open.
    errors : tuple of Error
        On those held back.
    specimens : int
        Fitted to.
    held_back : tuple of str
        Names.
    left_out : tuple of (str, str)
        What could not be used, and why.
    log : str
        SHA-256 of what was fitted to: names, readings and raw files.
    """

    iteration: int
    seed: int
    values: tuple[Fitted, ...]
    untold: tuple[Untold, ...]
    errors: tuple[Error, ...]
    specimens: int
    held_back: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]
    log: str

    @property
    def source(self) -> str:
        """Name of the source that it makes."""
        return f"fit-{self.iteration}"
