"""The solution of the line's equations by exponentials, and the transfer matrix: B.20 to B.48, B.52, B.53."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.verification.thesis.checks._field import (
    AREA_M2,
    GAMMA,
    HEIGHT_M,
    INPUT_V,
    LENGTH_M,
    LINE,
    PLACES_M,
    RHO_OHM_M,
    WIDTH_M,
    K,
)
from sensorgen.verification.thesis.verdicts import Part

Complex = NDArray[np.complex128]

_X = PLACES_M
_E = np.exp(K * LENGTH_M)
_ROOT = np.sqrt(GAMMA)
_HW = HEIGHT_M * WIDTH_M


def _parts(name: str, unit: str, ours: ArrayLike, printed: ArrayLike, corrected: ArrayLike | None = None) -> list[Part]:
    """Real and imaginary part by themselves: of an impedance, the real one is small and all that tells a position."""
    return [
        Part(f"{which} {name}", unit, part(ours), part(printed), None if corrected is None else part(corrected))
        for which, part in (("Re", np.real), ("Im", np.imag))
    ]


def _coefficients() -> tuple[float, float, complex, complex]:
    """B1 to B4 by B.31, B.37 and B.38, and the vanishing B2."""
    b4 = (-2 * LINE.input_a * RHO_OHM_M + _HW * INPUT_V * K) / (4 * _HW * K)
    return INPUT_V / 2, 0.0, INPUT_V / 2 - b4, b4


def _apart() -> tuple[complex, complex]:
    """B3 and B4 as the field has them at x = 0: sum and slope of the difference."""
    half, slope = complex(LINE.difference_v.at(0.0)) / 2, complex(LINE.difference_v.at(0.0, order=1)) / 2
    return half / 2 - slope / (2 * K), half / 2 + slope / (2 * K)


def eigenvalue_problem() -> list[Part]:
    """B.20, B.21: the matrix applied to the potentials gives their second derivatives."""
    matrix = np.array([[GAMMA, -GAMMA], [-GAMMA, GAMMA]])
    bends = matrix @ np.array([LINE.top_v(_X), LINE.bottom_v(_X)])
    return [Part("d2U/dx2", "V/m2", np.array([LINE.top_v(_X, order=2), LINE.bottom_v(_X, order=2)]), bends)]


def general_solution() -> list[Part]:
    """B.22, B.23: both potentials lie in what 1, x and two exponentials span."""
    basis = np.stack([np.ones_like(_X), _X, np.exp(K * _X), np.exp(-K * _X)], -1)
    places = np.linspace(0.0, LENGTH_M, 9)
    wide = np.stack([np.ones_like(places), places, np.exp(K * places), np.exp(-K * places)], -1)
    top, bottom = (np.linalg.solve(basis, u(_X)) for u in (LINE.top_v, LINE.bottom_v))
    return [
        Part("U1(x)", "V", LINE.top_v(places), wide @ top),
        Part("U2(x)", "V", LINE.bottom_v(places), wide @ bottom),
    ]


def eigenvalues() -> list[Part]:
    """B.25: the field's own rate of growth, and the eigenvalues of the matrix."""
    ours = np.sqrt(np.mean(LINE.difference_v.at(_X, order=2) / LINE.difference_v.at(_X)))
    found = np.linalg.eigvals(np.array([[GAMMA, -GAMMA], [-GAMMA, GAMMA]]))
    return [
        Part("lambda 3", "1/m", ours, K),
        Part("lambda 1, 2", "1/m", 0.0, np.sqrt(min(abs(found))), scale=float(abs(K))),
    ]


def eigenvectors() -> list[Part]:
    """B.27: what changes along the line is opposite on both tracks, and their sum changes evenly."""
    top, bottom = LINE.top_v(_X, order=2), LINE.bottom_v(_X, order=2)
    return [
        Part("d2U2/dx2 : d2U1/dx2", "", np.mean(bottom / top), -1.0),
        Part("d2(U1+U2)/dx2", "V/m2", np.max(abs(top + bottom)), 0.0, scale=float(np.max(abs(top)))),
    ]


