"""The HTML page: whole, safe, without network, and its filters at work in a browser."""

import re
from collections import Counter

import pytest
from html_page import HtmlPage

from sensorgen.verification import thesis
from sensorgen.verification.thesis.items import AGREES, ItemPart, ItemVerdict, ReproducedItem, ThesisItem


@pytest.fixture(scope="module")
def text(rows):
    return thesis.html(rows)


@pytest.fixture(scope="module")
def page(text):
    return HtmlPage(text)


def test_the_page_is_whole(page, rows):
    assert not page.open
    items = [tr for tr in page.of("tr") if "data-verdict" in tr]
    assert len(items) == len(rows)
    assert len({tr["id"] for tr in items}) == len(rows)
    assert len([td for td in page.of("td") if "data-head" in td]) == 5 * len(rows)
    assert Counter(tr["data-verdict"] for tr in items) == Counter(r.verdict.word for r in rows)


def test_the_page_asks_nobody(text, page):
    assert not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest", text)
    assert not any("src" in attrs for _, attrs in page.tags)
    assert {attrs["href"] for _, attrs in page.tags if "href" in attrs} == {"data:,", "#main"}
    assert len(text) < 250_000


def test_the_page_can_be_read_aloud(page):
    assert page.of("html") == [{"lang": "en"}]
    assert all("scope" in th or th.get("role") == "rowheader" for th in page.of("th"))
    assert all(option["value"] is not None for option in page.of("option"))
    assert {"aria-live": "polite", "name": "count"}.items() <= page.of("output")[0].items()


def test_words_stay_text():
    bad = "<script>alert(1)</script> | & `code`"
    item = ThesisItem(number="9.9", says=bad, check="line.current", erratum=bad)
    made = [ReproducedItem("2", "equation", item, (ItemPart(bad, bad, 1.0, 1.0),), ItemVerdict(AGREES, bad))]
    found = thesis.html(made)
    assert "<script>alert" not in found
    assert "&lt;script&gt;alert(1)&lt;/script&gt; | &amp; <code>code</code>" in found
    line = next(line for line in thesis.markdown(made).splitlines() if line.startswith("| Eq. 9.9"))
    assert line.count("|") == 7
    assert "<script>" not in line


@pytest.mark.parametrize(
    ("asked", "fits"),
    [
        ("", lambda r: True),
        ("?verdict=differs", lambda r: r.verdict.word == "differs"),
        ("?chapter=B&kind=figure", lambda r: r.chapter == "B" and r.kind == "figure"),
        ("?text=sideways&verdict=differs&nonsense=1", lambda r: r.name() in ("Eq. 3.35", "Eq. 3.49")),
    ],
)
def test_filters_in_a_browser(asked, fits, text, rows, browser, tmp_path):
    file = tmp_path / "thesis.html"
    file.write_text(text, "utf-8")
    browser.open(file, asked, "document.readyState === 'complete'")
    shown = set(browser.run("[...document.querySelectorAll('tr[data-verdict]:not([hidden])')].map(tr => tr.id)"))
    assert shown == {f"{r.kind}-{r.item.number}" for r in rows if fits(r)}
