"""Kinds of words: several numbers at once."""

import click
import pytest

from sensorgen.cli.commands import Values
from sensorgen.core.errors import BadInput
from sensorgen.core.units import FORCE_N, FREQUENCY_HZ, LENGTH_MM

OPTION = click.Option(["-f", "--force"])


def read(kind, text):
    return kind.convert(text, OPTION, None)


def test_values_in_the_quantitys_own_unit():
    assert read(Values(FORCE_N, zero=True), "0:1:0.5") == (0.0, 0.5, 1.0)
    assert read(Values(LENGTH_MM, zero=True), "1cm") == (10.0,)
    assert read(Values(FREQUENCY_HZ, zero=False), "1kHz,2kHz") == (1000.0, 2000.0)


def test_a_default_passes_as_it_is():
    assert read(Values(FORCE_N, zero=True), (1.0, 2.0)) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("zero", "text", "said"),
    [
        (True, "-1:3:1", "--force: -1; expected 0 or more"),
        (True, "-2", "--force: -2; expected 0 or more"),
        (False, "-2", "--force: -2; expected above 0"),
        (False, "0,1", "--force: 0; expected above 0"),
        (False, "0:1:1", "--force: 0; expected above 0"),
        (False, "1e-400", "--force: 0; expected above 0"),
        (True, "two", "--force: 'two' is not a force: write a number, with N, mN,"),
        (True, "2,1", "--force: '2,1': 1 stands after 2"),
    ],
)
def test_refused_by_the_name_of_the_option(zero, text, said):
    with pytest.raises(BadInput, match=f"^{said}"):
        read(Values(FORCE_N, zero=zero), text)