def by_vectors() -> list[Part]:
    """B.24."""
    b1, b2, b3, b4 = _coefficients()
    change = b3 * np.exp(-K * _X) + b4 * np.exp(K * _X)
    return [Part("U1(x)", "V", LINE.top_v(_X), b1 + b2 * _X + change)]


def with_exchanged_exponents() -> list[Part]:
    """B.26, with the coefficients that B.37 and B.38 give."""
    b1, b2, b3, b4 = _coefficients()
    printed = b1 + b2 * _X + b3 * np.exp(K * _X) + b4 * np.exp(-K * _X)
    corrected = b1 + b2 * _X + b3 * np.exp(-K * _X) + b4 * np.exp(K * _X)
    return [Part("U1(x)", "V", LINE.top_v(_X), printed, corrected)]


def both_tracks() -> list[Part]:
    """B.28."""
    b1, _, b3, b4 = _coefficients()
    change = b3 * np.exp(-K * _X) + b4 * np.exp(K * _X)
    return [
        Part("U1(x)", "V", LINE.top_v(_X), b1 + change),
        Part("U2(x)", "V", LINE.bottom_v(_X), b1 - change),
    ]


def at_the_contacts() -> list[Part]:
    """B.29 to B.31."""
    b3, b4 = _apart()
    first = INPUT_V / 2
    return [
        Part("U1(0)", "V", LINE.top_v(0.0), first + b3 + b4),
        Part("U2(0)", "V", LINE.bottom_v(0.0), first - b3 - b4, scale=INPUT_V),
        Part("B3 + B4", "V", b3 + b4, first),
    ]


def slope_of_solution() -> list[Part]:
    """B.32."""
    _, _, b3, b4 = _coefficients()
    change = -b3 * K * np.exp(-K * _X) + b4 * K * np.exp(K * _X)
    return [
        Part("dU1/dx", "V/m", LINE.top_v(_X, order=1), change),
        Part("dU2/dx", "V/m", LINE.bottom_v(_X, order=1), -change),
    ]


def currents() -> list[Part]:
    """B.33 to B.35, at places where there is a current: at L it is 0."""
    _, b2, b3, b4 = _coefficients()
    down, up = b3 * K * np.exp(-K * _X), b4 * K * np.exp(K * _X)
    ours = LINE.current_a.at(_X)
    return [
        Part("I1", "A", ours, _HW / RHO_OHM_M * (-b2 + down - up)),
        Part("I2", "A", -ours, _HW / RHO_OHM_M * (-b2 - down + up)),
    ]


def input_current() -> list[Part]:
    """B.36, with the coefficients of the field."""
    b3, b4 = _apart()
    return [Part("I_in", "A", LINE.input_a, _HW / RHO_OHM_M * (b3 * K - b4 * K))]


def growing() -> list[Part]:
    """B.37."""
    printed = (-2 * LINE.input_a * RHO_OHM_M + _HW * INPUT_V * K) / (4 * _HW * K)
    return [Part("B4", "V", _apart()[1], printed)]


def fading() -> list[Part]:
    """B.38."""
    top = np.sqrt(2) * LINE.input_a * RHO_OHM_M + HEIGHT_M * _ROOT * INPUT_V * WIDTH_M
    return [Part("B3", "V", _apart()[0], top / (4 * HEIGHT_M * _ROOT * WIDTH_M))]


def _behind(x_m: float, current: float) -> tuple[complex, complex]:
    """U and I behind a piece of the line of which any current flows into, by the impedances of the piece."""
    same, a12, a21 = LINE.transfer(x_m)
    return complex(same * INPUT_V + a12 * current), complex(a21 * INPUT_V + same * current)


_ANY_A = 1e-5  # a current that leaves something at the end, unlike the open line's own


