r"""Probability that a print of a design is shorted or leaking, from the holes of its film and from the log's verdicts.

.. math:: P = 1 - (1 - r) \\, \\langle (1 - q)^N \\rangle

N is the number of through-holes in the model of round lines, averaged over prints whose layers differ in width by up to
5 % and are shifted by up to 0.05 mm; q, that a hole conducts, with Jeffreys' prior, Beta(1/2, 1/2); r, that a print is
shorted by anything else, with the prior of :func:`elsewhere`, from the prints of series 23. Their G-code is unknown, so
that r counts their holes, too. Both are updated by the log's prints of the same shape and film, without those of Table
D.1. Holes are taken to conduct independently of each other. Without prints the result is the prior.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import shapely

from sensorgen.analysis.plots.figure import ORANGE, Axis, Curve, Figure, Map, Panel
from sensorgen.asprinted.beads import beads, placed
from sensorgen.asprinted.pinholes import CoveredFilm, Pinholes, draws, films, opened, pinholes, through
from sensorgen.core.arrays import Real
from sensorgen.core.document import Facts, Part
from sensorgen.core.errors import BadInput
from sensorgen.core.lazy import by_key
from sensorgen.design.design import Design
from sensorgen.design.printer import load_quality
from sensorgen.design.specimen_name import QUALITIES
from sensorgen.export.gcode.reading import Source
from sensorgen.measure.log import Log
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.log.exchange import thesis_readings
from sensorgen.measure.signal.verdicts import ORDER

CREDIBLE = 0.9  # share of the posterior inside the interval
DRAWS = 16
SERIES = 23  # of Table D.1, whose prints give the prior of r
_RATES, _SEED = 200_000, 23  # draws of rates from their prior
_GRID = 200  # values of q and of r, of equal prior probability
_CELL_MM = 0.5  # of the picture
_PICTURED = 0.95  # width of lines in the picture, of what the file says


Counts = Mapping[tuple[str, int], tuple[int, int]]
"""Prints whose film resistance is low, and all with both resistances, by shape and layers of the film."""


@dataclass(frozen=True)
class Chance:
    """A probability with its credible interval [-]."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True)
class FilmRisk(Pinholes):
    """Holes of a print's films, and the probability of a short.

    Attributes
    ----------
    holes_low, holes_high : float
        Least and most through-holes of the drawn prints [-].
    shorted, prints : int
        Specimens of this shape and film in the log whose film resistance is low, and all with both resistances, without
        those of Table D.1 [-].
    prior, posterior : Chance
        Before and after the log.
    """

    holes_low: float
    holes_high: float
    shorted: int
    prints: int
    prior: Chance
    posterior: Chance

    def document(self) -> Iterator[Part]:
        """Table of holes, and the probability with its assumptions."""
        yield from super().document()
        counted = (
            f"{self.shorted} of {self.prints} prints of this shape and film in the log have a low film resistance"
            if self.prints else f"no print of this shape and film: from holes and series {SERIES}"
        )  # fmt: skip
        assumed = (
            f"{self.holes_low:g} to {self.holes_high:g} holes at widths within 5 % and layers within 0.05 mm; "
            "each conducts with one unknown probability, independently; anything else as in series 23, by shape and "
            "layers, which fail together or one by one"
        )
        by_layers = by_key((layers, counts) for (_, layers), counts in series().items())
        sums = ((layers, *map(sum, zip(*counts, strict=True))) for layers, counts in sorted(by_layers.items()))
        shares = ", ".join(f"{low} of {total} with {layers}" for layers, low, total in sums)
        known = (
            f"low film resistance, at most {ORDER:g} times the electrode's, by layers of the film: {shares}. More "
            f"layers are not shown to help; no print had more than {max(by_layers)}"
        )
        yield Facts((
            ("P(short)", f"{_words(self.posterior)}; {counted}"), ("before", _words(self.prior)),
            (f"series {SERIES}", known), ("assumed", assumed),
        ))  # fmt: skip


