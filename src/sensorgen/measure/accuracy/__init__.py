r"""Accuracy of instruments as their makers specify it: one YAML file each, and type B uncertainty from it.

A multimeter's limit of error is a share of the reading plus a share of the range. An LCR meter's is a share of
\|Z\|, :math:`a = a_0 + Z_s/|Z| + |Z| Y_o`, of the whole complex impedance: with :math:`D = R/|X|` and Q = 1/D the
limits are a of \|Z\|, :math:`a \sqrt{1 + D^2}` of C, L, X and B, :math:`a \sqrt{1 + Q^2}` of R and G, a [rad] of the
phase and :math:`a (1 + D^2)` of D, as the manuals have it. A limit is taken for the half-width of a uniform
distribution: its standard uncertainty is the limit over the root of 3 (GUM, JCGM 100:2008, 4.3.7).
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from statistics import mean, stdev
from typing import Annotated, NamedTuple

from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.errors import within
from sensorgen.core.records import Strict, checked
from sensorgen.design import packs
from sensorgen.measure.immittance import impedance, quantity_of
from sensorgen.measure.log.entries import Reading


class MeterRange(NamedTuple):
    """Limits of error of a multimeter in one range.

    Attributes
    ----------
    ohm : float
        Full scale [ohm].
    reading_percent, range_percent : float
        Limit as shares of the reading and of the range [%].
    """

    ohm: float
    reading_percent: float
    range_percent: float


class MeterBand(NamedTuple):
    """Limits of error of an LCR meter in a band of frequencies.

    Attributes
    ----------
    from_hz, to_hz : float
        Frequencies [Hz].
    percent : float
        Of the reading [%].
    short_ohm, open_s : float
        Residual impedance of the short [ohm] and admittance of the open [S].
    """

    from_hz: float
    to_hz: float
    percent: float
    short_ohm: float
    open_s: float


class Instrument(Strict):
    """Specification by an instrument's maker.

    Attributes
    ----------
    name : str
        Maker and type.
    also : tuple of str
        Other types with the same specification.
    source : str
        Document, and its conditions.
    ranges : tuple of MeterRange
        DC resistance, the smallest range first.
    leads_ohm : float
        Added with two wires [ohm].
    bands : tuple of MeterBand
        AC quantities.
    least_ohm, most_ohm : float
        Impedances between which the specification holds [ohm].
    """

    name: Annotated[str, Field(pattern=r"\S", examples=["maker and type"])]
    also: Annotated[tuple[str, ...], Field(strict=False)] = ()
    source: str
    ranges: Annotated[tuple[MeterRange, ...], Field(strict=False)] = ()
    leads_ohm: float = 0.0
    bands: Annotated[tuple[MeterBand, ...], Field(strict=False)] = ()
    least_ohm: float = 0.0
    most_ohm: float = math.inf

    def dc_ohm(self, resistance_ohm: float, wires: int | None) -> float | None:
        """Standard uncertainty of a DC resistance [ohm]; None beyond the ranges."""
        limits = next((one for one in self.ranges if abs(resistance_ohm) <= 1.2 * one.ohm), None)
        if limits is None:
            return None
        leads = 0.0 if wires == 4 else self.leads_ohm
        share = abs(resistance_ohm) * limits.reading_percent + limits.ohm * limits.range_percent
        return (share / 100 + leads) / math.sqrt(3)

    def ac(self, quantity: str, value: float, frequency_hz: float, z_ohm: complex) -> float | None:
        """Standard uncertainty of an AC quantity.

        Parameters
        ----------
        quantity : str
            As in :data:`sensorgen.measure.immittance.QUANTITIES`.
        value : float
            In SI units.
        frequency_hz : float
            Frequency [Hz].
        z_ohm : complex
            Impedance of the specimen [ohm].

        Returns
        -------
        float or None
            In the quantity's unit; None beyond the frequencies or impedances of the specification.
        """
        size = abs(z_ohm)
        band = next((one for one in self.bands if one.from_hz <= frequency_hz <= one.to_hz), None)
        if band is None or not self.least_ohm <= size <= self.most_ohm:
            return None
        share = band.percent / 100 + band.short_ohm / size + size * band.open_s
        return uncertainty(share / math.sqrt(3), quantity, value, z_ohm)


def uncertainty(share: float, quantity: str, value: float, z_ohm: complex) -> float:
    """Standard uncertainty of an AC quantity by that of the complex impedance.

    Parameters
    ----------
    share : float
        Standard uncertainty of the impedance over its magnitude, in any direction [-].
    quantity, value, z_ohm
        As of :meth:`Instrument.ac`.
    """
    loss = abs(z_ohm.real / z_ohm.imag) if z_ohm.imag else math.inf
    if quantity in ("R", "X"):
        return share * abs(z_ohm)
    if quantity in ("G", "B"):
        return share / abs(z_ohm)
    if quantity in ("Cp", "Cs", "Lp", "Ls"):
        return abs(value) * share * math.hypot(1, loss)
    if quantity == "Rp":
        return abs(value) * share * math.hypot(1, 1 / loss) if loss else math.inf
    if quantity == "phase":
        return share
    if quantity == "D":
        return share * (1 + loss**2)
    return share * (1 + value**2) if quantity == "Q" else abs(value) * share


@dataclass(frozen=True)
class MeasuredValue:
    """A measured value, and its standard uncertainty; nan where none is known."""

    value: float
    error: float = math.nan


@dataclass(frozen=True, eq=False)
class At:
    """Reading at one frequency.

    Attributes
    ----------
    meter : Instrument or None
        That it was read from; None if its accuracy is not known.
    frequency_hz : float
        Frequency [Hz].
    values : dict of str to list of float
        Repeats by quantity, in SI units.
    impedances : tuple of complex
        By every repeat that has a pair of quantities [ohm].
    stated : dict of str to float
        Largest uncertainty of each quantity as stated by who measured; 0 where none is.
    """

    meter: Instrument | None
    frequency_hz: float
    values: Mapping[str, Sequence[float]]
    impedances: tuple[complex, ...]
    stated: Mapping[str, float]

    @property
    def z_ohm(self) -> complex | None:
        """Mean impedance [ohm]; that of Cp alone if nothing else is known, None if not even that is."""
        if self.impedances:
            return sum(self.impedances) / len(self.impedances)
        c = mean(self.values.get("Cp", [0.0]))
        return complex(0, -1 / (2 * math.pi * self.frequency_hz * c)) if c > 0 else None

    def value(self, quantity: str) -> MeasuredValue:
        """Mean, and its uncertainty: scatter of the repeats (type A) and the meter's limit, or what was stated."""
        z = self.z_ohm
        these = self.values.get(quantity) or [
            float(quantity_of(quantity, each, self.frequency_hz)) for each in self.impedances
        ]
        if not these:
            return MeasuredValue(math.nan)
        middle = mean(these)
        a = stdev(these) / math.sqrt(len(these)) if len(these) > 1 else 0.0
        b = self.stated.get(quantity) or (
            self.meter.ac(quantity, middle, self.frequency_hz, z) if self.meter and z else None
        )
        return MeasuredValue(middle, math.hypot(a, b) if b is not None else a or math.nan)


