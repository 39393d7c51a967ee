r"""AC quantities between two terminals, as people type them and as LCR meters show them; impedance from any pair.

With :math:`\omega = 2 \pi f`, the closed forms are

.. math:: Z = R + jX = |Z| e^{j\theta}, \qquad 1/Z = Y = G + jB, \qquad D = 1/Q = R/|X| = G/|B|,

    X = -1/(\omega C_s) = \omega L_s, \qquad B = \omega C_p = -1/(\omega L_p), \qquad R_p = 1/G.

Series and parallel values differ by :math:`C_s = (1 + D^2) C_p`.
"""

import cmath
import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from decimal import Decimal
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from sensorgen.core.errors import BadInput, within
from sensorgen.core.units import PREFIXES, frequency_hz, si

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sensorgen.core.arrays import Real

UNITS: Mapping[str, str] = MappingProxyType({
    "R": "ohm", "X": "ohm", "Z": "ohm", "phase": "rad", "G": "S", "B": "S", "Y": "S", "Cp": "F", "Cs": "F", "Lp": "H",
    "Ls": "H", "Rp": "ohm", "D": "", "Q": "",
})  # fmt: skip
QUANTITIES = frozenset(UNITS)
NO_VALUE = 9.9e37  # SCPI 1999, 7.2.1.4: what an instrument sends for infinity
NEVER_NEGATIVE = ("R", "Z", "G", "Y", "Cp", "Cs", "Rp", "D", "Q")  # of a capacitor; its inductance always is
_EXAMPLES = {"Cp": "12.3pF@1kHz", "Cs": "12.3pF@1kHz", "D": "0.02@1kHz", "phase": "-88deg@1kHz"}
_SPELLINGS = {
    "f": "F", "farad": "F", "Ω": "ohm", "\u03c9": "ohm", "\u2126": "ohm", "ohms": "ohm", "r": "ohm", "°": "deg",
    "degree": "deg", "degrees": "deg", "s": "S", "h": "H",
    "hz": "Hz", "siemens": "S", "henry": "H", "radian": "rad", "ohm": "ohm",
}  # fmt: skip
_SCALES = {("rad", "deg"): Decimal(repr(math.pi / 180)), ("", "%"): Decimal("0.01")}
_PREFIX = {name: Decimal(10) ** power for power, name in PREFIXES.items()}
_PREFIX |= {"\u00b5": Decimal("1e-6"), "\u03bc": Decimal("1e-6"), "K": Decimal(1000)}
NUMBER = r"[-+]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][-+]?[0-9]{1,3})?"
_READING = re.compile(rf"(?P<value>{NUMBER})\s*(?:(?:±|\+/?-)\s*(?P<pm>{NUMBER})\s*)?(?P<unit>[^\s0-9]*)")


@dataclass(frozen=True)
class AcReading:
    """One reading of one quantity.

    Attributes
    ----------
    quantity : str
        One of ``QUANTITIES``.
    value : float
        In SI units.
    frequency_hz : float
        Frequency [Hz].
    uncertainty : float
        Standard uncertainty as stated; 0 where none is.
    """

    quantity: str
    value: float
    frequency_hz: float
    uncertainty: float = 0.0


def parse(quantity: str, text: str) -> tuple[AcReading, ...]:
    """Readings of one quantity at one frequency as typed; repeats have ``/`` between them.

    Parameters
    ----------
    quantity : str
        One of ``QUANTITIES``.
    text : str
        As ``12.3pF@1kHz``, ``12.3 / 12.4pF@1kHz`` or ``12.3±0.1pF@1kHz``.

    Raises
    ------
    BadInput
        No number, no unit or that of another quantity, no value of a meter, or no frequency.

    Examples
    --------
    >>> [(r.value, r.uncertainty, r.frequency_hz) for r in parse("Cp", "12,3 / 12.4±0.1pF @ 1kHz")]
    [(1.23e-11, 0.0, 1000.0), (1.24e-11, 1e-13, 1000.0)]
    >>> round(parse("phase", "-90deg@1kHz")[0].value, 6)
    -1.570796
    """
    words, _, at = text.partition("@")
    with within(f"{quantity} {text!r:.60}"):
        if not at.strip():
            raise BadInput(f"no frequency; write it behind the value, as {_EXAMPLES.get(quantity, '650ohm@1kHz')}")
        frequency = frequency_hz(at)
        if not frequency > 0:
            raise BadInput("expected a frequency above 0 Hz; DC resistances go to --y and --z")
        matches = [_READING.fullmatch(part.strip()) for part in re.split("[/;|]", words.replace("+/-", "±"))]
        if None in matches:
            raise BadInput(f"no number; expected one as {_EXAMPLES.get(quantity, '650ohm@1kHz')}")
        return tuple(_reading(quantity, match, matches[-1], frequency) for match in matches)


def _reading(quantity: str, match: Any, last: Any, frequency_hz: float) -> AcReading:
    """A reading of the text; the last one has the unit of those without."""
    unit = match["unit"] or last["unit"]
    if not unit and UNITS[quantity] in ("F", "H", "rad"):
        raise BadInput(f"no unit; write it behind the value, as {_EXAMPLES.get(quantity, '3.3mH@1kHz')}")
    if abs(decimal(match["value"])) >= NO_VALUE:
        raise BadInput(f"{match['value']} is what a meter sends for no value; leave the quantity out")
    scale = factor(quantity, unit)
    value, stated = (float(decimal(match[name] or "0") * scale) for name in ("value", "pm"))
    if not math.isfinite(value) or not math.isfinite(stated):
        raise BadInput("more than a number can hold; expected a value as it was read")
    return AcReading(quantity, value, frequency_hz, abs(stated))