def _words(chance: Chance) -> str:
    return f"{chance.mean:.2f}, {chance.low:.2f} to {chance.high:.2f} with {CREDIBLE:.0%} probability"


def risk(design: Design, source: Source, log: Log | None = None) -> tuple[FilmRisk, Figure]:
    """Holes of the films in a file of G-code, probability of a short, and a picture of where the films are open.

    Parameters
    ----------
    design : Design
        That was sliced.
    source : Path, bytes or iterable of str
        The G-code.
    log : Log, optional
        For the verdicts of earlier prints.

    Raises
    ------
    BadInput
        The file prints something else, or the design has no film between electrodes.
    """
    here = placed(design, source)
    holes = pinholes(design, here.paths, here.centre_mm)
    thin = films(design, beads(design, here.paths, here.centre_mm))
    if not thin:
        raise BadInput(f"{design.name} has no film between electrodes; expected a dielectric from edge to edge")
    counts = np.sum([draws(film, DRAWS) for film in thin], axis=0)
    shorted, prints = verdicts(log, design) if log else (0, 0)
    other = elsewhere(design.shape, [len(film.lines) for film in thin])
    whole = FilmRisk(
        **vars(holes), holes_low=float(np.min(counts)), holes_high=float(np.max(counts)), shorted=shorted,
        prints=prints, prior=chance(counts, other, 0, 0), posterior=chance(counts, other, shorted, prints),
    )  # fmt: skip
    return whole, picture(design.name, thin)


def verdicts(log: Log, design: Design) -> tuple[int, int]:
    """Specimens of a design's shape and film in a log whose film resistance is low, and all with both resistances.

    Rows of Table D.1's series 23 are left out: the prior has them.
    """
    film = design.parameters.get("dielectric_mm", getattr(design.params, "dielectric_mm", None))
    counted = {r.uid for r in thesis_readings() if r.iteration == SERIES}
    last = {
        r.specimen: _low(r) for r in log.readings()
        if r.shape == design.shape and r.film_mm == film and r.y_ohm and r.z_ohm and r.uid not in counted
    }  # fmt: skip
    return sum(last.values()), len(last)


def _low(of: Reading) -> bool:
    return min(of.z_ohm) <= ORDER * min(of.y_ohm)


@cache
def series() -> Counts:
    """Counts of series 23 of Table D.1.

    Layers are those of its qualities, or of "fine" where none is noted.

    >>> sum(total for _, total in series().values())
    51
    """
    alike = by_key(
        ((r.shape, round(r.film_mm / load_quality(QUALITIES[r.slicing] or "fine").layer_mm)), _low(r))
        for r in thesis_readings() if r.iteration == SERIES and r.film_mm is not None and r.y_ohm and r.z_ohm
    )  # fmt: skip
    return {key: (sum(low), len(low)) for key, low in alike.items()}


def elsewhere(shape: str, layers: Sequence[int], counts: Counts | None = None) -> Real:
    r"""Probability that a print is shorted by anything but holes: values of equal probability after earlier prints.

    .. math:: r = p^{n^g}, \quad p \sim \mathrm{Beta}(m k, (1 - m) k)

    p is the rate of a shape with one layer and n the number of layers. They fail together with g = 0, and independently
    of each other with g = 1. m, g and k / (1 + k) are uniform from 0 to 1; a shape without prints has the others' m, k.

    Parameters
    ----------
    shape : str
        Shape of the design.
    layers : sequence of int
        Layers of each of its films [-].
    counts : mapping, optional
        Earlier prints; those of :func:`series` if not given.
    """
    from scipy.special import xlog1py, xlogy

    counts, rng = series() if counts is None else counts, np.random.default_rng(_SEED)
    mean, pooled, together = rng.random((3, _RATES))
    alike = pooled / (1 - pooled)
    rates = {s: rng.beta(mean * alike, (1 - mean) * alike) for s in sorted({shape, *(s for s, _ in counts)})}
    weight = np.zeros(_RATES)
    for (s, n), (shorted, prints) in counts.items():
        rate = rates[s] ** (n**together)
        weight += xlogy(shorted, rate) + xlog1py(prints - shorted, -rate)
    sound = np.prod([1 - rates[shape] ** (n**together) for n in layers], axis=0)
    return _quantiles(1 - sound, np.exp(weight - weight.max()), (np.arange(_GRID) + 0.5) / _GRID)


