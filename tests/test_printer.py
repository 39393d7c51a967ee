"""Printers and qualities: data that holds together, and faults in it named."""

import re

import pytest

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.design import packs, printer


@pytest.fixture
def own(tmp_path):
    """A printer file of the user's, with a change to one that ships."""

    def write(old, new):
        text = (packs.profiles() / "printers/diabase-h5.yaml").read_text("utf-8")
        assert old in text
        path = tmp_path / "own.yaml"
        path.write_text(text.replace(old, new), "utf-8")
        return str(path)

    return write


@pytest.mark.parametrize(("name", "layer"), [("fine", 0.1), ("extrafine", 0.06)])
def test_layers_of_the_qualities(name, layer):
    quality = printer.load_quality(name)
    assert quality.layer_mm == quality.first_layer_mm == layer
    grid = quality.boundaries_mm(1.0)
    assert grid[:3] == (0.0, layer, pytest.approx(2 * layer))
    assert grid[-2] < 1.0 <= grid[-1]


def test_a_printer_of_the_users_own(own):
    machine = printer.load_printer(own("nozzle_mm: 0.4", "nozzle_mm: 0.25"))
    assert (machine.name, machine.nozzle_mm) == ("own", 0.25)


def test_heights_of_tools_are_given_in_a_file(own):
    machine = printer.load_printer(own("spindles: []", 'tool_offsets_mm: {"3": -0.05, "4": 0.1}'))
    assert machine.control.tool_offsets_mm == {3: -0.05, 4: 0.1}


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("spindles: []", 'tool_offsets_mm: {"9": 0.1}', "tool 9 under control is not among"),
        ("spindles: []", 'tool_offsets_mm: {"a": 0.1}', "expected a whole number"),
        ("nozzle_mm: 0.4", "nozzle_mm: .nan", "nozzle_mm"),
        ("nozzle_mm: 0.4", "nozzle_mm: 0", "nozzle_mm is 0; expected a number above 0"),
        ("nozzle_mm: 0.4", "nozzle_mm: 0.4\ncolour: red", "unknown key 'colour'"),
        ("nozzle_mm: 0.4", "nozle_mm: 0.4", "nozle_mm|nozzle_mm"),
        ("\nsource:", '\nsource: "two\\nlines" #', "without control characters"),
        ("tool_numbers: [1, 2, 3, 4, 5]", "tool_numbers: [3, 3, 4, 5]", "has a number twice"),
        ("bed_mm: [390.0, 170.0]", "bed_mm: [.inf, 170.0]", "bed_mm"),
        ("tool_numbers: [1, 2, 3, 4, 5]", "tool_numbers: []", "tool_numbers"),
        ("etpu: 3", "etpu: 9", "default tool 9 for etpu is not among"),
        ("bed_origin: centre", "bed_origin: left", "bed_origin"),
        ("gcode_flavour: reprapfirmware", "gcode_flavour: own", "gcode_flavour"),
    ],
)
def test_a_faulty_printer_file_is_named_with_its_key(own, old, new, key):
    with pytest.raises(BadInput, match=f"^/.*own.yaml: .*({key})"):
        printer.load_printer(own(old, new))


@pytest.mark.parametrize(("load", "word"), [(printer.load_printer, "printer"), (printer.load_quality, "quality")])
def test_unknown_names(load, word):
    with pytest.raises(UnknownName, match=f"unknown {word} 'fyne'"):
        load("fyne")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("max_nozzle_c: 250.0", "max_nozzle_c: 600", "max_nozzle_c 600"),
        ("max_bed_c: 120.0", "max_bed_c: 121", "max_bed_c 121"),
        ("xy: 200.0", "xy: 2000", "max_speed_mm_s.xy 2000"),
        ("coldest_c: 150.0", "coldest_c: 20", "control.coldest_c 20"),
        ("    M106: P3", "    M997: P1\n    M106: P3", "commands M997"),
    ],
)
def test_a_file_may_narrow_limits_but_not_widen_them_unasked(own, monkeypatch, old, new, said):
    file = own(old, new)
    monkeypatch.delenv(printer.TRUST, raising=False)
    with pytest.raises(BadInput, match=f"{re.escape(said)}, more than any printer .*--trust-printer"):
        printer.load_printer(file)
    monkeypatch.setenv(printer.TRUST, "1")
    printer.load_printer(file)


def test_a_macro_that_homes_nothing_is_no_homing(own):
    """The maker's bed.g probes a mesh."""
    with pytest.raises(BadInput, match="homes has G32, whose macro bed homes no axis"):
        printer.load_printer(own("homes: [G28]", "homes: [G28, G32]"))
    machine = printer.load_printer("diabase-h5")
    assert machine.macro("tpost", "tfree") == "G90\nG1 R2 X0 Y0 F6000\nG1 R2 Z2\n"
    assert printer.load_printer("prusa-xl5").macro("tpost") is None
