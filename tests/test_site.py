"""The site refuses broken links and pages that load from elsewhere, and has equations without scripts."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
pytest.importorskip("sphinx")


@pytest.fixture
def built(tmp_path):
    """Build a site of one page with the settings of ours."""
    (tmp_path / "docs" / "site").mkdir(parents=True)
    for name in ("conf.py", "site/index.html", "site/site.css"):
        shutil.copy(DOCS / name, tmp_path / "docs" / name)

    def build(page):
        (tmp_path / "docs" / "index.md").write_text(page, "utf-8")
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", "docs", ".", "site"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, encoding="utf-8")
        return done, tmp_path / "site" / "docs" / "index.html"

    return build


def test_equations_are_mathml(built):
    done, page = built("# Title\n\nThe film $d$:\n\n$$C = \\frac{\\varepsilon A}{d}$$\n")
    assert (done.returncode, done.stderr) == (0, "")
    assert page.read_text("utf-8").count("<math ") == 2
    assert "mathjax.js" not in page.read_text("utf-8").lower()


@pytest.mark.parametrize(
    ("page", "error"),
    [
        ("# Title\n\n[a page](missing.md)\n", "missing.md"),
        ("# Title\n\n[a heading](#missing)\n", "missing"),
        ('# Title\n\n<img src="https://example.org/a.png">\n', "keep a copy in the repository"),
    ],
)
def test_a_planted_fault_stops_the_build(built, page, error):
    done, _ = built(page)
    assert done.returncode
    assert error in done.stderr
