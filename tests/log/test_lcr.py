"""Exports of LCR meters in the makers' and people's ways, and what every pair of quantities says of the impedance."""

import cmath
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.measure import accuracy, immittance, lcr
from sensorgen.measure.log import Log

PF, D = (12.3, 12.1), (0.02, 0.03)  # at 1 and 10 kHz
WAYS = {
    "plain": "Frequency,Cp,D\n1000,12.3e-12,0.02\n10000,12.1e-12,0.03\n",
    "byte order mark and CRLF": "\ufeffFrequency,Cp,D\r\n1000,12.3e-12,0.02\r\n10000,12.1e-12,0.03\r\n",
    "units in brackets": "Freq [kHz],Cp [pF],D []\n1,12.3,0.02\n10,12.1,0.03\n",
    "units in parentheses, percent": "f (Hz),C_p (pF),tan d (%)\n1000,12.3,2\n10000,12.1,3\n",
    "units behind a stroke": "f/kHz,Cp/pF,D\n1,12.3,0.02\n10,12.1,0.03\n",
    "units behind a line": "freq_hz,cp_pF,d\n1000,12.3,0.02\n10000,12.1,0.03\n",
    "German": "Frequenz;Cp [pF];D\n1000;12,3;0,02\n10000;12,1;0,03\n",
    "tabs and decimal commas": "Frequency\tCp\tD\n1000\t12,3E-12\t0,02\n10000\t12,1E-12\t0,03\n",
    "comments": "# my sensor\n! at rest\nFrequency,Cp,D\n# first\n1000,12.3e-12,0.02\n10000,12.1e-12,0.03\n",
    "header as a comment": "# Frequency,Cp,D\n1000,12.3e-12,0.02\n10000,12.1e-12,0.03\n",
    "row of units": "Frequency,Cp,D\nkHz,pF,-\n1,12.3,0.02\n10,12.1,0.03\n",
    "units beside numbers": "Frequency,Cp,D\n1 kHz,12.3 pF,20m\n10 kHz,12.1 pF,30m\n",
    "quoted, other columns": '"No.","Time","Frequency","Cp","D","Status"\n1,10:05,1000,12.3e-12,0.02,0\n'
    "2,10:06,10000,12.1e-12,0.03,0\n",
    "Keysight": "Model,E4980A\nFunction,Cp-D\nLevel,1 V\n\nFrequency(Hz),Primary,Secondary,Status\n"
    "1.00000E+03,1.23000E-11,2.00000E-02,+0\n1.00000E+04,1.21000E-11,3.00000E-02,+0\n",
    "Hioki": "IM3533,Ver. 1.20\nSPEED,SLOW2\nFREQ[Hz],Cp[F],D[ ]\n1.0000E+03,12.3E-12,0.02\n1.0000E+04,12.1E-12,0.03\n",
    "overload": "Frequency,Cp,D\n1000,12.3e-12,0.02\n10000,12.1e-12,0.03\n20000,9.9E+37,9.9E+37\n",
    "faulty row": "Frequency,Cp,D,Status\n1000,12.3e-12,0.02,0\n2000,1,1,2\n10000,12.1e-12,0.03,0\n",
}


@pytest.fixture
def read(tmp_path):
    def call(content):
        path = tmp_path / "lcr.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return lcr.read(path)

    return call


@pytest.mark.parametrize("text", WAYS.values(), ids=WAYS)
def test_the_same_two_rows_in_every_way(read, text):
    found = read(text)
    got = {(one.quantity, one.frequency_hz): one.value for one in found.readings}
    wanted = {("Cp", 1e3): 12.3e-12, ("Cp", 1e4): 12.1e-12, ("D", 1e3): 0.02, ("D", 1e4): 0.03}
    assert got.keys() == wanted.keys()
    assert all(got[key] == pytest.approx(value, rel=1e-12) for key, value in wanted.items())


def test_what_was_passed_over_is_told(read):
    assert read(WAYS["overload"]).doubts == ("2 cells without a number",)
    assert read(WAYS["faulty row"]).doubts == ("1 rows left out: the meter marked them as faulty",)
    assert read(WAYS["quoted, other columns"]).left_out == ("No.", "Time")
    assert read("f,C,D\n1,1p,0\n").doubts == ("C read as parallel, Cp",)


PAIRS = {
    "Rs, Cs": ("Frequency,Cs,Rs\n1000,1e-9,100\n", complex(100, -1 / (2 * math.pi * 1e3 * 1e-9))),
    "R, X": ("Freq (Hz)\tR (kΩ)\tX (kΩ)\n1000\t1.5\t-20\n", 1500 - 20000j),
    "R, X in Windows-1252": ("f;R [ohm];X [ohm];T [°C]\n1000;1500;-20000;21\n".encode("cp1252"), 1500 - 20000j),
    "Z, degrees": ("FREQ[Hz],Z[ohm],PHASE[deg]\n1000,2000,-60\n", cmath.rect(2000, -math.pi / 3)),
    "Z, angle in degrees, untold": ("Frequency,|Z|,Theta\n1000,2000,-60\n", cmath.rect(2000, -math.pi / 3)),
    "Z, radians": ("Frequency,|Z|,θ (rad)\n1000,2000,-1\n", cmath.rect(2000, -1)),
    "Z as a meter of SCPI": ("FUNC:IMP ZTR\nFrequency,Primary,Secondary\n1000,2000,-1\n", cmath.rect(2000, -1)),
    "parts": ("f/Hz;Z'/ohm;Z''/ohm\n1000;1500;-20000\n", 1500 - 20000j),
}


