"""A wrong model is found out: faults planted one at a time turn the verdicts that rest on it."""

from dataclasses import replace

import numpy as np
import pytest

from sensorgen.core.bounds import Interval
from sensorgen.models import columns, compression, line, line_abcd, line_closed, line_fit, line_ladder, thesis_cells
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import compression as compressed
from sensorgen.verification.thesis.checks import _field, inverse, strips, triangles
from sensorgen.verification.thesis.items import CHAPTERS, chapter
from sensorgen.verification.thesis.reproduced import row
from sensorgen.verification.thesis.verdicts import UNEXPLAINED

ITEMS = {(kind, item.number): (name, kind, item) for name in CHAPTERS for kind, item in chapter(name).items()}


@pytest.fixture(autouse=True)
def _anew():
    """What was computed with a sound model does not outlive it, nor the other way round."""

    def forget():
        vars(_field.LINE).clear()
        inverse._readings.cache_clear()

    forget()
    yield
    forget()


def times(factor):
    """An answer that is that many times the sound one."""
    return lambda sound: lambda *given, **more: sound(*given, **more) * factor


def with_more_real_part(sound):
    """A little too much of it, which the modulus hardly shows."""

    def wrong(*given, **more):
        z = sound(*given, **more)
        return z + 1e-3 * np.real(z)

    return wrong


def wider(sound):
    def wrong(*given, **more):
        found = sound(*given, **more)
        return Interval(found.lower * 1.001, found.upper * 1.001)

    return wrong


def further(sound):
    """Top and capacitance move by twice as much."""

    def wrong(*given, **more):
        found = sound(*given, **more)
        rest, *_, last = found.lower_f_per_m2
        moved = tuple(2 * d for d in found.displacement_um)
        return replace(found, displacement_um=moved, lower_f_per_m2=(rest, 2 * last - rest))

    return wrong


# What is wrong; where it is put; and the equations whose verdict it has to turn.
PLANTED = {
    "impedance 0.1 % too large": (
        line, "impedance", times(1.001),
        "2.2 2.3 2.4 2.11 2.12 2.18 2.24 B.2 B.5 B.13 B.14 B.36 B.37 B.38 B.45 B.46 B.48 B.50 B.51 B.53 B.54",
    ),
    "Re Z 0.1 % too large": (line, "impedance", with_more_real_part, "2.18 2.24 B.17 B.25 B.28 B.44 B.51 B.53 B.54"),
    "impedance conjugated": (
        line, "impedance", lambda sound: lambda given: np.conj(sound(given)),
        "2.6 2.8 2.15 2.18 2.24 B.13 B.17 B.20 B.22 B.26 B.39 B.42 B.43 B.47 B.52 B.53 B.54",
    ),
    "short and open exchanged": (
        line, "impedance",
        lambda sound: lambda given: sound(replace(given, far_end={"open": "short"}.get(given.far_end, "open"))),
        "B.2 B.3 B.4 B.53",
    ),
    "a film that is twice as stiff": (
        compression, "unconfined", lambda _: lambda e: compression.Plate("wrong", "", 2 * e), "B.49",
    ),
    "columns 0.1 % too large": (
        columns, "capacitance", wider,
        "2.5 2.7 2.19 2.20 2.21 2.22 2.23 3.9 3.13 3.15 3.16 3.21 3.22 3.25 3.26 3.27 3.30 3.31 3.35 3.37 3.38 3.39 "
        "3.40 3.41 3.42 3.43 3.44 3.45 3.46 3.47 3.48 4.1 6.1 B.9",
    ),
    "flanks of another slope": (
        triangles, "_height_mm", times(1.01), "3.10 3.11 3.20",
    ),
    "capacitance under the dielectric": (
        thesis_cells, "under_dielectric_f_per_m", times(1.00001), "3.19 3.23 3.24 3.35",
    ),
    "3.34 as printed": (
        thesis_cells, "under_cog_f_per_m", lambda sound: lambda p, eps_r, printed=True: sound(p, eps_r, True),
        "3.32 3.33 3.34 3.35",
    ),
    "triangles": (thesis_cells, "triangles_f_per_m2", times(1.00001), "2.10 3.35"),
    "strips": (thesis_cells, "strips_f_per_m2", times(1.00001), "3.36 3.49"),
    "bulging added whole": (
        thesis_cells, "bulging_f_per_m2", lambda sound: lambda p, e, dh=0.0, printed=True: sound(p, e, dh, True),
        "3.54",
    ),
    "bulging that stays": (
        thesis_cells, "bulging_f_per_m2", lambda sound: lambda p, e, dh=0.0, printed=True: sound(p, e, 0.0, True),
        "3.51 3.52 3.53",
    ),
    "another field solver": (triangles, "exact_f_per_m2", times(1.01), "3.35"),
    "another solver of boxes": (strips, "exact_f_per_m2", times(1.01), "3.49"),
    "B.48 as printed in the closed form": (
        line_closed, "impedance", lambda sound: lambda given: sound(given, "B.48"), "B.51",
    ),
    "a textbook's product": (line_abcd, "impedance", with_more_real_part, "B.51"),
    "corner without 2 pi": (line, "corner_frequency_hz", times(2 * np.pi), "2.25"),
    "another resistance of the tracks": (Sensor, "resistance_ohm", times(2.0), "2.9 2.25"),
    "C.1 of another tone": (line_fit, "series", lambda sound: lambda f, z: sound(2 * f, z), "5.1"),
    "C.4 by another slope": (
        line_fit.LineFit, "force_n", lambda sound: lambda self, c: sound(self, c) * 1.001, "C.4 C.5",
    ),
    "C.5 by b^2 + 4 a c": (
        line_fit, "_roots", lambda sound: lambda a, b, c: sound(a, b, -c), "C.5",
    ),
    "what a fit leaves": (line_fit, "_solved", lambda sound: lambda b, w: (sound(b, w)[0], 0.0), "C.3"),
}  # fmt: skip


