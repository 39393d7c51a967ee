"""The notebooks of the gallery run as they stand, and a notebook's results show themselves."""

import atexit
import re
from pathlib import Path

import pytest

import sensorgen as sg

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"

SLOW = {"film_study", "own_gcode"}  # presses of three films and of a print; tests/cli has such presses

pytestmark = pytest.mark.usefixtures("shared_cache")


NOTEBOOKS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.nightly] if path.stem in SLOW else [])
    for path in sorted(GALLERY.glob("*.py"))
    if path.stem != "readings_to_report"  # runs in a kernel
]


def cells(notebook):
    """Head and text of each cell."""
    for cell in re.split(r"^# %% ?", notebook.read_text("utf-8"), flags=re.MULTILINE)[1:]:
        head, _, body = cell.partition("\n")
        yield head, body.strip()


@pytest.mark.parametrize("notebook", NOTEBOOKS)
def test_a_notebook_runs(notebook, tmp_path, monkeypatch):
    """By IPython in this process, each cell by itself; one by a kernel is below."""
    pytest.importorskip("IPython")
    from IPython.core.interactiveshell import InteractiveShell
    from IPython.utils.capture import capture_output

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    shell = InteractiveShell()
    try:
        with capture_output() as shown:
            for head, body in cells(notebook):
                if head != "[markdown]":
                    shell.run_cell(body).raise_error()
    finally:
        shell.atexit_operations()
        atexit.unregister(shell.atexit_operations)
        shell.restore_sys_module_state()
    assert shown.outputs or shown.stdout, "the notebook shows nothing"


def test_a_notebook_runs_in_a_kernel(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    from nbclient import NotebookClient

    book = nbformat.v4.new_notebook()
    for head, body in cells(GALLERY / "readings_to_report.py"):
        make = nbformat.v4.new_markdown_cell if head == "[markdown]" else nbformat.v4.new_code_cell
        book.cells.append(make(body))
    NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert any(cell.get("outputs") for cell in book.cells), "the notebook shows nothing"


def test_what_was_sliced_is_read_back(program, tmp_path):
    program("prusa-slicer", "prusa-slicer")
    design = sg.Design(shape="reference", parameters={"length_mm": 6.0, "width_mm": 6.0})
    sliced = sg.slice_design(design, tmp_path)
    body = sg.as_printed(design, sliced.gcode)
    assert Path(sliced.gcode).name in body.provenance
    assert sg.predict(body).capacitance.value == pytest.approx(8.854e-12 * 4.68 * 36e-6 / 0.6e-3, rel=0.01, abs=0.0)


def test_names_are_imported_when_they_are_used():
    import subprocess
    import sys

    code = "import sys, sensorgen; print(*sorted(m for m in sys.modules if m.startswith('sensorgen.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.split() == ["sensorgen.core", "sensorgen.core.version"]
    assert len(sg.__all__) == len([name for name in sg.__all__ if getattr(sg, name)]) == 26
    with pytest.raises(AttributeError, match="no attribute 'predikt'"):
        sg.predikt  # noqa: B018


def test_results_show_themselves():
    design = sg.Design(shape="reference")
    found = sg.predict(design)
    assert "<table " in found._repr_html_()
    assert "69.06" not in found._repr_html_()  # a range of the materials' sources is there
    assert "capacitance" in found._repr_html_()
    assert found.plot().axes
    assert design._repr_html_().startswith("<svg")
    assert "<svg" in design.show()._repr_svg_()
    assert "<table " in sg.check(design)._repr_html_()