def _quantiles(values: Real, weight: Real, shares: Sequence[float] | Real) -> Real:
    return np.quantile(values, shares, weights=weight, method="inverted_cdf")


def chance(holes: Sequence[float] | Real, other: Real, shorted: int, prints: int) -> Chance:
    """Posterior of the probability that a print is shorted.

    Parameters
    ----------
    holes : sequence of float
        Through-holes of possible prints [-].
    other : (n,) array
        Equally probable values of the probability that anything else shorts it [-].
    shorted, prints : int
        What was seen [-].

    Examples
    --------
    A print without holes is shorted by something else, or not:

    >>> before = chance([0.0], np.array([0.1, 0.5, 0.9]), 0, 0)
    >>> round(before.mean, 2), round(before.low, 2), round(before.high, 2)
    (0.5, 0.1, 0.9)
    """
    from scipy.special import betaincinv, xlog1py, xlogy

    value = betaincinv(0.5, 0.5, (np.arange(_GRID) + 0.5) / _GRID)
    none = np.mean([(1 - value) ** count for count in holes], axis=0)  # no hole conducts
    probability = (1 - none[:, None] * (1 - other)[None, :]).ravel()
    weight = xlogy(shorted, probability) + xlog1py(prints - shorted, -probability)
    weight = np.exp(weight - weight.max())
    low, high = _quantiles(probability, weight, ((1 - CREDIBLE) / 2, (1 + CREDIBLE) / 2))
    return Chance(float((weight * probability).sum() / weight.sum()), float(low), float(high))


def picture(name: str, thin: Sequence[CoveredFilm]) -> Figure:
    """Where films are weakest: what their layers leave open with lines a little narrower than the file says."""
    panels = []
    for film in thin:
        layers = opened(film, [_PICTURED] * len(film.lines))
        x0, y0, x1, y1 = film.plan.bounds
        x, y = (np.arange(low, high, _CELL_MM) for low, high in ((x0, x1), (y0, y1)))
        cells = shapely.box(*np.meshgrid(x, y), *np.meshgrid(x + _CELL_MM, y + _CELL_MM)).ravel()
        pieces = shapely.get_parts(np.array(layers, object))
        cell, piece = shapely.STRtree(pieces).query(cells, predicate="intersects")
        area = shapely.area(shapely.intersection(cells[cell], pieces[piece]))
        open_percent = 100 * np.bincount(cell, area, minlength=len(cells)) / (_CELL_MM**2 * len(layers))
        content: list[Curve | Map] = [
            Map(x + _CELL_MM / 2, y + _CELL_MM / 2, open_percent.reshape(len(y), len(x)), "open, mean of layers [%]")
        ]
        holes = [hole.representative_point() for hole in through(layers)]
        if holes:
            at = np.array([(p.x, p.y) for p in holes])
            content.append(Curve("points", "through-hole", at[:, 0], at[:, 1], colour=ORANGE, symbol="circle-open"))
        title = f"film from {film.span_mm[0]:g} to {film.span_mm[1]:g} mm, lines at {_PICTURED:.0%} of their width"
        panels.append(Panel(tuple(content), Axis("x [mm]"), Axis("y [mm]"), title=title))
    alt = "Plan of each film: share that its layers leave open, and circles where a way leads through"
    return Figure("pinholes", name, alt, {"": tuple(panels)})