@pytest.mark.parametrize("fault", PLANTED)
def test_a_fault_turns_every_verdict_that_rests_on_it(fault, monkeypatch):
    place, name, wrong, numbers = PLANTED[fault]
    monkeypatch.setattr(place, name, wrong(getattr(place, name)))
    kept = [n for n in numbers.split() if row(*ITEMS["equation", n]).verdict.word != UNEXPLAINED]
    assert kept == []


@pytest.mark.parametrize(
    ("place", "name", "wrong", "numbers"),
    [
        (line_ladder, "impedance", lambda sound: lambda given, n: sound(given, n, one_sided=True), "2.3 2.4 B.4"),
        (compressed, "answer", further, "6.5 6.8 6.9 6.11 6.12"),
    ],
    ids=["a one-sided ladder", "a cell that gives way twice as much"],
)
def test_a_fault_turns_figures(place, name, wrong, numbers, monkeypatch, rows, cache):
    monkeypatch.setenv("SENSORGEN_CACHE", cache)
    monkeypatch.setattr(place, name, wrong(getattr(place, name)))
    kept = [n for n in numbers.split() if row(*ITEMS["figure", n]).verdict.word != UNEXPLAINED]
    assert kept == []


@pytest.mark.parametrize(
    ("number", "key", "name", "value"),
    [
        ("3.1", "x60", "youngs_modulus_pa", 6.1e6),
        ("3.1", "sizes", "electrode_mm", 0.31),
        ("3.2", "conductivity", "etpu", 1.25),
        ("3.2", "conductivity", "x60", 0.0),
        ("4.1", "etpu", "tensile_strength_pa", 16e6),
        ("4.2", "x60", "cam_dial", 4),
        ("C.1", "resistivity_ohm_m", "top", 0.08),
    ],
)
def test_a_table_that_says_something_else_is_found_out(number, key, name, value):
    of, kind, item = ITEMS["table", number]
    given = item.given | {key: item.given[key] | {name: value}}
    assert row(of, kind, item.model_copy(update={"given": given})).verdict.word == UNEXPLAINED


def test_a_material_that_changes_is_found_out(monkeypatch):
    from sensorgen.design import materials

    sound = materials.load
    stiffer = sound("x60").with_values({"relative_permittivity": 5.0})
    monkeypatch.setattr(materials, "load", lambda name: stiffer if name == "x60" else sound(name))
    assert row(*ITEMS["table", "3.1"]).verdict.word == UNEXPLAINED
