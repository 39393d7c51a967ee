"""Results of an identifiability analysis. SI units; None where a number is undefined."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot, inf, isnan
from typing import TYPE_CHECKING, Any

from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.units import si

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Real = float | NDArray[np.float64]

Rows = tuple[tuple[float | None, ...], ...]
FORCE_SHARE = 0.1  # force is sensed where its standard error is a tenth of it
CANNOT_SENSE, CANNOT_LOCATE = "cannot sense force", "cannot locate"
GUESS = 12**-0.5  # standard deviation of a uniform distribution, relative to its range [-]
SHOWN = 7  # frequencies; of more, those with most information on position


@dataclass(frozen=True)
class Cartesian:
    """A complex number by its parts."""

    re: float
    im: float

    def __abs__(self) -> float:
        return hypot(self.re, self.im)


@dataclass(frozen=True, kw_only=True)
class StandardErrors:
    """Least standard errors of an unbiased estimate, Cramer-Rao: force [N], position [m], and their correlation [-]."""

    sigma_force_n: float | None
    sigma_position_m: float | None
    correlation: float | None = None

    def words(self, most_n: float = inf, length_m: float = inf) -> str:
        """Both errors to two digits, or what the sensor cannot do up to a force [N] and over its length [m]."""
        return f"{_sensed(self.sigma_force_n, most_n)}, {_located(self.sigma_position_m, length_m)}"


@dataclass(frozen=True)
class ReferencePress:
    """The press that the numbers are stated for.

    Attributes
    ----------
    force_n, position_m, tip_m : float
        Force [N], centre and length of the tip [m].
    stress_pa, strain : float
        Pressure under the tip [Pa], and the capacitive strain 1 - C(0)/C(p) that it causes [-].
    """

    force_n: float
    position_m: float
    tip_m: float
    stress_pa: float
    strain: float


@dataclass(frozen=True, kw_only=True)
class Stiffest(StandardErrors):
    """Result by the stiffest law of compression, and its meaning for the verdict."""

    verdict: str


@dataclass(frozen=True)
class FrequencyInformation:
    """Sensitivity of the impedance at one frequency, and its share in the information on force and position.

    Attributes
    ----------
    frequency_hz, magnitude_ohm : float
        Frequency [Hz], abs(Z) [ohm].
    by_force_ohm_per_n, by_position_ohm_per_m : Cartesian
        Derivatives of Z [ohm/N], [ohm/m].
    relative_by_force_per_n, relative_by_position_per_m : Cartesian
        Derivatives of ln Z [1/N], [1/m].
    share_of_force_information, share_of_position_information : float or None
        Of all frequencies together, the other quantity being unknown too [-].
    """

    frequency_hz: float
    magnitude_ohm: float
    by_force_ohm_per_n: Cartesian
    by_position_ohm_per_m: Cartesian
    relative_by_force_per_n: Cartesian
    relative_by_position_per_m: Cartesian
    share_of_force_information: float | None
    share_of_position_information: float | None


@dataclass(frozen=True)
class ErrorSummary:
    """Standard errors of one quantity over all presses of a map, in its unit.

    Attributes
    ----------
    median, worst : float or None
        [N] or [m].
    worst_force_n, worst_position_m : float or None
        The press where it is worst [N], [m].
    from_force_n : float
        Least force that counts in ``share_known`` [N].
    share_known : float
        Of these presses, how many are known as well as required [-].
    """

    median: float | None
    worst: float | None
    worst_force_n: float | None
    worst_position_m: float | None
    from_force_n: float
    share_known: float

    def where(self) -> str:
        """The press where it is worst, in words."""
        at = self.worst_position_m
        return "" if at is None else f" (at {self.worst_force_n:g} N, {at * 1e3:g} mm)"


@dataclass(frozen=True)
class ErrorMap:
    """Standard errors over force (rows) and position (columns).

    Attributes
    ----------
    force_n, position_m : tuple of float
        Axes [N], [m].
    sigma_force_n, sigma_position_m : tuple of tuple of float or None
        [N], [m]; None where undefined, or where the electrodes touch.
    doubt : str
        Why part of the map is uncertain, or "".
    of_force, of_position : ErrorSummary
        Over all presses with a force.
    """

    force_n: tuple[float, ...]
    position_m: tuple[float, ...]
    sigma_force_n: Rows
    sigma_position_m: Rows
    doubt: str
    of_force: ErrorSummary
    of_position: ErrorSummary

    def typical(self) -> StandardErrors:
        """Medians."""
        return StandardErrors(sigma_force_n=self.of_force.median, sigma_position_m=self.of_position.median)


@dataclass(frozen=True, kw_only=True)
class FrequencyChoice(StandardErrors):
    """Some frequencies and the standard errors with them alone; no frequency where all errors are undefined."""

    frequency_hz: tuple[float, ...] = ()

    def words(self, most_n: float = inf, length_m: float = inf) -> str:
        """The frequencies and both errors."""
        errors = super().words(most_n, length_m)
        return f"{' + '.join(f'{f / 1e3:.4g}' for f in self.frequency_hz)} kHz ({errors})"


@dataclass(frozen=True)
class AdvisedFrequencies:
    """The best single frequency and the best pair of a range [Hz]."""

    lowest_hz: float
    highest_hz: float
    single: FrequencyChoice
    pair: FrequencyChoice


@dataclass(frozen=True, kw_only=True)
class ChangeResult(StandardErrors):
    """A change of design or readout and the standard errors with it.

    Attributes
    ----------
    kind, change, risk : str
        Part that is changed; the change; its disadvantage.
    shortfall : float
        By what factor the worse of both errors then exceeds what is required [-].
    """

    kind: str
    change: str
    risk: str
    shortfall: float


@dataclass(frozen=True, kw_only=True)
class Identifiability(StandardErrors):
    """Precision at which impedance determines a press.

    Attributes
    ----------
    noise : float
        Standard deviation of Re Z and of Im Z, relative to abs(Z) [-].
    press : ReferencePress
        The press that the standard errors are for.
    corner_frequency_hz : float or None
        Of the line [Hz]; None where its electrodes have no resistance.
    required : StandardErrors
        What a press has to be known to.
    reason : str
        Why position is undefined, or "".
    assumed : str or None
        What is assumed of a cell that was not solved.
    senses_force, locates : str or None
        "yes", "roughly" or "no"; None where something is assumed.
    verdict : str
        Both in a sentence.
    stiffest : Stiffest or None
        Bounds by the stiffest law of compression, where the law is known to lie between two.
    frequencies : tuple of FrequencyInformation
        Of each reading.
    map : ErrorMap
        Over force and position.
    best_frequencies : tuple of FrequencyChoice
        The best one, two and three of the given.
    advised_frequencies : AdvisedFrequencies
        The best of all that the instrument can give.
    changes : tuple of ChangeResult
        The most helpful changes, the best first.
    changes_together : StandardErrors or None
        With all of them.
    doubts : tuple of str
        Why the numbers are uncertain.
    calibrated, uncalibrated : StandardErrors or None
        What a specimen leaves, which is never as predicted: after 30 known presses, and without any; None where that
        was not worked out. All other errors are those of a perfect model.
    """

    noise: float
    press: ReferencePress
    corner_frequency_hz: float | None
    required: StandardErrors
    reason: str
    assumed: str | None
    senses_force: str | None
    locates: str | None
    verdict: str
    stiffest: Stiffest | None
    frequencies: tuple[FrequencyInformation, ...]
    map: ErrorMap
    best_frequencies: tuple[FrequencyChoice, ...]
    advised_frequencies: AdvisedFrequencies
    changes: tuple[ChangeResult, ...]
    changes_together: StandardErrors | None
    doubts: tuple[str, ...] = ()
    calibrated: StandardErrors | None = None
    uncalibrated: StandardErrors | None = None

    def bench_ratio(self) -> tuple[float, float]:
        """Standard errors of force and position after known presses, over these; 1 where one is not known [-]."""
        known = self.calibrated or self
        force, position = known.sigma_force_n, known.sigma_position_m
        return (force or 1.0) / (self.sigma_force_n or 1.0), (position or 1.0) / (self.sigma_position_m or 1.0)

    @property
    def most(self) -> tuple[float, float]:
        """Largest force [N] and position [m] of the map, beyond whose shares an error is that of no reading."""
        return max(self.map.force_n, key=abs), max(self.map.position_m)

    def document(self) -> Iterator[Part]:
        """Verdict, errors over all presses, changes that reduce them, and what each frequency contributes."""
        yield Facts(tuple(self._facts()))
        known = sorted(self.frequencies, key=lambda row: -(row.share_of_position_information or 0.0))[:SHOWN]
        columns = (
            Column("frequency", "Hz", si=True), Column("|Z|", "ohm", si=True), Column("per N", "%", digits=2),
            Column("per mm", "%", digits=2), Column("info on force", "%", digits=2),
            Column("on position", "%", digits=2),
        )  # fmt: skip
        cells = (
            (
                row.frequency_hz, row.magnitude_ohm, 100 * abs(row.relative_by_force_per_n),
                0.1 * abs(row.relative_by_position_per_m), _percent(row.share_of_force_information),
                _percent(row.share_of_position_information),
            )
            for row in sorted(known, key=lambda row: row.frequency_hz)
        )  # fmt: skip
        caption = f"change of Z at {self.press.force_n:g} N and {self.press.position_m * 1e3:g} mm"
        yield Table("frequencies", caption, columns, tuple(cells))

    def _facts(self) -> Iterator[tuple[str, str]]:
        yield "verdict", f"{self.verdict}."
        yield from (("doubtful", doubt) for doubt in self.doubts)
        if self.stiffest:
            yield "", f"{self.stiffest.verdict}."
        if self.calibrated and self.uncalibrated:
            known, unknown = (errors.words(*self.most) for errors in (self.calibrated, self.uncalibrated))
            words = f"perfect model {self.words(*self.most)}; after 30 known presses {known}; not calibrated {unknown}"
            yield "on a bench", words
        yield "over all", self._over_all()
        yield "best", self._best()
        yield from self._remedies()

    def _remedies(self) -> Iterator[tuple[str, str]]:
        """Changes that reduce the errors, one by one and together."""
        if not self.changes:
            yield "to improve", "none of the changes that were tried"
        for k, change in enumerate(self.changes):
            yield "" if k else "to improve", f"{k + 1}. {change.change}: {change.words()}"
        if self.changes_together and len(self.changes) > 1:
            yield "", f"all together: {self.changes_together.words()}"

    def _over_all(self) -> str:
        """Errors over the map in words."""
        force, position = self.map.of_force, self.map.of_position
        most_n, length_m = self.most
        return "; ".join((
            f"median {_sensed(force.median, most_n)}, {_located(position.median, length_m)}",
            f"worst {_sensed(force.worst, most_n)}{force.where()}, "
            f"{_located(position.worst, length_m)}{position.where()}",
            f"above {force.from_force_n:g} N, force is resolved to {newtons(self.required.sigma_force_n)} in "
            f"{100 * force.share_known:.0f} % of presses, position to {metres(self.required.sigma_position_m)} in "
            f"{100 * position.share_known:.0f} %",
            *([self.map.doubt] if self.map.doubt else ()),
        ))  # fmt: skip

    def _best(self) -> str:
        """Best frequencies in words."""
        better = self.advised_frequencies
        if not better.pair.frequency_hz:
            return "no frequencies determine both force and position"
        given = [best.words() for best in self.best_frequencies if best.frequency_hz]
        advised = f"of all up to {si(better.highest_hz, 'Hz')}: {better.single.words()}; {better.pair.words()}"
        return "; ".join((*given, advised))


def _sensed(error_n: float | None, most_n: float) -> str:
    """A standard error of force; what the sensor cannot do where it is that of no reading [N]."""
    return newtons(error_n) if error_n is None or error_n < GUESS * abs(most_n) else CANNOT_SENSE


def _located(error_m: float | None, length_m: float) -> str:
    """A standard error of position; what the sensor cannot do where it is that of no reading [m]."""
    return metres(error_m) if error_m is None or error_m < GUESS * length_m else CANNOT_LOCATE


def _percent(share: float | None) -> float | None:
    """A share in whole percent."""
    return None if share is None else float(f"{100 * share:.0f}")


def newtons(value: "Real | None") -> str:
    """A force to two digits.

    >>> newtons(2.2299), newtons(213.4), newtons(0.1508), newtons(None)
    ('2.2 N', '213 N', '0.15 N', 'undefined')
    """
    return _text(value, {"N": 1.0}, "kN")


def metres(value: "Real | None") -> str:
    """A length to two digits.

    >>> metres(0.22495), metres(21.34), metres(0.00829), metres(2e5)
    ('225 mm', '21 m', '8.3 mm', 'more than 1 km')
    """
    return _text(value, {"mm": 1e-3, "m": 1.0}, "km")


def _text(value: "Real | None", units: dict[str, float], beyond: str) -> str:
    """A value in the first unit that keeps it below a thousand."""
    if value is None or isnan(value):
        return "undefined"
    for unit, size in units.items():
        shown = float(value) / size
        if shown < 99.5:
            return f"{shown:.2g} {unit}"
        if shown < 999.5:
            return f"{shown:.0f} {unit}"
    return f"more than 1 {beyond}"


def cartesian(value: complex) -> Cartesian:
    """A complex number as data."""
    return Cartesian(float(value.real), float(value.imag))


def of_schema_1(data: dict[str, Any]) -> Identifiability | None:
    """The identifiability in a prediction of version 0.1.0; None where it had only a reason."""
    if not data.get("verdict"):
        return None
    from sensorgen.core.records import adapter

    def summary(row: dict[str, Any]) -> dict[str, Any]:
        at = row.pop("worst_at", None) or {"force_n": None, "position_m": None}
        return row | {"worst_force_n": at["force_n"], "worst_position_m": at["position_m"]}

    def choice(row: dict[str, Any]) -> dict[str, Any]:
        return row | {"frequency_hz": row["frequency_hz"] or ()}

    press, over, advised = data["press"], data["map"], data["advised_tones"]
    known: Identifiability = adapter(Identifiability).validate_python(
        data
        | {
            "press": press | {"strain": press["thinning"]},
            "frequencies": data["tones"],
            "map": over | {name: summary(over[name]) for name in ("of_force", "of_position")},
            "best_frequencies": [choice(row) for row in data["best_tones"]],
            "advised_frequencies": advised | {name: choice(advised[name]) for name in ("single", "pair")},
        }
    )
    return known
