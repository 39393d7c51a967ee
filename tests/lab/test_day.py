"""A day in the laboratory, as the page of that name tells it: every command in its order, on virtual devices."""

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from sensorgen.cli import cli
from sensorgen.core import document
from sensorgen.core.errors import BadInput
from sensorgen.workflows import demo

PAGE = (Path(__file__).parents[2] / "docs" / "lab.md").read_text("utf-8")
SLOW = {"hold_s: [0.3, 10]": "hold_s: [0.3, 3]", '.14"}': '.14", settings: {lift_mm_s: 100}}'}
REAL = "first.yaml --page"  # needs devices
QUICK = "approach:\n  speed_mm_s: 100\n  landing_mm_s: 20\n  travel_mm_s: 200\n"


def commands():
    for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL):
        for line in block.splitlines():
            words = shlex.split(line, comments=True)
            if words[:2] != ["sensorgen", "demo"] and REAL not in " ".join(words):
                yield words[1:]


@pytest.mark.nightly
def test_every_command_of_the_page_works_in_its_order(tmp_path, monkeypatch, shared_cache):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SENSORGEN_LOG", str(tmp_path / "log.db"))
    experiment = re.search(r"```yaml\n# first.yaml\n(.*?)```", PAGE, re.DOTALL)[1]
    said = {}
    for words in commands():
        done = CliRunner().invoke(cli, words)
        assert done.exit_code == 0, f"{words}: {done.output}"
        said[words[0]] = done.stdout
        if words[:2] == ["new", "experiment"]:
            for slow, quick in SLOW.items():
                assert slow in experiment
                experiment = experiment.replace(slow, quick)
            (tmp_path / "first.yaml").write_text(experiment + QUICK, "utf-8")
    assert "31 of 31 presses, simulated" in said["bench"]
    assert "youngs_modulus_pa" in said["calibrate"]
    assert "simulated, not measured: recording 1" in said["calibrate"]
    off = re.search(r"Impedance at rest: simulated ([0-9.]+) % of", said["report"])
    assert float(off[1]) < 30  # its materials are from their ranges
    assert (tmp_path / "s1.html").exists()


@pytest.fixture(scope="module", params=[(6, 2), pytest.param((demo.KNOWN, demo.UNKNOWN), marks=pytest.mark.nightly)])
def demonstrated(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "lab"
    with pytest.MonkeyPatch.context() as fewer:
        for name, presses in zip(("KNOWN", "UNKNOWN"), request.param, strict=True):
            fewer.setattr(demo, name, presses)
        if request.param[0] < 30:
            fewer.setattr(demo, "_EXPERIMENT", demo._EXPERIMENT.replace("[0.3, 5]", "[0.3, 2]") + QUICK)
        yield folder, demo.demo(folder, count=1)


def test_the_demonstration_runs_the_whole_loop(demonstrated):
    folder, found = demonstrated
    assert [one.quantity for one in found.found] == [
        "resistivity_ohm_m", "relative_permittivity", "youngs_modulus_pa"
    ]  # fmt: skip
    assert all(0 < one.lower < one.upper for one in found.found)
    for one in found.found:  # not its interval, which may miss, but near: a third interval beside it
        middle = (one.lower * one.upper) ** 0.5
        assert (one.lower / middle) ** 3 < one.truth / middle < (one.upper / middle) ** 3
    (presses,) = found.inverted
    assert presses.presses == demo.UNKNOWN
    assert presses.force_held >= demo.UNKNOWN // 2
    page = (folder / "report.html").read_text("utf-8")
    assert f"is calibrated by {demo.KNOWN} known presses" in page
    assert "simulated" in page
    text = "\n".join(document.text(found.document()))
    assert "3 intervals hold the truth" in text or "of 3 intervals hold the truth" in text


def test_a_folder_with_files_is_left_alone(demonstrated):
    folder, _ = demonstrated
    with pytest.raises(BadInput, match="expected a new or empty folder"):
        demo.demo(folder)
