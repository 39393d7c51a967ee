"""The line under a tip of any pressure profile: the patch in pieces, each with its own film and tracks."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models import line
from sensorgen.models.compression import Compression
from sensorgen.models.pressure import TipPieces, pieces, pressure_slope
from sensorgen.solvers.line.inputs import HIGHEST_OHM, far_load
from sensorgen.solvers.line.slopes import Chain

SOURCE = line.SOURCE
COST = 0


@dataclass(frozen=True)
class RestLine:
    """A line without a press, per length.

    Attributes
    ----------
    length_m : float
        Of the line [m].
    r_ohm_per_m : float
        Both tracks together [ohm/m].
    rise_ohm_per_m_per_pa : float
        What pressure adds to both tracks together [ohm/m/Pa].
    capacitance_f_per_m : float
        Of the film [F/m].
    tan_delta, leak_s_per_m : float
        Of the film [-], [S/m].
    far_end : str or float
        "open", "short", or a resistor [ohm].
    """

    length_m: float
    r_ohm_per_m: float
    rise_ohm_per_m_per_pa: float
    capacitance_f_per_m: float
    tan_delta: float
    leak_s_per_m: float
    far_end: str | float


class ContactSlopes(NamedTuple):
    """Derivatives of the contact by force [per N] or position [per m]."""

    left: Real
    """Of where it begins [m/N] or [-]."""
    length: Real
    """Of its length [m/N] or [-]."""
    pressure: Real
    """Of the pressure of each piece over the mean [1/N] or [1/m]; the last axis counts the pieces."""


@dataclass(frozen=True)
class LineContact:
    """Contact of the tip with the line; arrays broadcast.

    Attributes
    ----------
    force_n : array
        Force [N].
    left_m, length_m : array
        Where it begins and how long it is [m].
    width_m : float
        Across the sensor [m].
    pieces : TipPieces
        How its pressure is spread.
    by_force, by_position : ContactSlopes
        How all this moves.
    """

    force_n: Real
    left_m: Real
    length_m: Real
    width_m: float
    pieces: TipPieces
    by_force: ContactSlopes
    by_position: ContactSlopes

    def mean_pa(self) -> Real:
        """Mean pressure [Pa]."""
        return np.asarray(self.force_n / (self.width_m * self.length_m))

    def highest_pa(self) -> Real:
        """Pressure of the piece that bears most [Pa]."""
        return np.asarray(self.mean_pa() * self.pieces.pressure.max(axis=-1))


def resting(
    line_m: float,
    width_m: float,
    cut_as: tuple[str, int],
    force_n: Real,
    position_m: Real,
    contact_m: tuple[Real, Real],
) -> LineContact:
    """A tip centred at a position, its contact cut at the ends of the line, and into pieces.

    Parameters
    ----------
    line_m, width_m : float
        Length and width of the line [m].
    cut_as : (str, int)
        Profile of the pressure, and number of pieces.
    force_n, position_m : array
        Force [N] and centre of the tip [m].
    contact_m : (array, array)
        Length of the contact as if the line had no ends [m], and its derivative by the force [m/N].

    Notes
    -----
    A contact that an end cuts carries the whole force on what is left of it.
    """
    (whole, grows), at = contact_m, position_m
    low, high = at - whole / 2, at + whole / 2
    over = low < 0, high > line_m
    if not (over[0].any() or over[1].any()):
        still = np.zeros(cut_as[1])
        by_force, by_position = ContactSlopes(-grows / 2, grows, still), ContactSlopes(np.ones(()), np.zeros(()), still)
        return LineContact(force_n, low, whole, width_m, pieces(*cut_as), by_force, by_position)
    left, right = np.where(over[0], 0.0, low), np.where(over[1], line_m, high)
    shares = -at / whole, (line_m - at) / whole  # where the line ends, from the middle of the tip
    ends = np.where(over[0], 0.5 + shares[0], 0.0), np.where(over[1], 0.5 + shares[1], 1.0)

    def motion(edges: tuple[Real, Real], share_slopes: tuple[Real, Real]) -> ContactSlopes:
        by_left, by_right = (np.where(o, 0.0, edge) for o, edge in zip(over, edges, strict=True))
        by_begin, by_end = (np.where(o, slope, 0.0) for o, slope in zip(over, share_slopes, strict=True))
        return ContactSlopes(by_left, by_right - by_left, pressure_slope(*cut_as, ends, (by_begin, by_end)))

    one = np.ones(())
    by_force = motion((-grows / 2, grows / 2), (-shares[0] * grows / whole, -shares[1] * grows / whole))
    by_position = motion((one, one), (-1 / whole, -1 / whole))
    length = np.where(over[0] | over[1], right - left, whole)
    return LineContact(force_n, left, length, width_m, pieces(*cut_as, ends), by_force, by_position)


class _PatchPiece(NamedTuple):
    """One piece of the patch, and its derivatives by force and position."""

    r_ohm_per_m: Real
    y_s_per_m: Complex
    length_share: float
    contrast: Complex
    by_force: tuple[Real, Complex]
    by_position: tuple[Real, Complex]


def impedance(track: RestLine, tip: LineContact, law: Compression, frequency_hz: Real) -> Complex:
    """Impedance at the contacts [ohm], in the broadcast shape.

    Parameters
    ----------
    track, tip : RestLine, LineContact
        The line and what rests on it.
    law : Compression
        Capacitive strain of the film over pressure.
    frequency_hz : array
        Frequencies [Hz].

    Raises
    ------
    OutOfRange
        A pressure beyond the law; a resistance below 0; as :func:`sensorgen.models.line.cascade`.
    """
    return line.cascade(*_sections(track, tip, _pieces(track, tip, law, frequency_hz), frequency_hz), track.far_end)


def response(
    track: RestLine, tip: LineContact, law: Compression, frequency_hz: Real
) -> tuple[Complex, Complex, Complex]:
    """Impedance [ohm] and its exact derivatives by force [ohm/N] and position [ohm/m]; otherwise as :func:`impedance`.

    Notes
    -----
    A moving tip shifts each of its pieces within the unpressed line; contributions between two neighbours cancel. So
    Z depends on position by the contrast of each piece, and not at all without one.
    """
    pieces = _pieces(track, tip, law, frequency_hz)
    with np.errstate(all="ignore"):
        chain = Chain(*_sections(track, tip, pieces, frequency_hz), far_load(track.far_end))
        by_force = _along(chain, pieces, tip.by_force, [piece.by_force for piece in pieces])
        by_position = _along(chain, pieces, tip.by_position, [piece.by_position for piece in pieces])
    whole = np.broadcast_arrays(chain.z, by_force, by_position)
    if not (abs(whole[0].sum()) < HIGHEST_OHM and all(np.isfinite(value.sum()) for value in whole)):
        raise OutOfRange("no derivative where Z is infinite or beyond double precision")
    return whole[0], whole[1], whole[2]


def _along(
    chain: Chain, pieces: list[_PatchPiece], motion: ContactSlopes, matter: list[tuple[Real, Complex]]
) -> Complex:
    """Derivative of Z as the pieces move, grow, and change their matter."""
    total = np.zeros((), complex)
    moves, grows = np.any(motion.left), np.any(motion.length)
    for k, (piece, change) in enumerate(zip(pieces, matter, strict=True), 1):
        total = total + sum(chain.by_matter(k, *change))
        if moves:
            total = total + motion.left * chain.by_shift(k, piece.contrast)
        if grows:
            longer = piece.length_share * (chain.by_length(k) - chain.by_length(len(pieces) + 1))
            total = total + motion.length * longer
    return total


def _unpressed(track: RestLine, frequency_hz: Real) -> Complex:
    return np.asarray(track.leak_s_per_m + _susceptance(track, frequency_hz))


def _susceptance(track: RestLine, frequency_hz: Real) -> Complex:
    return np.asarray((track.tan_delta + 1j) * (2 * np.pi * frequency_hz * track.capacitance_f_per_m))


def _sections(
    track: RestLine, tip: LineContact, pieces: list[_PatchPiece], frequency_hz: Real
) -> tuple[list[Real], list[Complex], list[Real]]:
    """Resistance and admittance per length, and length, from the contacts to the far end."""
    free, away = np.asarray(track.r_ohm_per_m), _unpressed(track, frequency_hz)
    right = np.maximum(track.length_m - tip.left_m - tip.length_m, 0.0)
    lengths = [tip.left_m, *(np.asarray(p.length_share * tip.length_m) for p in pieces), right]
    return [free, *(p.r_ohm_per_m for p in pieces), free], [away, *(p.y_s_per_m for p in pieces), away], lengths


def _pieces(track: RestLine, tip: LineContact, law: Compression, frequency_hz: Real) -> list[_PatchPiece]:
    mean = tip.mean_pa()
    film, away = _susceptance(track, frequency_hz), _unpressed(track, frequency_hz)
    pieces = []
    for k, share in enumerate(tip.pieces.length):
        weight = tip.pieces.pressure[..., k]
        stress = np.asarray(weight * mean)
        thinning, slope = law.capacitive_strain(stress)
        rise = track.rise_ohm_per_m_per_pa * stress
        thinned = film * (thinning / (1 - thinning))
        by_stress = film * (slope / (1 - thinning) ** 2)
        pieces.append(
            _PatchPiece(
                np.asarray(track.r_ohm_per_m + rise),
                np.asarray(away + thinned),
                float(share),
                np.asarray(track.r_ohm_per_m * thinned - rise * away),
                _matter(track, tip, k, by_stress, tip.by_force, 1.0),
                _matter(track, tip, k, by_stress, tip.by_position, 0.0),
            )
        )
    return pieces


def _matter(
    track: RestLine, tip: LineContact, k: int, by_stress: Complex, motion: ContactSlopes, newtons: float
) -> tuple[Real, Complex]:
    """Change of resistance and admittance of a piece as the tip moves, or as the force grows."""
    weight, moved, mean = tip.pieces.pressure[..., k], motion.pressure[..., k], tip.mean_pa()
    grown = newtons / (tip.width_m * tip.length_m) - mean * (motion.length / tip.length_m)
    stress = moved * mean + weight * grown
    return np.asarray(track.rise_ohm_per_m_per_pa * stress), np.asarray(by_stress * stress)
