"""The list of `make mutants` fits the code."""

import ast
import runpy
from collections import Counter
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
FAULTS = yaml.safe_load((ROOT / "tests" / "mutants.yaml").read_text("utf-8"))["faults"]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault['file']}: {fault['fault']}")
def test_a_fault_fits_its_file(fault):
    path = ROOT / "src" / "sensorgen" / fault["file"]
    text = path.read_text("utf-8")
    assert text.count(fault["old"]) == 1
    ast.parse(text.replace(fault["old"], fault["new"]))
    files = [word for word in fault["tests"].split() if word.startswith(("tests/", "src/"))]
    assert files
    assert all((ROOT / word.partition("::")[0]).is_file() for word in files)


def test_each_package_has_five_or_more():
    assert min(Counter(fault["file"].partition("/")[0] for fault in FAULTS).values()) >= 5
    assert len(FAULTS) >= 60


def test_a_name_without_faults_is_refused(capsys):
    assert runpy.run_path(str(ROOT / "scripts" / "mutants.py"))["main"](["models", "modells"]) == 2
    assert "no fault in modells; expected" in capsys.readouterr().err
