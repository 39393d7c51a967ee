"""Results of an identifiability analysis. SI units; None where a number is undefined."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = tuple[tuple[float | None, ...], ...]


@dataclass(frozen=True)
class Cartesian:
    """A complex number by its parts."""

    re: float
    im: float

    def __abs__(self) -> float:
        return float(np.hypot(self.re, self.im))


@dataclass(frozen=True, kw_only=True)
class StandardErrors:
    """Least standard errors of an unbiased estimate, Cramer-Rao: force [N], position [m], and their correlation [-]."""

    sigma_force_n: float | None
    sigma_position_m: float | None
    correlation: float | None = None


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
    """The same with the stiffest law of compression, and what that means for the verdict."""

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


@dataclass(frozen=True, kw_only=True)
class FrequencyChoice(StandardErrors):
    """Some frequencies and the standard errors with them alone; no frequency where all errors are undefined."""

    frequency_hz: tuple[float, ...] = ()


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
    """How precisely impedance determines a press.

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


def finite(value: float | NDArray[np.float64]) -> float | None:
    """A number, None for nan."""
    return None if np.isnan(value) else float(value)


def cartesian(value: complex) -> Cartesian:
    """A complex number as data."""
    return Cartesian(float(value.real), float(value.imag))


def of_schema_1(data: dict[str, Any]) -> Identifiability | None:
    """The identifiability in a prediction of version 0.1.0; None where it had only a reason."""
    if not data.get("verdict"):
        return None
    from pydantic import TypeAdapter

    def summary(row: dict[str, Any]) -> dict[str, Any]:
        at = row.pop("worst_at", None) or {"force_n": None, "position_m": None}
        return row | {"worst_force_n": at["force_n"], "worst_position_m": at["position_m"]}

    def choice(row: dict[str, Any]) -> dict[str, Any]:
        return row | {"frequency_hz": row["frequency_hz"] or ()}

    press, over, advised = data["press"], data["map"], data["advised_tones"]
    return TypeAdapter(Identifiability).validate_python(
        data
        | {
            "press": press | {"strain": press["thinning"]},
            "frequencies": data["tones"],
            "map": over | {name: summary(over[name]) for name in ("of_force", "of_position")},
            "best_frequencies": [choice(row) for row in data["best_tones"]],
            "advised_frequencies": advised | {name: choice(advised[name]) for name in ("single", "pair")},
        }
    )
