"""The solution of the line's equations by exponentials, and the transfer matrix: B.20 to B.48, B.52, B.53."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.verification.thesis.checks import _field
from sensorgen.verification.thesis.checks._field import GAMMA, INPUT_V, LENGTH_M, LINE, PLACES_M, RHO_OHM_M, K
from sensorgen.verification.thesis.items import ItemPart, Parts

HW = _field.AREA_M2
_X = PLACES_M
_E = np.exp(K * LENGTH_M)
_ROOT = np.sqrt(GAMMA)
_MATRIX = np.array([[GAMMA, -GAMMA], [-GAMMA, GAMMA]])
_ANY_A = 1e-5  # a current that leaves something at the end, unlike the open line's own


def _b4() -> complex:
    """By B.37."""
    return complex((-2 * LINE.input_a * RHO_OHM_M + HW * INPUT_V * K) / (4 * HW * K))


def _waves(x_m: ArrayLike) -> tuple[Any, Any]:
    """Terms of B3 and B4 at places: the wave that fades and the one that grows, by B.37 and B.38."""
    return (INPUT_V / 2 - _b4()) * np.exp(-K * np.asarray(x_m)), _b4() * np.exp(K * np.asarray(x_m))


def _apart() -> tuple[complex, complex]:
    """B3 and B4 as the field has them at x = 0: sum and slope of the difference."""
    half, slope = complex(LINE.difference_v.at(0.0)) / 2, complex(LINE.difference_v.at(0.0, order=1)) / 2
    return half / 2 - slope / (2 * K), half / 2 + slope / (2 * K)


def _behind(x_m: float, current: float) -> tuple[complex, complex]:
    """U and I behind a piece of the line of which any current flows into, by the impedances of the piece."""
    same, a12, a21 = LINE.transfer(x_m)
    return complex(same * INPUT_V + a12 * current), complex(a21 * INPUT_V + same * current)


def _printed(length_m: float) -> tuple[complex, complex, complex]:
    """A11 = A22, A12, A21 by B.44 to B.47."""
    e = np.exp(K * length_m)
    same = (1 + e**2) / (2 * e)
    a12 = -(e**2 - 1) / e * RHO_OHM_M / (K * HW)
    a21 = -(e**2 - 1) / e * _ROOT * HW / (2 * np.sqrt(2) * RHO_OHM_M)
    return complex(same), complex(a12), complex(a21)


def eigenvalue_problem() -> Parts:
    """B.20, B.21: the matrix applied to the potentials gives their second derivatives."""
    bend, potentials = (np.array([LINE.top_v(_X, order), LINE.bottom_v(_X, order)]) for order in (2, 0))
    yield ItemPart("d2U/dx2", "V/m2", bend, _MATRIX @ potentials)


def eigenvalues() -> Parts:
    """B.25: the field's own rate of growth, and the eigenvalues of the matrix."""
    yield ItemPart("lambda 3", "1/m", np.sqrt(np.mean(LINE.difference_v.at(_X, 2) / LINE.difference_v.at(_X))), K)
    yield ItemPart("lambda 1, 2", "1/m", 0.0, np.sqrt(min(abs(np.linalg.eigvals(_MATRIX)))), scale=float(abs(K)))


def by_vectors() -> Parts:
    """B.24: the upper potential along the line."""
    yield ItemPart("U1(x)", "V", LINE.top_v(_X), INPUT_V / 2 + sum(_waves(_X)))


def both_tracks() -> Parts:
    """B.28: both potentials along the line."""
    yield ItemPart("U1(x)", "V", LINE.top_v(_X), INPUT_V / 2 + sum(_waves(_X)))
    yield ItemPart("U2(x)", "V", LINE.bottom_v(_X), INPUT_V / 2 - sum(_waves(_X)))


def potentials_at_the_end() -> Parts:
    """B.40, B.41."""
    yield ItemPart("U1(L)", "V", LINE.top_v(LENGTH_M), INPUT_V / 2 + sum(_waves(LENGTH_M)))
    yield ItemPart("U2(L)", "V", LINE.bottom_v(LENGTH_M), INPUT_V / 2 - sum(_waves(LENGTH_M)))


def with_exchanged_exponents() -> Parts:
    """B.26: its exponents are exchanged."""
    exchanged = INPUT_V / 2 + (INPUT_V / 2 - _b4()) * np.exp(K * _X) + _b4() * np.exp(-K * _X)
    yield ItemPart("U1(x)", "V", LINE.top_v(_X), exchanged, INPUT_V / 2 + sum(_waves(_X)))


def at_the_contacts() -> Parts:
    """B.29 to B.31."""
    yield ItemPart("U1(0)", "V", LINE.top_v(0.0), INPUT_V / 2 + sum(_apart()))
    yield ItemPart("U2(0)", "V", LINE.bottom_v(0.0), INPUT_V / 2 - sum(_apart()), scale=INPUT_V)
    yield ItemPart("B3 + B4", "V", sum(_apart()), INPUT_V / 2)


def input_current() -> Parts:
    """B.36, with the coefficients of the field."""
    yield ItemPart("I_in", "A", LINE.input_a, HW / RHO_OHM_M * K * (_apart()[0] - _apart()[1]))


