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


def test_planted_faults_stop_the_build(built):
    """All in one page: each is named, and each is a warning, of which one is enough (``-W``)."""
    faults = {
        "[a page](missing.md)": "missing.md",
        "[a heading](#nowhere)": "nowhere",
        '<img src="https://example.org/a.png">': "keep a copy in the repository",
    }
    done, _ = built("# Title\n\n" + "\n\n".join(faults) + "\n")
    assert done.returncode
    for error in faults.values():
        assert error in done.stderr
