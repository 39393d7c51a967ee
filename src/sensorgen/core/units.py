"""Physical constants, and the one place where numbers with units that a user types are read."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from itertools import pairwise

from sensorgen.core.errors import BadInput

EPS0_F_PER_M = 8.8541878128e-12  # CODATA 2018, as in the reference values that we test against
M_PER_MM = 1e-3
MOST_VALUES = 100_000  # that one text may stand for

_TYPED = re.compile(r"\s*([-+]?[0-9.]+(?:e[-+]?[0-9]{1,3})?)\s*([a-zµμ]*)\s*", re.IGNORECASE)
_ROUNDING = Decimal("1e-9")  # of a step: how near the stop counts as on the grid, for steps such as 0.3333333333
_EXPECTED = "start:stop:step as in 0:6:0.1, or numbers with commas between them"
PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_PREFIXES = {6: "M", 3: "k", 0: ""}


@dataclass(frozen=True)
class Quantity:
    """Quantity that a number can be typed as.

    Attributes
    ----------
    name : str
        As in "is not a length".
    units : mapping of str to Decimal
        How many of the unit that a plain number means, the first one, each is.
    """

    name: str
    units: Mapping[str, Decimal]

    def read(self, text: str) -> float:
        """Read one number as typed, in the first unit unless it names another.

        Raises
        ------
        BadInput
            No number, no unit of this quantity, or a number that is not finite.
        """
        number, unit = self.typed(text)
        return self.float(number * self.factor(text, unit), text)

    def typed(self, text: str) -> tuple[Decimal, str]:
        """Number and unit, the latter "" where there is none."""
        match = _TYPED.fullmatch(text)
        try:
            if match:
                return Decimal(match[1]), match[2]
        except InvalidOperation:  # two points, or a point alone
            pass
        raise self._no(text, "; decimals take a point, as in 1.5" if "," in text else "")

    def factor(self, text: str, unit: str) -> Decimal:
        """Factor of the number; m and M are distinct wherever both have a meaning."""
        if not unit:
            return Decimal(1)
        if unit in self.units:
            return self.units[unit]
        near = [name for name in self.units if name.casefold() == unit.casefold()]
        if len(near) != 1:
            raise self._no(text, f"; {unit!r} may be {' or '.join(near)}: mind upper and lower case" if near else "")
        return self.units[near[0]]

    def float(self, number: Decimal, text: str) -> float:
        """The nearest floating-point number, if it is finite."""
        value = float(number)
        if not math.isfinite(value):
            raise self._no(text, "; it is too large")
        return value

    def _no(self, text: str, advice: str) -> BadInput:
        units = [name for name in self.units if name.isascii()]
        known = f", with {', '.join(units[:-1])} or {units[-1]} if you like" if units else " without a unit"
        return BadInput(f"{_short(text)} is not a {self.name}: write a number{known}{advice}")


def _table(**units: str) -> dict[str, Decimal]:
    return {name: Decimal(value) for name, value in units.items()}


LENGTH_MM = Quantity("length", _table(mm="1", um="1e-3", cm="10", m="1000") | {"µm": Decimal("1e-3")})
FREQUENCY_HZ = Quantity("frequency", _table(Hz="1", mHz="1e-3", kHz="1e3", MHz="1e6", GHz="1e9"))
NUMBER = Quantity("number", {})
STRESS_KPA = Quantity("stress", _table(kPa="1", Pa="1e-3", MPa="1e3"))
FORCE_N = Quantity("force", _table(N="1", mN="1e-3", kN="1e3", MN="1e6", gf="9.80665e-3", kgf="9.80665"))


def length_mm(text: str) -> float:
    """Read a length as typed, in millimetres unless it names its unit [mm].

    >>> length_mm("0.2"), length_mm("200um"), length_mm("10 cm")
    (0.2, 0.2, 100.0)
    """
    return LENGTH_MM.read(text)


def frequency_hz(text: str) -> float:
    """Read a frequency as typed, in hertz unless it names its unit [Hz].

    >>> frequency_hz("1100"), frequency_hz("10.1kHz"), frequency_hz("2 MHz"), frequency_hz("2 mHz")
    (1100.0, 10100.0, 2000000.0, 0.002)
    """
    return FREQUENCY_HZ.read(text)


def force_n(text: str) -> float:
    """Read a force as typed, in newtons unless it names its unit [N]; a gram-force is 9.80665 mN.

    >>> force_n("6 N"), force_n("250mN"), force_n("100gf")
    (6.0, 0.25, 0.980665)
    """
    return FORCE_N.read(text)


def prefix(value: float) -> tuple[str, float]:
    """SI prefix in which a value has one to three digits before the point, and its size."""
    powers = [p for p in PREFIXES if abs(value) >= 10.0**p]
    power = max(powers) if powers else min(PREFIXES) if value else 0
    return PREFIXES[power], 10.0**power


def si(value: float, unit: str, digits: int = 4) -> str:
    """A value with an SI prefix.

    >>> si(6.29e-11, "F"), si(2333.3, "ohm"), si(0.0, "F"), si(0.99996, "m"), si(0.5513, "s", 2)
    ('62.9 pF', '2.333 kohm', '0 F', '1 m', '550 ms')
    """
    rounded = float(f"{value:.{digits}g}")
    name, size = prefix(rounded) if math.isfinite(rounded) else ("", 1.0)
    return f"{rounded / size:.{max(digits, 4)}g} {name}{unit}"


def frequency_text(frequency_hz: float) -> str:
    """A frequency as a number with Hz, kHz or MHz that :func:`frequency_hz` reads back, but for its last two bits.

    Parameters
    ----------
    frequency_hz : float
        Frequency [Hz].

    Examples
    --------
    >>> frequency_text(99700.0), frequency_text(0.5), frequency_text(3000000.000000001)
    ('99.7kHz', '0.5Hz', '3MHz')
    """
    short = float(f"{frequency_hz:.12g}")
    number = Decimal(repr(short if math.isclose(short, frequency_hz, rel_tol=1e-15) else float(frequency_hz)))
    power = next((p for p in _PREFIXES if abs(number) >= 10**p), 0)
    shown = format(number.scaleb(-power).normalize(), "f")
    return f"{shown}{_PREFIXES[power]}Hz"


def values(text: str, quantity: Quantity) -> tuple[float, ...]:
    """Read several numbers: ``start:stop:step``, one number, or a list of these with commas between them.

    Parameters
    ----------
    text : str
        As typed. Units stand at each number, or at the last one for all.
    quantity : Quantity
        What the numbers are.

    Returns
    -------
    tuple of float
        Rising, in the quantity's first unit; each exactly the decimal number that it is, rounded once.

    Raises
    ------
    BadInput
        A part that is empty or no number, a step that does not lead from start to stop, values that do not rise,
        or more than ``MOST_VALUES``. Nothing is sorted silently, and nothing taken twice.

    Examples
    --------
    The stop is included where it falls on the grid:

    >>> values("0:0.3:0.1N", FORCE_N), values("0:1:0.4", FORCE_N), values("1.1kHz,2.3kHz", FREQUENCY_HZ)
    ((0.0, 0.1, 0.2, 0.3), (0.0, 0.4, 0.8), (1100.0, 2300.0))
    """
    words = [part.split(":") for part in text.split(",")]
    numbers = iter(_numbers([word for part in words for word in part], text, quantity))
    rising: list[float] = []
    for part in words:
        exact = _part([next(numbers) for _ in part], ":".join(part).strip(), MOST_VALUES - len(rising))
        rising += [quantity.float(number, text) for number in exact]
    for before, after in pairwise(rising):
        if not before < after:
            what = "stands twice" if before == after else f"stands after {before:g}"
            raise BadInput(f"{_short(text)}: {after:g} {what}; expected rising values, each once")
    return tuple(rising)


def _numbers(words: Sequence[str], text: str, quantity: Quantity) -> Iterator[Decimal]:
    """Every number, exactly, in the quantity's first unit."""
    if not all(word.strip() for word in words):
        raise BadInput(f"{_short(text)} has an empty part; expected {_EXPECTED}")
    typed = [quantity.typed(word) for word in words]
    named = [bool(unit) for _, unit in typed]
    if any(named[:-1]) and not all(named):
        bare = words[named.index(False)].strip()
        raise BadInput(f"{_short(text)}: {bare!r} has no unit; give it to each number, or to the last one for all")
    for word, (number, unit) in zip(words, typed, strict=True):
        yield number * quantity.factor(word, unit or typed[-1][1])


def _part(numbers: Sequence[Decimal], text: str, room: int) -> list[Decimal]:
    """One number, or the values from start to stop."""
    if len(numbers) == 1:
        numbers = [*numbers, *numbers, Decimal(1)]
    if len(numbers) != 3:
        raise BadInput(f"{_short(text)}: expected {_EXPECTED}")
    start, stop, step = numbers
    if step <= 0 or stop < start:
        raise BadInput(f"{_short(text)}: expected a step above 0 and a stop not below the start: values rise")
    steps = int((stop - start) / step + _ROUNDING)
    if steps >= room:
        raise BadInput(f"{_short(text)}: more than {MOST_VALUES} values in all; expected fewer: use a larger step")
    grid = [start + k * step for k in range(steps + 1)]
    if abs(grid[-1] - stop) <= _ROUNDING * step:
        grid[-1] = stop
    return grid


def _short(text: str) -> str:
    return repr(text if len(text) <= 100 else text[:97] + "...")