def growing() -> Parts:
    """B.37."""
    yield ItemPart("B4", "V", _apart()[1], _b4())


def fading() -> Parts:
    """B.38."""
    printed = (np.sqrt(2) * LINE.input_a * RHO_OHM_M + HW * _ROOT * INPUT_V) / (4 * HW * _ROOT)
    yield ItemPart("B3", "V", _apart()[0], printed)


def first_element() -> Parts:
    """B.44, B.47: elements of the transfer matrix on its diagonal."""
    return _field.both_parts("A11", "", LINE.transfer(LENGTH_M)[0], _printed(LENGTH_M)[0])


def second_element() -> Parts:
    """B.45."""
    return _field.both_parts("A12", "ohm", LINE.transfer(LENGTH_M)[1], _printed(LENGTH_M)[1])


def third_element() -> Parts:
    """B.46."""
    return _field.both_parts("A21", "S", LINE.transfer(LENGTH_M)[2], _printed(LENGTH_M)[2])


def general_solution() -> Parts:
    """B.22, B.23: both potentials lie in what 1, x and two exponentials span."""
    places = np.linspace(0.0, LENGTH_M, 9)
    basis, wide = (np.stack([np.ones_like(x), x, np.exp(K * x), np.exp(-K * x)], -1) for x in (_X, places))
    top, bottom = (np.linalg.solve(basis, u(_X)) for u in (LINE.top_v, LINE.bottom_v))
    yield ItemPart("U1(x)", "V", LINE.top_v(places), wide @ top)
    yield ItemPart("U2(x)", "V", LINE.bottom_v(places), wide @ bottom)


def eigenvectors() -> Parts:
    """B.27: of the matrix of B.21; what changes along the line is opposite on both tracks, the rest is alike."""
    values, vectors = np.linalg.eig(_MATRIX)
    alike, opposite = (vectors[1, k] / vectors[0, k] for k in np.argsort(abs(values)))
    yield ItemPart("U2 : U1 of lambda 1, 2", "", alike, 1.0)
    yield ItemPart("U2 : U1 of lambda 3, 4", "", opposite, -1.0)


def slope_of_solution() -> Parts:
    """B.32."""
    fading, growing = _waves(_X)
    yield ItemPart("dU1/dx", "V/m", LINE.top_v(_X, order=1), K * (growing - fading))
    yield ItemPart("dU2/dx", "V/m", LINE.bottom_v(_X, order=1), K * (fading - growing))


def currents() -> Parts:
    """B.33 to B.35, at places where there is a current: at L it is 0."""
    (fading, growing), ours = _waves(_X), LINE.current_a.at(_X)
    printed = HW / RHO_OHM_M * K * (fading - growing)
    yield ItemPart("I1", "A", ours, printed)
    yield ItemPart("I2", "A", -ours, -printed)


def output_current() -> Parts:
    """B.39."""
    first = 2 * (1 + _E**2) * _ANY_A * RHO_OHM_M
    second = np.sqrt(2) * (-1 + _E**2) * HW * _ROOT * INPUT_V
    printed, corrected = (complex((first + sign * second) / _E / (4 * RHO_OHM_M)) for sign in (1, -1))
    yield ItemPart("I_out", "A", _behind(LENGTH_M, _ANY_A)[1], printed, corrected)


def output_voltage() -> Parts:
    """B.42: Gamma stands for its root."""
    first = -np.sqrt(2) * (-1 + _E**2) * _ANY_A * RHO_OHM_M
    second = (1 + _E**2) * HW * INPUT_V
    printed, corrected = (complex((first + second * g) / _E / (2 * HW * g)) for g in (GAMMA, _ROOT))
    yield ItemPart("U_out", "V", _behind(LENGTH_M, _ANY_A)[0], printed, corrected)


def transfer() -> Parts:
    """B.43: the matrix takes the line's input to its field further on."""
    x = float(_X[2])
    same, a12, a21 = _printed(x)
    yield ItemPart("U", "V", LINE.difference_v.at(x), same * INPUT_V + a12 * LINE.input_a)
    yield ItemPart("I", "A", LINE.current_a.at(x), a21 * INPUT_V + same * LINE.input_a)


def matrix() -> Parts:
    """B.48: its third element has a root that goes too far."""
    too_far = -(_E**2 - 1) / _E * _ROOT * HW / (2 * np.sqrt(2 * RHO_OHM_M))
    (same, a12, a21), ours = _printed(LENGTH_M), LINE.transfer(LENGTH_M)
    yield ItemPart("A11", "", ours[0], same)
    yield ItemPart("A12", "ohm", ours[1], a12)
    yield ItemPart("A21", "S", ours[2], too_far, a21)


def no_output() -> Parts:
    """B.52, with the elements as printed and the line's own current."""
    same, _, a21 = _printed(LENGTH_M)
    yield ItemPart("A21 U_in : A22 I_in", "", -1.0, np.real(a21 * INPUT_V / (same * LINE.input_a)))


def whole() -> Parts:
    """2.18, B.53."""
    return _field.both_parts("Z", "ohm", LINE.impedance_ohm, _field.unpressed_ohm())
