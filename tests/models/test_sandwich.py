"""Plates between electrodes that they stretch, against finite elements of another program."""

import json
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.errors import OutOfRange
from sensorgen.models import compression, sandwich

PLATES = json.loads((Path(__file__).parents[1] / "reference" / "bonded_plates.json").read_text())["plates"]
E, BULK = 6e6, 6e6 / (3 * (1 - 2 * 0.4999))


def modulus(width_mm, film_mm, electrode_mm, base="bonded", electrode_pa=22e6):
    electrodes = {"electrode_pa": (electrode_pa,) * 2, "electrode_m": (electrode_mm * 1e-3,) * 2}
    return sandwich.modulus_pa(E, width_mm * 1e-3, film_mm * 1e-3, BULK, **electrodes, base=base) / E


@pytest.mark.parametrize("plate", PLATES, ids=lambda p: "-".join(str(v) for v in p.values()))
def test_the_modulus_is_that_of_finite_elements(plate):
    width, film, electrode, base, top, expected = plate.values()
    if not electrode:
        stiff = compression.bonded(E, width * 1e-3, film * 1e-3, BULK)
        assert stiff.modulus_pa / E == pytest.approx(expected, rel=0.02)
        return
    found = modulus(width, film, electrode, "bonded" if base == "held" else "sliding")
    if top == "rigid":
        assert found == pytest.approx(expected, rel=0.04)
    else:  # between a base that slides and faces that are stiff
        assert modulus(width, film, electrode, "sliding") * 0.97 < expected < 1.04 * found


def test_stiff_electrodes_are_stiff_faces():
    stiff = compression.bonded(E, 0.01, 6e-4, BULK).modulus_pa / E
    assert modulus(10, 0.6, 1e-3, electrode_pa=1e16) == pytest.approx(stiff, rel=1e-3)


def test_between_fixed_sides_the_bulk_decides():
    nu = 0.45
    expected = E * (1 - nu) / (1 + nu) / (1 - 2 * nu)
    assert compression.symmetric(E, nu).modulus_pa == pytest.approx(expected)
    with pytest.raises(OutOfRange, match=r"below 0\.5"):
        compression.symmetric(E, 0.5)


def test_a_compressible_plate_is_never_stiffer_than_its_bulk():
    widths = np.geomspace(1e-4, 10, 20)
    moduli = [compression.bonded(E, w, 6e-4, BULK).modulus_pa for w in widths]
    assert (np.diff(moduli) > 0).all()
    assert moduli[-1] == pytest.approx(BULK + 4 / 3 * E, rel=3e-3)


def test_a_size_that_is_none_is_refused():
    with pytest.raises(OutOfRange, match="above 0"):
        modulus(0, 0.6, 0.3)
