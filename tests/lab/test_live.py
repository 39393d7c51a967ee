"""The live page in Chromium, its server against strangers, and the line in the terminal."""

import contextlib
import http.client
import io
import json
import select
import socket
import threading
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from sensorgen.measure.lab.live import LiveText, LiveView, Sample, line
from sensorgen.measure.signal.waveform import TONES_HZ

OUT = Path(__file__).parents[2] / "out" / "live"  # CI keeps it
TONES = np.array(TONES_HZ)
PATIENCE_S = 60
CUT = """[...document.querySelectorAll('dd, button, h1, figcaption, .value')]
    .filter(e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'inline')
    .map(e => e.textContent)"""
DRAWN = "document.documentElement?.dataset.drawn === 'yes'"


def sample(k, *, predicted=True, message="press 2.00 N at 40 mm"):
    time_s = k / 20
    expected = 8e3 * (1 - 0.01 * np.sin(time_s)) + 1 / (2j * np.pi * TONES * 1e-10 * (1 + 0.03 * np.sin(time_s)))
    z = expected * (1 + 0.004 * np.cos(3 * time_s + np.arange(7)))
    force = 2 + np.sin(time_s)
    return Sample(time_s, 3 + k // 100, 30, message, force, 2.0, 40 + time_s / 10, z, expected if predicted else None)


@pytest.fixture
def view():
    with LiveView("tri 0.1 mm, random presses", TONES) as made:
        yield made


@pytest.fixture
def page(browser, view):
    browser.call("Page.navigate", url=view.url)
    return browser


def request(view, path="", method="GET", body=None, **headers):
    address = urlsplit(view.url)
    connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=10)
    connection.putrequest(method, f"{address.path}{path}" if not path.startswith("/") else path, skip_host=True)
    for name, value in {"Host": address.netloc, **headers}.items():
        connection.putheader(name, value)
    if body is not None:
        connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


