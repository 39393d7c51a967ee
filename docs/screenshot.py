"""Write the README's picture of a design's page, by Chromium; run by `make docs`, which leaves it alone without one."""

import shutil
import sys
import tempfile
from pathlib import Path

from generate import DOCS, sensorgen

sys.path.insert(0, str(DOCS.parent / "tests" / "report"))
WIDTH, HEIGHT = 1280, 1010
NAMES = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    """Open the page of the first sensor in a browser, and keep its picture."""
    from browser import Page

    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        return
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        sensorgen("show", "tri", "--dielectric", "0.2", "--no-open", "--output", str(page))
        browser = Page(program, Path(folder))
        try:
            browser.size(WIDTH, HEIGHT)
            browser.media("light")
            browser.open(page)
            browser.picture(DOCS / "pictures" / "show-trix-d0.2.png", whole=False)
        finally:
            browser.close()


if __name__ == "__main__":
    main()