@pytest.mark.parametrize(("text", "z"), PAIRS.values(), ids=PAIRS)
def test_other_pairs_give_their_impedance(read, text, z):
    found = read(text).readings
    assert immittance.impedance({one.quantity: one.value for one in found}, 1e3) == pytest.approx(z, rel=1e-12)


WRONG = {
    "no header": ("1000,1,2\n", "no table of an LCR meter, begins with '1000,1,2'"),
    "no frequency": ("Cp,D\n1,2\n", "no column of the frequency among Cp, D"),
    "decimal commas between commas": ("Frequency,Cp,D\n1000,12,3,0,02\n", "row 2: 5 cells, but the header has 3; if"),
    "a word": ("Frequency,Cp,D\n1000,much,0.02\n", "row 2, column Cp: 'much' is no number"),
    "a cell too few": ("Frequency,Cp,D\n1000,1p\n", "row 2: 2 cells, but the header has 3"),
    "unit of another": ("Frequency,Cp,D\n1000,12 ohm,0.02\n", "column Cp: unit 'ohm'; expected F"),
    "no rows": ("Frequency,Cp,D\n", "no readings below the header in row 1"),
    "at DC": ("Frequency,Cp,D\n0,1p,0.02\n", "a frequency of 0 Hz; expected one above 0"),
    "small angles without a unit": ("Frequency,Z,phase\n1000,2000,-1\n", "degrees or radians?"),
    "a spreadsheet": (b"PK\x03\x04...", "zip archive"),
    "nothing": (b"", "is empty"),
}


@pytest.mark.parametrize(("content", "message"), WRONG.values(), ids=WRONG)
def test_one_clear_error_otherwise(read, content, message):
    with pytest.raises(BadInput) as error:
        read(content)
    assert message in str(error.value)
    assert "lcr.csv" in str(error.value)