def decimal(text: str) -> Decimal:
    """A number with a decimal point or comma."""
    return Decimal(text.replace(",", "."))


def factor(quantity: str, unit: str) -> Decimal:
    """Factor from a unit to SI; 1 where there is no unit.

    Raises
    ------
    BadInput
        A unit of another quantity.

    Examples
    --------
    >>> factor("Cp", "pF"), factor("R", "kΩ"), factor("D", "%"), factor("G", ""), factor("frequency", "kHz")
    (Decimal('1E-12'), Decimal('1000'), Decimal('0.01'), Decimal('1'), Decimal('1000'))
    """
    wanted = UNITS.get(quantity, "Hz")
    for length in range(len(unit) + 1):  # the prefix is what stands before the unit, or alone, as in 12.3p
        base = unit[length:]
        base = base if base == wanted else _SPELLINGS.get(base, _SPELLINGS.get(base.casefold(), base.casefold()))
        prefix = _PREFIX.get(unit[:length])
        if prefix is not None and base in (wanted, ""):
            return prefix
        if length == 0 and (wanted, base) in _SCALES:
            return _SCALES[wanted, base]
    raise BadInput(f"unit {unit!r:.20}; expected {wanted or 'none, or %'}{' or deg' * (wanted == 'rad')}")


_PARALLEL = ("G", "Y", "Cp", "Lp")  # parts of an admittance; R, Z, Cs and Ls are of an impedance
_PAIRS = (
    ("R", "X"), ("Z", "phase"), ("G", "B"), ("Y", "phase"),
    *((one, other) for one in ("Cp", "Cs", "Lp", "Ls")
      for other in ("D", "Q", *(("G", "Rp") if one in _PARALLEL else ("R",)))),
)  # fmt: skip


def _of_pair(pair: tuple[str, str], one: float, other: float, omega: float) -> complex:
    """Impedance of two values [ohm]; ZeroDivisionError where it is infinite, or of no finite one."""
    if pair[1] == "phase":
        z = cmath.rect(one, other)
    elif pair[0] in ("R", "G"):
        z = complex(one, other)
    else:
        imaginary = omega * one if pair[0] in ("Cp", "Ls") else -1 / (omega * one)
        real = 1 / other if pair[1] in ("Q", "Rp") else other
        z = complex(abs(imaginary) * real if pair[1] in ("D", "Q") else real, imaginary)
    return 1 / z if pair[0] in _PARALLEL else z


def impedance(values: Mapping[str, float], frequency_hz: float) -> complex | None:
    """Impedance from the first pair of quantities that determines it.

    Parameters
    ----------
    values : mapping of str to float
        Quantities at one frequency, in SI units.
    frequency_hz : float
        Frequency [Hz].

    Returns
    -------
    complex or None
        Z [ohm]; None where no pair is among them, or it stands for no finite impedance.

    Examples
    --------
    >>> z = impedance({"Cp": 10e-12, "D": 0.02}, 1e3)
    >>> round(z.real), round(z.imag)
    (318183, -15909131)
    """
    both = pair(values)
    if both is None:
        return None
    try:
        z = _of_pair(both, values[both[0]], values[both[1]], 2 * math.pi * frequency_hz)
    except (ZeroDivisionError, OverflowError):
        return None
    return z if cmath.isfinite(z) else None


def pair(quantities: Collection[str]) -> tuple[str, str] | None:
    """The first pair among quantities that determines an impedance; None without one.

    >>> pair(["D", "Z", "Cp"])
    ('Cp', 'D')
    """
    return next((both for both in _PAIRS if both[0] in quantities and both[1] in quantities), None)


_OF: Mapping[str, Callable[[Any, Any], Any]] = MappingProxyType({  # impedance and angular frequency to a quantity
    "R": lambda z, _w: z.real, "X": lambda z, _w: z.imag, "Z": lambda z, _w: abs(z),
    "G": lambda z, _w: (1 / z).real, "B": lambda z, _w: (1 / z).imag,
    "Y": lambda z, _w: 1 / abs(z), "Cp": lambda z, w: (1 / z).imag / w, "Cs": lambda z, w: -1 / (w * z.imag),
    "Lp": lambda z, w: -1 / (w * (1 / z).imag), "Ls": lambda z, w: z.imag / w, "Rp": lambda z, _w: 1 / (1 / z).real,
    "D": lambda z, _w: z.real / abs(z.imag), "Q": lambda z, _w: abs(z.imag) / z.real,
})  # fmt: skip


def quantity_of(quantity: str, z_ohm: "ArrayLike", frequency_hz: "ArrayLike") -> "Real":
    """A quantity of impedances.

    Parameters
    ----------
    quantity : str
        One of ``QUANTITIES``.
    z_ohm, frequency_hz : (...) array
        Impedances [ohm] and their frequencies [Hz].

    Returns
    -------
    (...) array
        In SI units.

    Examples
    --------
    >>> round(float(quantity_of("Cp", 318183 - 15909131j, 1e3)) * 1e12, 4)
    10.0
    """
    import numpy as np

    z = np.asarray(z_ohm, complex)
    if quantity == "phase":
        return np.asarray(np.angle(z), float)
    return np.asarray(_OF[quantity](z, 2 * math.pi * np.asarray(frequency_hz)), float)


def shown_value(quantity: str, value: float) -> str:
    """A value for people, as ``12.3 pF``.

    >>> shown_value("Cp", 1.23e-11), shown_value("phase", -1.5), shown_value("D", 0.02)
    ('12.3 pF', '-85.94 deg', '0.02')
    """
    if quantity == "phase":
        return f"{math.degrees(value):.4g} deg"
    return si(value, UNITS[quantity]) if UNITS[quantity] else f"{value:.4g}"
