"""Values of materials: resistivity and leak from multimeters, permittivity and modulus too from AC readings.

For AC each specimen is calibrated (:mod:`sensorgen.prediction.calibration`); what its readings say beyond the prior
counts. A result holds values with their uncertainty, what the data do not determine, and errors before and after.
"""

import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from math import exp, inf, isnan, log, pi, sqrt
from typing import Annotated

import numpy as np

from sensorgen.analysis.calibration import SpecimenEntries
from sensorgen.analysis.comparison import AllowedValues
from sensorgen.analysis.comparison.expected import PERMITTIVITY, Movable
from sensorgen.core.arrays import Real
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Facts, Part, Table
from sensorgen.core.lazy import by_key
from sensorgen.core.version import __version__
from sensorgen.design.materials import FILM_LEAK, SourceValue, source_file
from sensorgen.prediction.calibration.fitting import Posterior, calibrated
from sensorgen.prediction.calibration.specimen import FORCES_N, SpecimenModel
from sensorgen.prediction.inference import standard

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

    material: Annotated[str, Column("material")]
    quantity: Annotated[str, Column("quantity")]
    value: Annotated[float, Column("value")]
    low: Annotated[float, Column("low")]
    high: Annotated[float, Column("high")]
    note: Annotated[str, Column("note", hidden=True)]


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
class GroupError:
    """Electrodes of a shape and direction, predicted by the resistivity of all others."""

    group: Annotated[str, Column("group left out")]
    readings: Annotated[int, Column("readings")]
    inside: Annotated[int, Column("within", "", "readings that a resistivity within the range explains")]
    ratio: Annotated[float, Column("ratio", "", "median resistivity of the group over that of the others")]
    value: Annotated[float, Column("resistivity of the others", "ohm m")]
    low: Annotated[float, Column("from", "ohm m")]
    high: Annotated[float, Column("to", "ohm m")]


@dataclass(frozen=True)
class Fit(Displayed):
    """A fit.

    Attributes
    ----------
    iteration : int or None
        Of the design; None of specimens that were named.
    names : tuple of str
        Those specimens.
    seed : int
        How the specimens were split.
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
    file : str or None
        Where the source is kept; None if it is not.
    groups : tuple of GroupError
        Each shape and direction, predicted by the others.
    """

    iteration: int | None
    names: tuple[str, ...]
    seed: int
    values: tuple[Fitted, ...]
    untold: tuple[Untold, ...]
    errors: tuple[Error, ...]
    specimens: int
    held_back: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]
    log: str
    file: str | None = None
    groups: tuple[GroupError, ...] = ()

    @property
    def source(self) -> str:
        """Name of the source that it makes."""
        if self.iteration is not None:
            return f"fit-{self.iteration}"
        first = re.sub(r"[^a-z0-9.]+", "-", self.names[0].lower()).strip("-.")
        which = sha256("\0".join(sorted(self.names)).encode()).hexdigest()[:6]
        return "-".join(filter(None, ("fit", first, which)))

    @property
    def of(self) -> str:
        """Name of the fitted quantity, in words."""
        return f"iteration {self.iteration}" if self.iteration is not None else ", ".join(self.names)

    def document(self) -> Iterator[Part]:
        """Values, what stays open, errors, and where the source is."""
        yield f"{self.of}: fitted to {self.specimens}, {len(self.held_back)} held back"
        if self.values:
            yield Table.of("values", "", self.values)
            yield Facts(tuple((f"{v.quantity}:", v.note) for v in self.values))
        yield from (f"not determined: {untold.parameter}: {untold.why}" for untold in self.untold)
        for error in self.errors:
            before, after = (f"a factor of {exp(e):.3g}" for e in (error.before, error.after))
            yield f"{error.observable} of {error.count} held back: off by {before} before, {after} after (rms)"
        yield from self._groups()
        if self.left_out:
            of = f"--iteration {self.iteration}" if self.iteration is not None else " ".join(map(repr, self.names))
            yield f"left out: {len(self.left_out)}; sensorgen report {of} says why"
        if self.file:
            yield f"in {self.file}"

    def _groups(self) -> Iterator[Table]:
        if self.groups:
            inside, total = sum(g.inside for g in self.groups), sum(g.readings for g in self.groups)
            yield Table.of("groups", f"Leaving out a group: {inside} of {total} readings within the range", self.groups)


