"""A real Chromium, without a window, spoken to through a pipe in its DevTools protocol."""

import base64
import contextlib
import json
import os
import select
import subprocess
import time

FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-gpu-compositing",  # without a graphics card it takes six times as long as painting plainly
         "--hide-scrollbars", "--disable-dev-shm-usage", "--remote-debugging-pipe", "--no-first-run"]  # fmt: skip
PATIENCE_S = 120
_COMPLAINTS = ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")


class Page:
    """A page that is open in the browser, and everything that it said or asked the network for."""

    def __init__(self, chromium, folder):
        down, up = os.pipe(), os.pipe()
        self.write, self.read = down[1], up[0]
        script = 'exec "$@" 3<&"$DOWN" 4>&"$UP"'
        self.process = subprocess.Popen(
            ["bash", "-c", script, "bash", chromium, *FLAGS, f"--user-data-dir={folder / 'profile'}", "about:blank"],
            pass_fds=(down[0], up[1]), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            env={**os.environ, "HOME": str(folder), "DOWN": str(down[0]), "UP": str(up[1])},
        )  # fmt: skip
        os.close(down[0])
        os.close(up[1])
        self.number, self.rest, self.events, self.session, self.context = 0, b"", [], None, None
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self._attach(target["targetId"])

    def _attach(self, target):
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Network", "Page", "Log"):
            self.call(f"{domain}.enable")

    def renew(self):
        """Another page of the same browser, in a context of its own: it has nothing of the last one."""
        self.session = None
        if self.context:
            self.call("Target.disposeBrowserContext", browserContextId=self.context)
        self.context = self.call("Target.createBrowserContext")["browserContextId"]
        self._attach(self.call("Target.createTarget", url="about:blank", browserContextId=self.context)["targetId"])
        self.events.clear()

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write, json.dumps(message).encode() + b"\0")
        while True:
            said = self._message()
            if said.get("id") == self.number:
                if "error" in said:
                    raise RuntimeError(f"{method}: {said['error']}")
                return said["result"]
            self.events.append(said)

    def _message(self):
        until = time.monotonic() + PATIENCE_S
        while b"\0" not in self.rest:
            if not select.select([self.read], [], [], max(0.0, until - time.monotonic()))[0]:
                raise TimeoutError("the browser does not answer")
            block = os.read(self.read, 1 << 20)
            if not block:
                raise RuntimeError("the browser has gone")
            self.rest += block
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def run(self, script):
        done = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in done:
            raise RuntimeError(done["exceptionDetails"])
        return done["result"].get("value")

    def size(self, width, height=900):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def media(self, scheme="light", media=""):
        self.call(
            "Emulation.setEmulatedMedia", media=media, features=[{"name": "prefers-color-scheme", "value": scheme}]
        )

    def open(self, path, query="", ready="document.documentElement?.dataset.drawn === 'yes'"):
        """Open a page, and wait until it says that it has drawn everything, or is ready."""
        self.events.clear()
        self.call("Page.navigate", url=path.resolve().as_uri() + query)
        self.until(ready)

    def until(self, condition):
        end = time.monotonic() + PATIENCE_S
        while not self.run(condition):
            if time.monotonic() > end:
                raise TimeoutError(condition)
            time.sleep(0.1)

    def drag(self, start, end):
        """Press the mouse at a place, move it, and let go."""
        self._mouse("mouseMoved", start, 0)
        self._mouse("mousePressed", start, 1)
        for k in range(1, 5):  # each is drawn
            self._mouse("mouseMoved", [a + (b - a) * k / 4 for a, b in zip(start, end, strict=True)], 1)
            time.sleep(0.03)
        self._mouse("mouseReleased", end, 0)

    def _mouse(self, kind, at, buttons):
        button = "left" if kind != "mouseMoved" or buttons else "none"
        self.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], button=button, buttons=buttons, clickCount=1)

    def key(self, key, code):
        for kind in ("keyDown", "keyUp"):
            text = "\r" if key == "Enter" and kind == "keyDown" else ""
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, text=text)

    def picture(self, path, *, whole=True):
        how = {"captureBeyondViewport": whole}
        if whole:  # beyond 8192 pixels the browser's painter begins anew
            size = self.run("[innerWidth, Math.min(document.documentElement.scrollHeight, 8000)]")
            how["clip"] = {"x": 0, "y": 0, "width": size[0], "height": size[1], "scale": 1}
        done = self.call("Page.captureScreenshot", format="png", **how)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(done["data"]))

    def pdf(self):
        return base64.b64decode(self.call("Page.printToPDF", preferCSSPageSize=True, printBackground=True)["data"])

    def asked(self):
        """Addresses that the page asked for, its own file and what it holds itself left out."""
        urls = [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
        return [u for u in urls if not u.startswith(("file:", "data:", "blob:"))]

    def complaints(self):
        """Errors and warnings, of scripts and of the browser."""
        by_kind = {kind: [e["params"] for e in self.events if e["method"] == kind] for kind in _COMPLAINTS}
        thrown, called, logged = by_kind.values()
        said = [c for c in called if c["type"] in ("error", "warning", "assert")]
        entries = [e["entry"] for e in logged]  # advice about canvases comes from the browser's own painter
        return thrown + said + [e for e in entries if e["level"] in ("error", "warning") and e["source"] != "rendering"]

    def close(self):
        with contextlib.suppress(Exception):
            self.session = None
            self.call("Browser.close")
        os.close(self.write)
        os.close(self.read)
        self.process.wait(30)
