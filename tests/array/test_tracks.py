"""Arrays of crossing tracks: 40 digits, ngspice, another formulation, closed forms, faults."""

import json
from pathlib import Path

import numpy as np
import pytest
from array_network import by_currents, by_ngspice

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.solvers.tracks import READOUTS, Tracks, readings

CASES = json.loads((Path(__file__).parents[1] / "reference" / "array.json").read_text("utf-8"))["cases"]


def of_case(case) -> Tracks:
    ohm = {f"{side}_ohm": case[f"{side}_ohm_per_stretch"] for side in ("row", "column")}
    tracks = Tracks.uniform(np.array(case["capacitance_f"]), tan_delta=case["tan_delta"], **ohm)
    for side, track, after in case["broken"]:
        tracks = tracks.broken(side, track, after)
    for row, column in case["short_1kohm"]:
        tracks = tracks.shorted(row, column, 1000.0)
    return tracks


def some(rows=5, columns=4, ohm=2000.0) -> Tracks:
    draw = np.random.default_rng(3)
    return Tracks.uniform(
        draw.uniform(5e-12, 8e-12, (rows, columns)), row_ohm=ohm, column_ohm=0.7 * ohm, lead_ohm=300.0, tan_delta=0.02
    )


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_networks_in_40_digits(case):
    found = readings(of_case(case), case["frequency_hz"], readout=case["readout"], input_ohm=case["input_ohm"])
    true = np.array(case["siemens_re"]) + 1j * np.array(case["siemens_im"])
    assert found.siemens.real == pytest.approx(true.real, rel=1e-11)
    assert found.siemens.imag == pytest.approx(true.imag, rel=1e-11)


def test_ngspice_solves_the_same_array(program, tmp_path):
    program("ngspice", "ngspice")
    tracks = Tracks.uniform(some(6, 6).capacitance_f, row_ohm=4000.0, column_ohm=3000.0, tan_delta=0.02)
    tracks = tracks.broken("row", 1, 2).broken("column", 4, 0).shorted(3, 2, 1000.0)
    found = readings(tracks, 99.7e3, input_ohm=50.0).siemens
    theirs = by_ngspice(tracks, 99.7e3, 50.0, tmp_path)
    assert np.abs(found - theirs).max() < 1e-9 * np.abs(theirs).max()
    assert np.abs(found / theirs - 1).max() < 1e-8


@pytest.mark.parametrize(("readout", "shape"), [(READOUTS[0], (5, 4)), (READOUTS[1], (3, 6))])
def test_currents_of_crossings_agree_and_so_do_slopes(readout, shape):
    tracks, two = some(*shape), readout == "two-terminal"
    found = readings(tracks, 50e3, readout=readout)
    true = by_currents(tracks, 50e3, 50.0, two)
    assert found.siemens.ravel() == pytest.approx(true.ravel(), rel=1e-10)
    step, draw = 1e-15, np.random.default_rng(0)
    slopes = np.empty((*shape, *shape), complex)  # of every reading, by every capacitance
    for k in np.ndindex(shape):
        change = np.zeros(shape)
        change[k] = step
        up, down = (Tracks(**vars(tracks) | {"capacitance_f": tracks.capacitance_f + s * change}) for s in (1, -1))
        slopes[(..., *k)] = (by_currents(up, 50e3, 50.0, two) - by_currents(down, 50e3, 50.0, two)) / (2 * step)
    least = 1e-7 * np.abs(slopes).max()
    assert np.abs(found.slopes(1, 2) - slopes[1, 2]).max() < least
    assert np.abs(found.matrix() - slopes.reshape(found.matrix().shape)).max() < least
    change, weight = draw.normal(size=shape), draw.normal(size=shape) + 1j * draw.normal(size=shape)
    assert np.abs(found.change(change) - np.einsum("abcd,cd->ab", slopes, change)).max() < 20 * least
    assert np.abs(found.gradient(weight) - np.einsum("abcd,ab->cd", slopes, weight)).max() < 20 * least


def test_two_terminals_keep_their_real_part_where_the_tracks_conduct_well():
    """Tracks of 0.01 ohm beside crossings of 1e11: the sums of all currents at a node cancel to 1e-13."""
    tracks = Tracks.uniform(np.array([[1e-12, 2e-12], [3e-12, 4e-12]]), row_ohm=0.01, column_ohm=0.01, tan_delta=1e-3)
    found = readings(tracks, 10.0, readout="two-terminal").siemens[0, 0]
    c = 1e-12 + 1 / (1 / 2e-12 + 1 / 4e-12 + 1 / 3e-12)  # itself, and the way round through the three others
    expected = 2j * np.pi * 10.0 * c * (1 - 1e-3j)
    assert found.real == pytest.approx(expected.real, rel=1e-9)
    assert found.imag == pytest.approx(expected.imag, rel=1e-12)


def test_what_is_cut_off_reads_nothing():
    tracks = some()
    lead = tracks.broken("row", 2, -1)
    for readout in READOUTS:
        found = readings(lead, 1e4, readout=readout).siemens
        assert (found[2] == 0).all()
        assert (found[[0, 1, 3, 4]] != 0).all()
    without = Tracks(**vars(tracks) | {"capacitance_f": tracks.capacitance_f * (np.arange(4) != 1)})
    for readout in READOUTS:
        found = readings(without.broken("column", 1, 0), 1e4, readout=readout)
        assert (np.abs(found.siemens[:, 1]) == 0).all()
        assert np.isfinite(found.matrix()).all()


def test_ends_of_the_leads_may_be_anywhere():
    """Turned by half a turn, with its leads, an array has the readings turned."""
    tracks = some()
    back = np.s_[::-1, ::-1]
    turned = Tracks(
        tracks.capacitance_f[back], tracks.row_ohm[back], tracks.column_ohm[back], tracks.row_lead_ohm[::-1],
        tracks.column_lead_ohm[::-1], np.full(5, 3), np.full(4, 4), tracks.tan_delta, tracks.leak_s[back],
    )  # fmt: skip
    for readout in READOUTS:
        one, other = (readings(t, 3e4, readout=readout).siemens for t in (tracks, turned))
        assert one == pytest.approx(other[back], rel=1e-12)


def test_slopes_of_a_mat_need_no_square_of_its_crossings():
    """8448 crossings: the factors of all slopes are 25 MB, the matrix would be 1.1 GB."""
    found = readings(some(96, 88, 200.0), 1e4)
    assert found.by_row.nbytes + found.by_column.nbytes < 26e6
    middle = found.change(np.full((96, 88), 1e-15))
    assert np.abs(middle).min() > 0


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda t: readings(t, 0.0), OutOfRange, "frequency 0 Hz"),
        (lambda t: readings(t, 1e4, input_ohm=0.0), OutOfRange, "input resistance 0 ohm"),
        (lambda t: readings(t, 1e4, readout="passive"), BadInput, "guarded or two-terminal"),
        (lambda t: t.broken("row", 0, 3), OutOfRange, "no stretch after crossing 3"),
        (lambda t: Tracks(**vars(t) | {"row_ohm": t.row_ohm.T}), BadInput, "row_ohm"),
        (lambda t: Tracks(**vars(t) | {"column_ohm": 0 * t.column_ohm}), OutOfRange, "above 0 ohm"),
        (lambda t: Tracks(**vars(t) | {"capacitance_f": -t.capacitance_f}), OutOfRange, "capacitance_f"),
    ],
)
def test_no_network_is_an_error(make, error, words):
    with pytest.raises(error, match=words):
        make(some())