def text(fit: Fit) -> str:
    """The file of the source.

    Parameters
    ----------
    fit : Fit
        As :func:`sensorgen.analysis.fit.fit` makes it.
    """
    about = (
        f"fit of {fit.of}: {fit.specimens} specimens, {len(fit.held_back)} held back (seed "
        f"{fit.seed}); sensorgen {__version__}; data {fit.log[:16]}"
    )
    values = ((v.material, SourceValue(v.quantity, v.value, v.low, v.high, v.note)) for v in fit.values)
    open_ = (f"not determined: {' '.join(f'{untold.parameter}: {untold.why}'.split())}" for untold in fit.untold)
    return source_file(about, by_key(values), open_)


RESISTIVITY = "resistivity_ohm_m"
LEAST = 3  # specimens that a scatter can be told from
_OF_PRINTS = log(1.45), 35  # scatter of ln of the resistivity of prints and its degrees, by Table D.1 of the thesis
_DRAWS = 2000
_PROPERTY = 10.0  # leaks that scatter by more than this factor about their median are no property of a material


def resistivity(specimens: Sequence[AllowedValues], material: str, least: int = LEAST) -> Fitted | Untold:
    """One resistivity for both electrodes: the median of prints, and the interval that holds 95 % of other prints.

    The interval is Student's for one more specimen of one more print, by the scatter of ln of the resistivity of prints
    and within them; of fewer than three prints that of the thesis's. It holds at least the medians of what specimens
    leave open.
    """
    from scipy.special import stdtrit

    count = len(specimens)
    if count < least:
        return Untold(f"{RESISTIVITY} along", f"{_specimens(count)} with sound electrodes; expected {least} or more")
    low, high = np.array([(one.low, one.high) for one in specimens]).T
    at = (low + high) / 2
    prints = by_key((one.print or k, at[k]) for k, one in enumerate(specimens))
    means = np.array([np.mean(of) for of in prints.values()])
    within = sum(float(((of - np.mean(of)) ** 2).sum()) for of in prints.values()) / count
    between = float(np.var(means, ddof=1)) if len(means) >= LEAST else _OF_PRINTS[0] ** 2
    degrees = len(means) - 1 if len(means) >= LEAST else _OF_PRINTS[1]
    middle, scatter = float(np.median(means)), sqrt(between + within)
    reach = float(stdtrit(degrees, (1 + LEVEL) / 2)) * scatter * sqrt(1 + 1 / len(means))
    return Fitted(
        material, RESISTIVITY, exp(middle), exp(min(middle - reach, np.median(low))),
        exp(max(middle + reach, np.median(high))),
        f"{_specimens(count)} of {len(means)} print{'s' * (len(means) != 1)}, along the electrode: the median; the "
        f"interval holds 95 % of prints, which scatter by a factor of {exp(scatter):.3g} (one standard deviation)",
    )  # fmt: skip


def along(fits: "Sequence[OfSpecimen]", unsound: Container[str]) -> dict[str, AllowedValues]:
    """Resistivities along electrodes that AC readings allow, by specimen, without those of unsound electrodes."""
    known = (
        (fit, at + log(fit.of.model.sensor.common_resistivity_ohm_m()), _SURE * error)
        for fit, at, error in _sure(fits, "resistivity") if fit.name not in unsound
    )  # fmt: skip
    return {fit.name: AllowedValues(at - reach, at + reach, print=fit.print_) for fit, at, reach in known}


def by_group(groups: Mapping[str, Sequence[tuple[AllowedValues, bool]]], material: str) -> Iterator[GroupError]:
    """Readings of each group beside the resistivity of all other groups.

    Parameters
    ----------
    groups : mapping of str to sequence of (AllowedValues, bool)
        Readings of a group, and whether the electrode is sound: others are predicted, but not fitted to.
    material : str
        Of the electrodes.
    """
    for name, group in groups.items():
        rest = [reading for other, of in groups.items() if other != name for reading, sound in of if sound]
        if isinstance(fitted := resistivity(rest, material), Fitted):
            low, high = log(fitted.low), log(fitted.high)
            inside = sum(reading.low <= high and reading.high >= low for reading, _ in group)
            ratio = exp(float(np.median([(reading.low + reading.high) / 2 for reading, _ in group]))) / fitted.value
            yield GroupError(name, len(group), inside, ratio, fitted.value, fitted.low, fitted.high)


