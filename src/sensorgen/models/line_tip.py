"""The line under a tip that presses unevenly: the patch in pieces, each with its own film and tracks."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import OutOfRange
from sensorgen.models import line
from sensorgen.models._line_inputs import HIGHEST_OHM, far_load
from sensorgen.models._line_slopes import Chain
from sensorgen.models.compression import Compression
from sensorgen.models.pressure import Pieces

SOURCE = line.SOURCE
COST = 0

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Track:
    """A line without a press, per length.

    Attributes
    ----------
    length_m : float
        Of the line [m].
    r_ohm_per_m : float
        Both tracks together [ohm/m].
    rise_ohm_per_m_per_n : float
        What the force on a tip adds under it, on average [ohm/m/N].
    capacitance_f_per_m : float
        Of the film [F/m].
    tan_delta, leak_s_per_m : float
        Of the film [-], [S/m].
    far_end : str or float
        "open", "short", or a resistor [ohm].
    """

    length_m: float
    r_ohm_per_m: float
    rise_ohm_per_m_per_n: float
    capacitance_f_per_m: float
    tan_delta: float
    leak_s_per_m: float
    far_end: str | float


@dataclass(frozen=True)
class Tip:
    """What rests on the line: arrays that broadcast, with derivatives by the tip's position where they have one.

    Attributes
    ----------
    force_n : array
        Force [N].
    left_m, length_m, left_slope, length_slope : array
        Where it begins and how long it is [m], and how both move [-].
    width_m : float
        Across the sensor [m].
    pieces : Pieces
        How its pressure is spread.
    """

    force_n: Real
    left_m: Real
    length_m: Real
    left_slope: Real
    length_slope: Real
    width_m: float
    pieces: Pieces

    def mean_pa(self) -> Real:
        """Mean pressure [Pa]."""
        return np.asarray(self.force_n / (self.width_m * self.length_m))

    def highest_pa(self) -> Real:
        """Pressure of the piece that bears most [Pa]."""
        return np.asarray(self.mean_pa() * self.pieces.pressure.max(axis=-1))


class _Piece(NamedTuple):
    """One piece of the patch, and what a newton and a metre change of it."""

    r_ohm_per_m: Real
    y_s_per_m: Complex
    length_share: float
    contrast: Complex
    by_force: tuple[Real, Complex]
    by_position: tuple[Real, Complex]


def impedance(track: Track, tip: Tip, law: Compression, frequency_hz: Real) -> Complex:
    """Impedance at the contacts [ohm], in the broadcast shape.

    Parameters
    ----------
    track, tip : Track, Tip
        The line and what rests on it.
    law : Compression
        How the film gives way.
    frequency_hz : array
        Tones [Hz].

    Raises
    ------
    OutOfRange
        A pressure beyond the law; a resistance below 0; as :func:`sensorgen.models.line.cascade`.
    """
    return line.cascade(*_sections(track, tip, _pieces(track, tip, law, frequency_hz), frequency_hz), track.far_end)


def response(track: Track, tip: Tip, law: Compression, frequency_hz: Real) -> tuple[Complex, Complex, Complex]:
    """Impedance [ohm] and its exact derivatives by force [ohm/N] and position [ohm/m]; otherwise as :func:`impedance`.

    Notes
    -----
    A tip that moves moves each of its pieces within the unpressed line: between two of them, what one leaves free and
    what the other takes cancel. So each piece tells of position by its own contrast, and without one there is no trace.
    """
    pieces = _pieces(track, tip, law, frequency_hz)
    with np.errstate(all="ignore"):
        chain = Chain(*_sections(track, tip, pieces, frequency_hz), far_load(track.far_end))
        by_force, by_position = np.zeros((), complex), np.zeros((), complex)
        for k, piece in enumerate(pieces, 1):
            by_force = by_force + sum(chain.by_matter(k, *piece.by_force))
            by_position = by_position + tip.left_slope * chain.by_shift(k, piece.contrast)
            if np.any(tip.length_slope):
                longer = piece.length_share * (chain.by_length(k) - chain.by_length(len(pieces) + 1))
                by_position = by_position + tip.length_slope * longer
            by_position = by_position + sum(chain.by_matter(k, *piece.by_position))
    found = np.broadcast_arrays(chain.z, by_force, by_position)
    if not (abs(found[0].sum()) < HIGHEST_OHM and all(np.isfinite(value.sum()) for value in found)):
        raise OutOfRange("no derivative where Z is infinite or beyond double precision")
    return found[0], found[1], found[2]


def _unpressed(track: Track, frequency_hz: Real) -> Complex:
    return np.asarray(track.leak_s_per_m + _susceptance(track, frequency_hz))


def _susceptance(track: Track, frequency_hz: Real) -> Complex:
    return np.asarray((track.tan_delta + 1j) * (2 * np.pi * frequency_hz * track.capacitance_f_per_m))


def _sections(
    track: Track, tip: Tip, pieces: list[_Piece], frequency_hz: Real
) -> tuple[list[Real], list[Complex], list[Real]]:
    """Resistance and admittance per length, and length, from the contacts to the far end."""
    free, away = np.asarray(track.r_ohm_per_m), _unpressed(track, frequency_hz)
    right = np.maximum(track.length_m - tip.left_m - tip.length_m, 0.0)
    lengths = [tip.left_m, *(np.asarray(p.length_share * tip.length_m) for p in pieces), right]
    return [free, *(p.r_ohm_per_m for p in pieces), free], [away, *(p.y_s_per_m for p in pieces), away], lengths


def _pieces(track: Track, tip: Tip, law: Compression, frequency_hz: Real) -> list[_Piece]:
    mean, per_newton = tip.mean_pa(), 1 / (tip.width_m * tip.length_m)
    film, away = _susceptance(track, frequency_hz), _unpressed(track, frequency_hz)
    found = []
    for k, share in enumerate(tip.pieces.length):
        weight, moved = tip.pieces.pressure[..., k], tip.pieces.pressure_slope[..., k]
        thinning, slope = law.thinning(np.asarray(weight * mean))
        by_stress = film * (slope / (1 - thinning) ** 2)
        rise = track.rise_ohm_per_m_per_n * (weight * tip.force_n)
        thinned = film * (thinning / (1 - thinning))
        spread = moved * mean - weight * mean * (tip.length_slope / tip.length_m)
        found.append(
            _Piece(
                np.asarray(track.r_ohm_per_m + rise),
                np.asarray(away + thinned),
                float(share),
                np.asarray(track.r_ohm_per_m * thinned - rise * away),
                (np.asarray(track.rise_ohm_per_m_per_n * weight), np.asarray(by_stress * (weight * per_newton))),
                (np.asarray(track.rise_ohm_per_m_per_n * (moved * tip.force_n)), np.asarray(by_stress * spread)),
            )
        )
    return found