@given(st.binary(max_size=200) | st.text(alphabet='FfCpD,;\t\n0123456789.e-+[]HzkZ"#', max_size=200))
def test_no_file_crashes_the_reader(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "fuzzed.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    try:
        found = lcr.read(path)
    except BadInput:
        return
    assert all(math.isfinite(one.value) and one.frequency_hz > 0 for one in found.readings)


def by_closed_forms(r, x, frequency_hz):
    """Every quantity of an impedance, each from its own definition."""
    w, z, y = 2 * math.pi * frequency_hz, complex(r, x), 1 / complex(r, x)
    found = {"R": r, "X": x, "Z": abs(z), "G": y.real, "B": y.imag, "Y": abs(y), "D": r / abs(x), "Q": abs(x) / r,
             "Rp": 1 / y.real}  # fmt: skip
    if x < 0:
        return found | {"Cs": -1 / (w * x), "Cp": y.imag / w}
    return found | {"Ls": x / w, "Lp": -1 / (w * y.imag)}


@pytest.mark.parametrize("pair", sorted(immittance._PAIRS), ids=" ".join)
@settings(max_examples=25)
@given(st.floats(1e-2, 1e7), st.floats(1e-2, 1e7), st.sampled_from((1, -1)), st.floats(20, 1e6))
def test_every_pair_gives_the_impedance_back(pair, r, size, sign, frequency_hz):
    x = -size if pair[0][0] == "C" else size if pair[0][0] == "L" else sign * size
    known = by_closed_forms(r, x, frequency_hz)
    known["phase"] = cmath.phase(1 / complex(r, x)) if "Y" in pair else cmath.phase(complex(r, x))
    found = immittance.impedance({name: known[name] for name in pair}, frequency_hz)
    assert found == pytest.approx(complex(r, x), rel=1e-9, abs=1e-9 * abs(complex(r, x)))


@pytest.mark.parametrize(
    ("text", "farad"),
    [
        ("12.3 / 12.4pF@1kHz", (12.3e-12, 12.4e-12)),
        ("1.2nF / 7 / 9pF@1kHz", (1.2e-9, 7e-12, 9e-12)),
        ("7 ± 1 / 9pF / 1.2nF@1kHz", (7e-9, 9e-12, 1.2e-9)),
    ],
)
def test_repeats_without_a_unit_have_that_of_the_last(text, farad):
    found = immittance.parse("Cp", text)
    assert [one.value for one in found] == pytest.approx(farad, rel=1e-12, abs=0)
    assert [one.uncertainty for one in found][1:] == [0.0] * (len(farad) - 1)
    assert found[0].uncertainty == pytest.approx(1e-9 if "±" in text else 0.0, abs=1e-21)


def test_an_export_becomes_one_reading_with_its_file(run, path, tmp_path):
    (tmp_path / "lcr.csv").write_text(WAYS["Hioki"])
    said = run("import", "lcr.csv", "--specimen", "23 triX .2mm", "--unbaked")
    assert "2 of 2 rows logged" in said.words
    with Log(path) as log:
        (row,) = log.readings()
        assert (row.quantity, row.baked, row.instrument) == (("Cp", "D", "Cp", "D"), False, "Hioki IM3533")
        assert log.raw(row.file).read_text() == WAYS["Hioki"]
    assert "0 of 2 rows logged, 2 were there" in run("import", "lcr.csv", "--specimen", "23 triX .2mm").words


def test_an_export_needs_its_specimen_and_a_table_of_readings_none(run, tmp_path):
    (tmp_path / "lcr.csv").write_text(WAYS["plain"])
    assert "say of which specimen, as --specimen S1" in run("import", "lcr.csv").line
    (tmp_path / "t.csv").write_text("specimen,y,z\n23 triX,650,40\n")
    assert run("import", "t.csv").code == 0
    assert "no column of the frequency" in run("import", "t.csv", "--specimen", "23 triX").line
    assert "expected --specimen too" in run("import", "t.csv", "--unbaked").line


def test_limits_are_those_of_the_makers_documents():
    meter = accuracy.find("Hioki IM3533")
    z = cmath.rect(1014.4, math.radians(-78.69))  # the manual's example: 160 nF at 1 kHz, 0.05 % of |Z|
    assert meter.ac("Z", abs(z), 1e3, z) * math.sqrt(3) == pytest.approx(0.0023 * abs(z))
    multimeter = accuracy.find("HEWLETT-PACKARD,34401A,0,11-5-2")
    assert multimeter.dc_ohm(650.0, 4) * math.sqrt(3) == pytest.approx(650 * 1e-4 + 1000 * 1e-5)
    assert multimeter.dc_ohm(650.0, 2) * math.sqrt(3) == pytest.approx(650 * 1e-4 + 1000 * 1e-5 + 0.2)
    assert multimeter.dc_ohm(1e9, 4) is None
    assert accuracy.find("Keithley 2001") is None


@given(
    st.floats(1, 1e6), st.floats(-1e6, -1), st.sampled_from(("Cp", "Cs", "D", "R", "X", "Z", "phase", "G", "B", "Q"))
)
def test_uncertainties_are_those_of_a_disc_around_z(r, x, quantity):
    """A limit of a |Z| in any direction moves each quantity by at most what the formula says, and by nearly that."""
    if r / abs(x) > 30 or abs(x) / r > 30:
        return
    z, f = complex(r, x), 1e3
    meter = accuracy.Instrument(name="any", source="", bands=(accuracy.MeterBand(1, 1e6, 1e-4, 0, 0),))

    def value(z):
        return by_closed_forms(z.real, z.imag, f)[quantity] if quantity != "phase" else cmath.phase(z)

    limit = meter.ac(quantity, value(z), f, z) * math.sqrt(3)
    moved = [abs(value(z + 1e-6 * abs(z) * cmath.rect(1, k * math.pi / 90)) - value(z)) for k in range(180)]
    assert max(moved) == pytest.approx(limit, rel=2e-3)


@pytest.mark.parametrize("z", [3e5 - 2e7j, 1e3 - 4e2j, 50 + 300j])
def test_quantities_of_an_impedance_give_it_back(z):
    for one, other in set(immittance._PAIRS) - {("Y", "phase")}:  # that is the phase of Y
        values = {name: float(immittance.quantity_of(name, z, 2e3)) for name in (one, other)}
        assert immittance.impedance(values, 2e3) == pytest.approx(z, rel=1e-12), (one, other)


@pytest.mark.parametrize(
    ("quantity", "text", "words"),
    [
        ("Cp", "12.3@1kHz", "no unit; write it behind the value, as 12.3pF@1kHz"),
        ("Cp", "7pF / 9@1kHz", "no unit"),
        ("phase", "-88@1kHz", "no unit; write it behind the value, as -88deg@1kHz"),
        ("Ls", "3@1kHz", "no unit; write it behind the value, as 3.3mH@1kHz"),
        ("Z", "9.9e37@1kHz", "9.9e37 is what a meter sends for no value; leave the quantity out"),
    ],
)
def test_values_without_a_unit_or_without_a_value_are_refused(quantity, text, words):
    with pytest.raises(BadInput) as error:
        immittance.parse(quantity, text)
    assert words in str(error.value)


def test_picofarads_without_a_unit_are_not_taken_for_farads(read):
    with pytest.raises(BadInput, match=r"row 2, column Cp: 60.1 F\? Write the unit in the header, as Cp \[pF\]"):
        read("Frequency,Cp,D\n1000,60.1,0.02\n")
    assert read("Frequency,Cp [F],D\n1000,60.1,0.02\n").readings[0].value == 60.1