def _medians(values: Real, seed: int) -> Real:
    """Medians of n values drawn from n again and again (bootstrap).

    Which of the sorted specimens is the median of a draw is drawn itself: the k-th of n even random numbers follows
    a beta distribution, and the one after it is the least of the n - k that are larger.
    """
    count, rng = len(values), np.random.default_rng(seed)
    lower = rng.beta((count + 1) // 2, count - (count + 1) // 2 + 1, _DRAWS)
    upper = lower if count % 2 else lower + (1 - lower) * rng.beta(1, count // 2, _DRAWS)
    ranks = [np.minimum((u * count).astype(np.intp), count - 1) for u in (lower, upper)]
    ordered = np.sort(values)
    return np.asarray((ordered[ranks[0]] + ordered[ranks[1]]) / 2)


def leak(readings: Sequence[AllowedValues], material: str, seed: int) -> Fitted | Untold:
    """Leak per area, where it scatters little enough to be anything of the material's."""
    known = np.array([r.leak for r in readings if not isnan(r.leak)])
    if len(known) < LEAST:
        return Untold("leak", f"{len(known)} readings of films; expected {LEAST} or more")
    if tight := np.isinf(known).sum():
        return Untold("leak", f"{tight} of {len(known)} films are tight: no property of {material}")
    middle, spread = float(np.median(known)), float(np.exp(np.median(np.abs(known - np.median(known)))))
    if spread > _PROPERTY:
        least, most = np.exp(known.min()), np.exp(known.max())
        return Untold(
            "leak",
            f"{len(known)} specimens leak, if evenly, by {least:.2g} to {most:.2g} S/m2, median {np.exp(middle):.2g}; "
            f"half of them by more than {spread:.3g} times more or less: single bridges, and no property of {material}",
        )
    outer = np.percentile(_medians(known, seed), 100 * np.array([(1 - LEVEL) / 2, (1 + LEVEL) / 2]))
    return Fitted(
        material, FILM_LEAK, exp(middle), exp(outer[0]), exp(outer[1]),
        f"R_Z of {len(known)} specimens, taken to leak evenly",
    )  # fmt: skip


MODULUS = "youngs_modulus_pa"
_SURE = 2.0  # standard errors on either side of a value
_UNSURE = log(3.0)  # standard error of a logarithm from which on the data do not tell
_BETWEEN, _WEIGHT = 0.1, 3  # prior of the scatter of ln of a value between prints: its size, worth so many of them
_OPEN = 0.95  # of the prior's standard deviation, from which on nothing was learnt of the leak
_LEAST = 1e-3  # of a parameter's variance that readings must have taken away: with less they say nothing
_SOFTER = 1.05  # factor on a force, to see how the rise depends on it

Estimate = tuple[float, float]  # with its standard error


@dataclass(frozen=True, eq=False)
class OfSpecimen:
    """Evidence of a specimen: ln of factors to the prediction, with standard errors; leak of the whole film [S]."""

    name: str
    print_: str
    of: Movable
    resistivity: Estimate
    capacitance: Estimate
    leak_s: Estimate | None
    stiffness: Estimate | None


def of_specimen(known: SpecimenEntries, print_: str, of: Movable) -> OfSpecimen:
    """Calibrate a specimen, and take what its readings say.

    Parameters
    ----------
    known : SpecimenEntries
        What the log has of it.
    print_ : str
        Name of its print bed; its own if that is unknown.
    of : Movable
        Its body.
    """
    model, posterior = known.model, calibrated(known.model, known.data)
    k = model.names.index("leak")
    sd = sqrt(posterior.covariance[k, k])
    leak, c = (float(model.value(name, posterior.at)) for name in ("leak", "capacitance"))
    siemens = leak * 2 * pi * float(model.frequency_hz.min()) * c * model.sensor.capacitance_f()
    error = siemens * (exp(_SURE * model.spread.leak_spread * sd) - 1) / _SURE
    stiffness = _stiffness(known, posterior) if len(known.data.presses.force_n) >= 3 else None
    return OfSpecimen(
        known.specimen, print_, of, _alone(model, posterior, "resistance"), _alone(model, posterior, "capacitance"),
        (siemens, error) if sd < _OPEN else None, stiffness,
    )  # fmt: skip


def _alone(model: SpecimenModel, posterior: Posterior, name: str) -> Estimate:
    """Ln of a factor by the readings without the prior."""
    k, scale = model.names.index(name), getattr(model.spread, name)
    (information,), (pull,) = posterior.part([k]).beyond(standard(1))
    if information[0] / (1 + information[0]) <= _LEAST:
        return 0.0, inf
    return float(scale * pull / information[0]), float(scale / sqrt(information[0]))


def _stiffness(known: SpecimenEntries, posterior: Posterior) -> Estimate:
    """Ln of one factor on all moduli by the rise at each force, whose own deviations from the law are marginalised."""
    model, sensor = known.model, known.model.sensor
    weights = model.law_weights()
    before = standard(len(model.names)).of(weights)
    by_readings, pull = posterior.of(weights).beyond(before)
    pull += by_readings.sum(1) * model.spread.law_middle  # over the predicted rise
    common = weights[:, model.names.index("rise")]
    shape = np.linalg.inv(before.covariance - np.outer(common, common))
    through = shape @ np.linalg.inv(by_readings + shape)
    slope = -_slopes(model)  # a film that is stiffer by a factor answers as to a weaker press
    in_range = np.array(FORCES_N) <= sensor.width_m * sensor.tip_m * model.most_pa
    slope = np.where(in_range, slope, 0.0)
    information = float(slope @ through @ by_readings @ slope)
    return (float(slope @ through @ pull) / information, 1 / sqrt(information)) if information > 0 else (0.0, inf)


def _slopes(model: SpecimenModel) -> Real:
    """Of ln of the predicted rise over ln force at ``FORCES_N``."""
    sensor = model.sensor

    def rise(force_n: Real) -> Real:
        share, _ = sensor.compression.capacitive_strain(force_n / (sensor.width_m * sensor.tip_m))
        return np.log(share / (1 - share))

    force = np.minimum(np.array(FORCES_N), sensor.width_m * sensor.tip_m * model.most_pa / _SOFTER)
    return np.asarray((rise(force * _SOFTER) - rise(force)) / log(_SOFTER))


def values(fits: Sequence[OfSpecimen]) -> list[Fitted | Untold]:
    """Values by all recordings, of equal weight."""
    if not fits:
        none = "no recording of the bench: resistances at direct current do not depend on it"
        return [Untold(PERMITTIVITY, none), Untold(MODULUS, none)]
    film = fits[0].of.film
    return [_permittivity(fits, film), _modulus(fits, film), _leak(fits, film)]


def _sure(fits: Sequence[OfSpecimen], name: str) -> list[tuple[OfSpecimen, float, float]]:
    """Specimens whose readings determine a factor, with its ln and the standard error of that."""
    known = ((fit, getattr(fit, name)) for fit in fits)
    return [(fit, *estimate) for fit, estimate in known if estimate and estimate[1] < _UNSURE]


def _value(material: str, quantity: str, ln: Estimate, note: str, count: int) -> Fitted | Untold:
    """A value by the logarithm and its standard error, unless that leaves it open."""
    at, error = ln
    if error > _UNSURE:
        return Untold(quantity, f"{_specimens(count)} leave a factor of {exp(error):.3g} open")
    return Fitted(material, quantity, exp(at), exp(at - _SURE * error), exp(at + _SURE * error), note)


def _specimens(count: int) -> str:
    return f"{count} specimen{'s' * (count != 1)}"


def _modulus(fits: Sequence[OfSpecimen], film: str) -> Fitted | Untold:
    pressed = [
        (fit.print_, (at + log(t.value), error)) for fit, at, error in _sure(fits, "stiffness")
        for t in fit.of.model.values if t.material == film and t.quantity == MODULUS
    ]  # fmt: skip
    if not pressed:
        known = any(fit.stiffness for fit in fits)
        none = "no recording with three presses whose force and position are known"
        return Untold(MODULUS, "known presses do not determine it" if known else none)
    law = f"by the law of compression {fits[0].of.model.sensor.compression.name}; all moduli move together"
    note = f"presses of {_specimens(len(pressed))}, {law}"
    return _value(film, MODULUS, _of_prints(pressed), note, len(pressed))


def _of_prints(pairs: Iterable[tuple[str, Estimate]], usual: float = _BETWEEN) -> Estimate:
    """Mean over prints, and its error for one more print: by the errors or by the scatter of prints, whichever is more.

    Specimens of one plate count as one print: they share its conditions. Few prints tell their own scatter badly: a
    prior stands in for it, and it counts as much more as Student's interval is wider. One print alone therefore never
    gives its own value for the material's.
    """
    from scipy.special import stdtrit

    at, errors = np.array([np.mean(estimates, axis=0) for estimates in by_key(pairs).values()]).T
    own, count = sqrt(float((errors**2).sum())) / len(at), len(at)
    degrees = _WEIGHT + count - 1
    scatter = sqrt((_WEIGHT * usual**2 + float(((at - at.mean()) ** 2).sum())) / degrees)
    wider = float(stdtrit(degrees, (1 + LEVEL) / 2)) / _SURE
    return float(at.mean()), max(own, wider * scatter * sqrt(1 + 1 / count))


def _permittivity(fits: Sequence[OfSpecimen], film: str) -> Fitted | Untold:
    pairs, open_ = list[tuple[str, Estimate]](), 0.0
    for fit, ln_c, error in _sure(fits, "capacitance"):
        factor, curve = fit.of.by_permittivity
        if not curve[0] <= ln_c <= curve[-1]:
            low, high = (fit.of.permittivity * exp(end) for end in (factor[0], factor[-1]))
            return Untold(
                PERMITTIVITY,
                f"{fit.name} has {exp(ln_c):.3g} times the predicted capacitance; a permittivity of {low:.3g} to "
                f"{high:.3g} makes none",
            )
        slope, at = (float(np.interp(ln_c, curve, of)) for of in (np.gradient(curve, factor), factor))
        c = fit.of.model.rest.capacitance  # what model and print leave open
        open_ = max(open_, log(c.model.upper / c.model.lower * c.print.upper / c.print.lower) / 2 / _SURE / slope)
        pairs.append((fit.print_, (log(fit.of.permittivity) + at, error / slope)))
    if not pairs:
        return Untold(PERMITTIVITY, "no reading of a specimen depends on it")
    at, between = _of_prints(pairs)
    error = between + open_  # bounds of a model do not average out, and prints scatter about their ends too
    note = f"Im Z of {_specimens(len(pairs))}; the interval holds 95 % of prints and the bounds of the cell's model"
    return _value(film, PERMITTIVITY, (at, error), note, len(pairs))


def _leak(fits: Sequence[OfSpecimen], film: str) -> Fitted | Untold:
    """Per area, where it stands out of its error in every recording."""
    areas = [fit.of.model.sensor.length_m * fit.of.model.sensor.width_m for fit in fits]
    pairs = [
        (fit.print_, (fit.leak_s[0] / a, fit.leak_s[1] / a)) for fit, a in zip(fits, areas, strict=True) if fit.leak_s
    ]
    if not pairs:
        return Untold("leak", "no reading of a specimen depends on it")
    count = _specimens(len(pairs))
    if any(at < _SURE * error for _, (at, error) in pairs):
        most = max(at + _SURE * error for _, (at, error) in pairs)
        return Untold("leak", f"in {count} no more than {most:.2g} S/m2, and none of it certain")
    at, error = _of_prints(pairs, _BETWEEN * float(np.mean([at for _, (at, _) in pairs])))
    if at <= _SURE * error:
        return Untold("leak", f"{count} differ too much: {at:.2g} S/m2, give or take {error:.2g}")
    note = f"Z of {count} at their lowest tones"
    return Fitted(film, FILM_LEAK, at, at - _SURE * error, at + _SURE * error, note)