def output_current() -> list[Part]:
    """B.39."""

    def by(sign: float) -> complex:
        first = 2 * (1 + _E**2) * _ANY_A * RHO_OHM_M
        second = np.sqrt(2) * (-1 + _E**2) * HEIGHT_M * _ROOT * INPUT_V * WIDTH_M
        return complex(_HW / _E * (first + sign * second) / (4 * HEIGHT_M * RHO_OHM_M * WIDTH_M))

    return [Part("I_out", "A", _behind(LENGTH_M, _ANY_A)[1], by(1.0), by(-1.0))]


def potentials_at_the_end() -> list[Part]:
    """B.40, B.41."""
    b1, _, b3, b4 = _coefficients()
    change = b3 / _E + b4 * _E
    return [
        Part("U1(L)", "V", LINE.top_v(LENGTH_M), b1 + change),
        Part("U2(L)", "V", LINE.bottom_v(LENGTH_M), b1 - change),
    ]


def output_voltage() -> list[Part]:
    """B.42."""

    def by(gamma: complex) -> complex:
        first = -np.sqrt(2) * (-1 + _E**2) * _ANY_A * RHO_OHM_M
        second = (1 + _E**2) * HEIGHT_M * gamma * INPUT_V * WIDTH_M
        return complex((first + second) / _E / (2 * HEIGHT_M * gamma * WIDTH_M))

    return [Part("U_out", "V", _behind(LENGTH_M, _ANY_A)[0], by(complex(GAMMA)), by(complex(_ROOT)))]


def _printed(length_m: float) -> tuple[complex, complex, complex, complex]:
    """A11, A12, A21, A22 by B.44 to B.47."""
    e = np.exp(K * length_m)
    same = (1 + e**2) / (2 * e)
    a12 = -(e**2 - 1) / e * RHO_OHM_M / (K * _HW)
    a21 = -(e**2 - 1) / e * _ROOT * _HW / (2 * np.sqrt(2) * RHO_OHM_M)
    return complex(same), complex(a12), complex(a21), complex(same)


def transfer() -> list[Part]:
    """B.43: the matrix takes the line's input to its field further on."""
    x = float(_X[2])
    a11, a12, a21, a22 = _printed(x)
    return [
        Part("U", "V", LINE.difference_v.at(x), a11 * INPUT_V + a12 * LINE.input_a),
        Part("I", "A", LINE.current_a.at(x), a21 * INPUT_V + a22 * LINE.input_a),
    ]


def first_element() -> list[Part]:
    """B.44, B.47."""
    return _parts("A11", "", LINE.transfer(LENGTH_M)[0], _printed(LENGTH_M)[0])


def second_element() -> list[Part]:
    """B.45."""
    return _parts("A12", "ohm", LINE.transfer(LENGTH_M)[1], _printed(LENGTH_M)[1])


def third_element() -> list[Part]:
    """B.46."""
    return _parts("A21", "S", LINE.transfer(LENGTH_M)[2], _printed(LENGTH_M)[2])


def matrix() -> list[Part]:
    """B.48: its third element has a root that goes too far."""
    a21 = -(_E**2 - 1) / _E * _ROOT * _HW / (2 * np.sqrt(2 * RHO_OHM_M))
    return [
        Part("A11", "", LINE.transfer(LENGTH_M)[0], _printed(LENGTH_M)[0]),
        Part("A12", "ohm", LINE.transfer(LENGTH_M)[1], _printed(LENGTH_M)[1]),
        Part("A21", "S", LINE.transfer(LENGTH_M)[2], a21, _printed(LENGTH_M)[2]),
    ]


def no_output() -> list[Part]:
    """B.52, with the elements as printed and the line's own current."""
    _, _, a21, a22 = _printed(LENGTH_M)
    return [Part("A21 U_in : A22 I_in", "", -1.0, np.real(a21 * INPUT_V / (a22 * LINE.input_a)))]


def whole() -> list[Part]:
    """2.18, B.53."""
    e = np.exp(2 * np.sqrt(2 * GAMMA) * LENGTH_M)
    printed = np.sqrt(2) * RHO_OHM_M * (1 + e) / (AREA_M2 * _ROOT * (-1 + e))
    return _parts("Z", "ohm", LINE.impedance_ohm, printed)
