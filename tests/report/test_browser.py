"""The page in a real browser: with recordings and without readings, narrow and wide, light, dark and on paper."""

import pytest
from bench_files import HOSTILE, written

from sensorgen.analysis.report import report
from sensorgen.measure.log import Log, notes

FIGURES = """[...document.querySelectorAll('.plot')].map(p => [p.dataset.key, p.getBoundingClientRect().width,
    p.querySelectorAll('.trace, .trace.bars, canvas').length > 0])"""
SORTED = """(() => {
  const table = document.querySelector('[data-table=readings]'), rows = [...table.tBodies[0].rows];
  const at = [...table.tHead.rows[0].cells].findIndex(c => c.textContent.startsWith('film resistance measured'));
  return [table.tHead.rows[0].cells[at].getAttribute('aria-sort'), rows.map(r => r.cells[at].dataset.value)];
})()"""
BUTTONS = "[...document.querySelectorAll('[data-table=readings] thead button')]"
HEAD = f"{BUTTONS}.find(b => b.textContent.startsWith('film resistance measured'))"
PIECES = """[...document.getElementById('figure-residuals').querySelectorAll('.plot')].map(p => ({
    x: p._fullLayout.xaxis.range, y: p._fullLayout.yaxis.range, height: p.getBoundingClientRect().height}))"""
CAMERA = "JSON.stringify(document.querySelector('[data-key=bodies]')._fullLayout.scene._scene.getCamera().eye)"


@pytest.fixture(scope="module")
def recorded_page(of_recorded, tmp_path_factory):
    path = tmp_path_factory.mktemp("pages") / "recorded.html"
    path.write_text(written(of_recorded, "html"), "utf-8")
    return path


def quiet(page):
    assert page.complaints() == []
    assert page.asked() == []


def test_with_recordings(browser, recorded_page):
    browser.size(1920)
    browser.open(recorded_page)
    drawn = browser.run(FIGURES)
    assert len(drawn) >= 9
    assert [key for key, width, there in drawn if not there or width < 300] == []
    assert browser.run("document.title") == "Iteration 30: predicted and measured"
    assert browser.run(f"document.body.textContent.includes({HOSTILE!r})") or HOSTILE in browser.run(
        "document.body.textContent"
    )
    turned(browser)
    sorted_by_mouse_and_key(browser)
    another_choice(browser)
    on_paper(browser)
    browser.size(360)
    browser.media("dark", "")
    browser.until("document.querySelector('.plot').layout.font.color.startsWith('#e')")
    narrow_and_dark(browser)
    assert browser.run(f"{FIGURES}.every(f => f[2])")
    quiet(browser)


def on_paper(browser):
    """Printed, it is light whatever the screen is, without what is there for clicking only."""
    pdf = browser.pdf()
    assert pdf.startswith(b"%PDF")
    assert 4 <= pdf.count(b"/Type /Page\n") <= 60
    browser.media("dark", "print")
    assert browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.run("getComputedStyle(document.querySelector('nav')).display") == "none"


def turned(browser):
    """The bodies turn with the mouse."""
    browser.run("document.querySelector('[data-key=bodies]').scrollIntoView({block: 'center'})")
    box = browser.run(
        "(b => [b.x, b.y, b.width, b.height])(document.querySelector('[data-key=bodies]').getBoundingClientRect())"
    )
    before = browser.run(CAMERA)
    middle = [box[0] + box[2] / 2, box[1] + box[3] / 2]
    browser.drag(middle, [middle[0] + 150, middle[1] + 60])
    browser.until(f"{CAMERA} !== {before!r}")


def sorted_by_mouse_and_key(browser):
    browser.run(f"{HEAD}.click()")
    way, values = browser.run(SORTED)
    assert way == "ascending"
    assert [float(v) for v in values] == sorted(float(v) for v in values)
    browser.run(f"{HEAD}.focus()")
    browser.key("Enter", 13)
    way, values = browser.run(SORTED)
    assert way == "descending"
    assert [float(v) for v in values] == sorted((float(v) for v in values), reverse=True)
    assert browser.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def another_choice(browser):
    """A chosen tone is drawn in place of the first one."""
    place = "document.querySelector('[data-key=\"series-1-1\"]')"
    levels = []
    for k in (0, 6):
        browser.run(f"(s => {{ s.selectedIndex = {k}; s.dispatchEvent(new Event('change')); }})"
                    "(document.querySelector('[data-for=\"series-1-1\"]'))")  # fmt: skip
        unit = browser.run(f"{place}._fullLayout.yaxis2.title.text").partition("[")[2].rstrip("]")
        level = browser.run(f"Math.abs({place}._fullData[4]._extremes.y2.min[0].val)")
        levels.append(level * {"Ω": 1.0, "kΩ": 1e3, "MΩ": 1e6}[unit])
    assert levels[0] / levels[1] == pytest.approx(99.7 / 1.1, rel=0.2)


def narrow_and_dark(browser):
    assert browser.run("document.documentElement.scrollWidth") <= 360
    ground, ink = (
        browser.run(f"getComputedStyle(document.body).{which}.match(/\\d+/g).slice(0, 3).map(Number)")
        for which in ("backgroundColor", "color")
    )
    assert max(ground) < 60 < 200 < min(ink)


def test_readings_alone(browser, tmp_path):
    with Log(tmp_path / "log.db", create=True) as log:
        log.add([notes.reading(f"40 triX .1mm {k + 1}", f"{600 + 2 * k}", "30") for k in range(70)])
        (tmp_path / "tall.html").write_text(written(report(log, 40), "html"), "utf-8")
    browser.size(1920)
    browser.open(tmp_path / "tall.html")
    in_pieces_on_paper(browser)
    the_keyboard_reaches_the_report_first(browser)
    browser.size(360)
    browser.media("dark")
    narrow_and_dark(browser)
    quiet(browser)


def in_pieces_on_paper(browser):
    """Seventy rows do not fit on a page: every row stands in one piece, none higher than a page."""
    whole = browser.run(PIECES)
    browser.media("light", "print")
    browser.until("document.querySelectorAll('.more').length === 4 && document.documentElement.dataset.drawn")
    pieces = browser.run(PIECES)
    browser.media("light", "")
    browser.until("document.querySelectorAll('.more').length === 0 && document.documentElement.dataset.drawn")
    again = browser.run(PIECES)
    assert len(whole) == len(again) == 1
    assert whole[0] == again[0]
    assert len(pieces) == 3
    low, high = zip(*(sorted(piece["y"]) for piece in pieces), strict=True)
    assert (low, high) == ((-0.5, 23.5, 47.5), (23.5, 47.5, 69.5))
    assert all(piece["x"] == pytest.approx(pieces[0]["x"]) and piece["height"] < 700 for piece in pieces)


def the_keyboard_reaches_the_report_first(browser):
    browser.key("Tab", 9)
    assert browser.run("document.activeElement.className") == "skip"
    assert browser.run("document.activeElement.getBoundingClientRect().left") >= 0
    browser.key("Enter", 13)
    browser.until("document.activeElement.id === 'main'")
    assert "(median of 70" in browser.run("document.body.innerText")