def received(view, page=None):
    """Commands, as soon as there are some."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        if commands := view.commands():
            return commands
        if page:
            page.run("1")
        time.sleep(0.02)
    raise TimeoutError("no command")


def feed(view, first, last):
    for k in range(first, last):
        view.update(sample(k))


def test_values_move_and_keys_and_buttons_command_the_run(page, view):
    feed(view, 0, 200)
    page.until("document.getElementById('force')?.textContent.endsWith('N')")
    before = page.run("[...document.querySelectorAll('dd, .value, .residual')].map(e => e.textContent)")
    assert before[0] == "4 of 30"
    assert len(before) == 6 + 14
    assert page.run("document.title") == "tri 0.1 mm, random presses"
    feed(view, 200, 400)
    page.until("page.rows.at(-1)[0] === 19.95 && document.getElementById('step').textContent === '6 of 30'")
    after = page.run("[...document.querySelectorAll('dd, .value, .residual')].map(e => e.textContent)")
    assert all(a != b for a, b in zip(before[6:], after[6:], strict=True))
    assert after[-1].startswith("residual 0.")
    shown = float(after[-2].split()[0])
    assert shown == pytest.approx(abs(sample(399).impedance_ohm[-1]) / 1e3, rel=1e-3)
    page.key(" ", 32)
    assert received(view) == ["pause"]
    page.until("document.getElementById('pause').textContent.startsWith('Resume')")
    page.key(" ", 32)
    assert received(view) == ["resume"]
    page.run("document.getElementById('pause').click()")
    assert received(view) == ["pause"]
    page.run("document.getElementById('pause').focus()")
    page.key(" ", 32)  # once, not also as a click
    assert received(view) == ["resume"]
    page.run("document.getElementById('abort').click()")
    assert received(view) == ["abort"]
    page.key("Escape", 27)
    assert received(view) == ["abort"]
    page.until("document.getElementById('notice').textContent.startsWith('Abort requested')")
    assert page.complaints() == []
    assert {urlsplit(url).netloc for url in page.asked()} == {urlsplit(view.url).netloc}


def test_each_quantity_is_shown(page, view):
    feed(view, 0, 50)
    page.until(DRAWN)
    z = sample(49).impedance_ohm[0]
    for quantity, value in (("z", abs(z)), ("r", z.real), ("x", z.imag)):
        page.run(f"document.querySelector('[data-quantity={quantity}]').click()")
        number, unit = page.run("document.querySelector('.value').textContent").split()
        assert float(number) * {"kohm": 1e3, "Mohm": 1e6}[unit] == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("schemes", [
    {360: ["light"], 1920: ["dark"]},
    pytest.param({width: ["light", "dark"] for width in (360, 768, 1280, 1920)}, marks=pytest.mark.nightly),
], ids=["ends", "all"])  # fmt: skip
def test_it_fits_every_width_light_and_dark(page, view, schemes):
    feed(view, 0, 1300)
    page.until("document.getElementById('step')?.textContent === '15 of 30'")
    for width in schemes:
        page.size(width, 900)
        for scheme in schemes[width]:
            page.media(scheme)
            page.run("show()")
            assert page.run("document.documentElement.scrollWidth") <= width
            assert page.run(CUT) == []
            page.picture(OUT / f"live-{scheme}-{width}.png")


def test_missing_values_are_gaps(page, view):
    nothing = replace(sample(0), impedance_ohm=np.full(7, np.nan + 0j), force_n=np.nan)
    view.update(nothing)
    page.until(DRAWN)
    page.until("document.getElementById('step')?.textContent === '3 of 30'")
    assert page.run("document.getElementById('force').textContent") == "-"
    assert page.run("document.querySelector('.value').textContent") == "-"
    view.update(sample(2, predicted=False))
    page.until("document.getElementById('force').textContent !== '-'")
    assert page.run("document.querySelector('.residual').textContent") == ""
    assert page.complaints() == []


def test_text_of_strangers_is_text(page):
    with LiveView("<img src=x onerror=alert(1)>", TONES) as view:
        view.update(sample(0, message="</p><script>alert(2)</script>\u2028"))
        page.call("Page.navigate", url=view.url)
        page.until("document.getElementById('message')?.textContent.includes('script')")
        assert page.run("document.querySelectorAll('img, p script').length") == 0
        assert page.run("document.getElementById('title').textContent") == "<img src=x onerror=alert(1)>"


def test_the_page_says_when_the_run_has_ended(page, view):
    feed(view, 0, 20)
    page.until(DRAWN)
    view.close()
    view.close()
    page.until("document.getElementById('notice').textContent.startsWith('No answer from the run')")
    with pytest.raises(OSError, match=r"refused|reset"):
        request(view)


def test_only_the_token_opens_it(view):
    assert request(view)[0].status == 200
    port = urlsplit(view.url).port
    token = urlsplit(view.url).path.strip("/")
    assert len(token) >= 32
    for path in ("/", "/data", "/x/data", f"/{token}", f"/{token[:-1]}/data", f"/{token}x/", "/%00/", "//"):
        answer, content = request(view, path)
        assert (answer.status, content) == (403, b""), path
    assert request(view, "/x/command", "POST", b"abort")[0].status == 403
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{port + 1}", ""):
        assert request(view, Host=host)[0].status == 403, host
        assert request(view, "command", "POST", b"abort", Host=host)[0].status == 403
    assert request(view, Host=f"localhost:{port}")[0].status == 200
    assert request(view, "command", "POST", b"abort", Origin="http://evil.example")[0].status == 403
    assert view.commands() == []
    assert request(view, "command", "POST", b"abort", Origin=f"http://127.0.0.1:{port}")[0].status == 204
    assert view.commands() == ["abort"]
    assert view.commands() == []


def test_it_listens_to_this_computer_only(view):
    port = urlsplit(view.url).port
    assert view._server.server_address[0] == "127.0.0.1"
    for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), port, socket.AF_INET)}:
        if not address.startswith("127."):
            with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
                socket.create_connection((address, port), 2)


def test_every_answer_forbids_everything_else(view):
    for path in ("", "data", "about", "nothing", "live.js"):
        answer, _ = request(view, path)
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Server"].strip() == "sensorgen"


@pytest.mark.parametrize("body", [b"", b"abort\n", b"abort" * 20, b"\xff"])
def test_unknown_commands_are_refused(view, body):
    assert request(view, "command", "POST", body)[0].status == 400
    assert view.commands() == []


def test_other_methods_and_paths_are_refused(view):
    for method in ("PUT", "DELETE", "OPTIONS"):
        assert request(view, "command", method)[0].status == 501
    assert request(view, "data", "POST", b"abort")[0].status == 404
    assert request(view, "../live.py")[0].status == 404
    assert request(view, "command", "POST", **{"Content-Length": "-1"})[0].status == 400


def test_an_abort_is_never_dropped(view):
    for _ in range(100):
        assert request(view, "command", "POST", b"pause")[0].status == 204
    assert request(view, "command", "POST", b"abort")[0].status == 204
    commands = view.commands()
    assert len(commands) <= 17
    assert commands[-1] == "abort"


def test_rows_come_once(view):
    feed(view, 0, 30)
    first = json.loads(request(view, "data?after=0")[1])
    assert (first["next"], len(first["rows"]), len(first["rows"][0])) == (30, 30, 4 + 4 * 7)
    assert first["state"]["step"] == 3
    assert json.loads(request(view, "data?after=30")[1])["rows"] == []
    feed(view, 30, 33)
    later = json.loads(request(view, "data?after=30")[1])
    assert [row[0] for row in later["rows"]] == [1.5, 1.55, 1.6]
    for odd in ("-1", "x", "9" * 30, "1e3", "50"):
        assert len(json.loads(request(view, f"data?after={odd}")[1])["rows"]) == 33


def test_nobody_reads_and_nothing_grows(view):
    """Only the last minute is kept; an update costs the time of a hundred small arrays at most."""
    tracemalloc.start()
    feed(view, 0, 1300)
    before = tracemalloc.get_traced_memory()[0]
    feed(view, 1300, 2600)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 100_000
    assert len(json.loads(request(view, "data?after=0")[1])["rows"]) == 1200


def test_a_browser_that_stops_reading_holds_nothing_up(view):
    """Sixty connections that send half a request: 16 wait for the rest, the others are closed at once."""
    feed(view, 0, 1300)
    address, before, most = urlsplit(view.url), threading.active_count(), 0
    half = [socket.create_connection(("127.0.0.1", address.port)) for _ in range(60)]
    for connection in half:
        with contextlib.suppress(OSError):
            connection.sendall(f"GET {address.path}data HTTP/1.0\r\n".encode())
    until = time.monotonic() + PATIENCE_S
    closed = []
    while len(closed) < 44 and time.monotonic() < until:
        feed(view, 1300, 1500)
        most = max(most, threading.active_count() - before)
        closed, _, _ = select.select(half, [], [], 0.01)
    assert len(closed) >= 44
    assert most <= 17  # one more is on its way in or out
    assert view.commands() == []
    view.close()
    for connection in half:
        connection.close()


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_the_line_is_updated_in_place_in_a_terminal():
    stream, now = Terminal(), iter(np.arange(0, 100, 0.06))
    text = LiveText(TONES, stream, now=lambda: next(now))
    for k in range(20):
        text.update(sample(k, message="press\x1b[31m\r\n"))
    text.close()
    written = stream.getvalue()
    assert written.count("\r") == 10
    assert written.count("\n") == 1
    assert "\x1b" not in written
    assert len({len(part) for part in written.strip("\r\n").split("\r")}) == 1


def test_elsewhere_a_line_is_plain():
    stream = io.StringIO()
    text = LiveText(TONES, stream)
    for k in range(1000):
        text.update(sample(k))
    text.close()
    lines = stream.getvalue().splitlines()
    assert len(lines) == 10  # one at each step
    assert "\r" not in stream.getvalue()
    assert lines[0].startswith("00:00 3/30 press 2.00 N at 40 mm | 2.00 of 2.00 N at 40.0 mm | 1.1 kHz 1.4")
    assert "residual 0.4 %" in lines[0]


def test_nothing_to_say_is_said_as_nothing():
    bare = replace(sample(0), impedance_ohm=np.full(7, np.nan + 0j), step=1)
    assert line(bare, TONES) == "00:00 1/30 press 2.00 N at 40 mm | 2.00 of 2.00 N at 40.0 mm | 1.1 kHz -, 99.7 kHz -"


def test_a_closed_terminal_ends_no_run():
    stream = Terminal()
    text = LiveText(TONES, stream)
    stream.close()
    for k in range(3):
        text.update(sample(k))
    text.close()
