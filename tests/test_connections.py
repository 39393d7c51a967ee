"""Which conductor belongs to which electrode: by touching, not by name."""

from dataclasses import replace

import pytest
import shapely

from sensorgen.scene.connections import connected_layers, connected_scene
from sensorgen.scene.layers import LayerRegions
from sensorgen.scene.scene import FLOATING, Body, Prism, Scene, box


def conducts(material):
    return material == "etpu"


def block(name, *corners, terminal="", material="etpu"):
    return Body(name, material, (box(*corners),), terminal)


LOW = block("low", 0, 4, 0, 4, 0, 1, terminal="bottom")
FILM = block("film", 0, 4, 0, 4, 1, 2, material="x60")
HIGH = block("high", 0, 4, 0, 4, 4, 5, terminal="top")


def terminals(*more):
    found = connected_scene(Scene((LOW, FILM, *more, HIGH), (4.0, 4.0, 5.0)), conducts)
    return {body.name: body.terminal for body in found.bodies}


def test_a_sensor_that_is_connected_as_it_is_named_stays_itself():
    scene = Scene((LOW, FILM, block("cog", 1, 2, 1, 2, 3, 4, terminal="top"), HIGH), (4.0, 4.0, 5.0))
    assert connected_scene(scene, conducts) is scene


@pytest.mark.parametrize("named", ["top", ""])
@pytest.mark.parametrize(
    ("corners", "is_at"),
    [
        ((1, 2, 1, 2, 2.5, 3.5), FLOATING),
        ((1, 2, 1, 2, 3, 4), "top"),
        ((1, 2, 1, 2, 1, 2.5), "bottom"),
        ((1, 2, 1, 2, 3, 3.999), FLOATING),
    ],
)
def test_a_piece_has_the_terminal_of_what_it_touches(named, corners, is_at):
    found = terminals(block("piece", *corners, terminal=named))
    assert {"piece": is_at, f"piece, {is_at}": is_at}.items() & found.items()
    assert (found["low"], found["high"]) == ("bottom", "top")
    assert found["film"] == ""


def test_edges_and_corners_touch():
    first = block("first", 1, 2, 1, 2, 3, 4, terminal="top")
    for corners in ((2, 3, 1, 2, 2, 3), (2, 3, 2, 3, 2, 3)):
        assert "top" in {terminals(first, block("second", *corners)).get(f"second{end}") for end in ("", ", top")}


def test_slanted_prisms_touch_at_their_apex():
    def wedge(apex):
        return Body("wedge", "etpu", (Prism("y", ((1.0, 3.0), (3.0, 3.0), (2.0, apex)), 0.0, 4.0),))

    for apex, is_at in ((4.0, "top"), (3.9, FLOATING)):
        assert terminals(wedge(apex)).get(f"wedge, {is_at}") == is_at


def layers(*plans):
    regions = [{name: shapely.box(*corners) for name, *corners in plan} for plan in plans]
    return [LayerRegions(0.1 * k, 0.1 * (k + 1), each) for k, each in enumerate(regions)]


BODIES = (LOW, FILM, HIGH)


def test_printed_pieces_that_hang_on_nothing_float_and_shorts_have_a_place():
    plate, whole = ("low", 0, 0, 4, 4), ("high", 0, 0, 4, 4)
    apart = connected_layers(
        layers([plate], [("high", 1, 1, 2, 2)][:0], [("high", 1, 1, 2, 2)], [], [whole]), BODIES, conducts
    )
    assert [b.terminal for b in apart.bodies if b.name == f"high, {FLOATING}"] == [FLOATING]
    assert apart.layers[2].region(f"high, {FLOATING}").area == pytest.approx(1)
    assert apart.layers[4].region("high").area == pytest.approx(16)
    assert (apart.shorts, apart.floating) == ((), 1)
    assert "touches no electrode" in apart.remarks()[0]
    short = connected_layers(layers([plate], [("high", 1, 1, 2, 2)], [whole]), BODIES, conducts)
    (where,) = short.shorts
    assert set(where.bodies) == {"low", "high"}
    assert where.place_mm == pytest.approx((1.5, 1.5, 0.1))
    assert "x 1.5, y 1.5, z 0.1 mm" in where.words()


def test_a_lost_middle_is_said_by_its_other_end():
    """A foot that lost the layer above it lies on the film: it floats, whatever its body is called."""
    foot, plate, whole = ("high", 1, 1, 2, 2), ("low", 0, 0, 4, 4), ("high", 0, 0, 4, 4)
    kept = connected_layers(layers([plate], [], [foot], [foot], [whole]), BODIES, conducts)
    assert (kept.floating, len(kept.bodies)) == (0, 3)
    lost = connected_layers(layers([plate], [], [foot], [], [whole]), (*BODIES, replace(FILM, name="more")), conducts)
    assert lost.floating == 1