def at_frequency(reading: Reading, frequency_hz: float) -> At:
    """Reading at one frequency."""
    values, stated = dict[str, list[float]](), dict[str, float]()
    errors = reading.uncertainty or (0.0,) * len(reading.value)
    for name, value, at, error in zip(reading.quantity, reading.value, reading.frequency_hz, errors, strict=True):
        if at == frequency_hz:
            values.setdefault(name, []).append(value)
            stated[name] = max(error, stated.get(name, 0.0))
    repeats = [dict(zip(values, some, strict=True)) for some in zip(*values.values(), strict=False)]
    known = tuple(z for one in repeats if (z := impedance(one, frequency_hz)))
    meter = find(reading.instrument) if reading.instrument else None
    return At(meter, frequency_hz, values, known, stated)


@cache
def _all() -> dict[str, Instrument]:
    instruments = (parse(file.text(), str(file.path)) for file in packs.files("instruments"))
    return {one.name: one for one in instruments}


def parse(text: str, where: str) -> Instrument:
    """An instrument by the text of its file, which ``where`` names in errors.

    Raises
    ------
    BadInput
        A key is missing, unknown, or is not what it should be.
    """
    with within(where):
        return checked(Instrument, yamlfile.parse(text, where))


def is_of(one: Instrument, text: str) -> bool:
    """Test whether a text names this instrument, by its type: as a label, or a reply to ``*IDN?``."""
    types = (one.name.split()[-1], *one.also)
    return any(re.search(rf"(?<![0-9A-Za-z]){re.escape(each)}(?![0-9])", text, re.IGNORECASE) for each in types)


def find(text: str) -> Instrument | None:
    """The instrument that a text names; None if its accuracy is not known.

    >>> find("HEWLETT-PACKARD,34401A,0,7-5-2").name, find("an old meter")
    ('HP 34401A', None)
    """
    return next((one for one in _all().values() if is_of(one, text)), None)
