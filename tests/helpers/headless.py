"""Pages: their elements, and how they are in headless Chromium, skipped where there is none."""

import base64
import json
import re
import shutil
import subprocess
import tempfile
import time
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from urllib.request import Request, urlopen

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_FLAGS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
          "--enable-unsafe-swiftshader", "--disable-background-networking", "--no-first-run",
          "--disable-sync", "--hide-scrollbars", "--remote-debugging-port=0")
_PATIENCE = 180.0  # [s], which only a browser that hangs takes, on a loaded machine too


class Balanced(HTMLParser):
    """Fails unless the elements of a text are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def whole(text):
    """The text of a page whose elements are closed in order, and which needs nothing else."""
    Balanced(text)
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//|@import|url\((?!#)|fetch\(|XMLHttp|"""
                         r"<(?:link|img|(?:iframe|script)[^>]* src)\b|\bimport\(", text)
    return text


class Page:
    """One page: run script in it, press its buttons, look at it."""

    def __init__(self, socket):
        self._socket, self._number = socket, 0
        self.complaints = []  # errors and warnings of the console, exceptions

    def call(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=_PATIENCE))
            if message.get("id") == self._number:
                assert "error" not in message, message
                return message["result"]
            said = message.get("params", {})
            said = said.get("entry", said)
            if (message.get("method") == "Runtime.exceptionThrown" or said.get(
                    "level", said.get("type")) in ("error", "warning", "assert")) and (
                    "GPU stall due to ReadPixels" not in str(said)):  # of screenshots
                self.complaints.append(str(said))

    def look_at(self, address, width=1400, height=900, dark=False):
        """Open an address in a window of this size."""
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def run(self, script):
        """Evaluate an expression, awaited if it is a promise, and return its value."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True,
                           awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition):
        """Wait until an expression holds."""
        end = time.monotonic() + _PATIENCE
        while not self.run(condition):
            assert time.monotonic() < end, f"{condition} does not come to hold"
            time.sleep(0.05)

    def screenshot(self):
        """The window as PNG, once what was asked for is on the screen."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def press(self, key, code):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code,
                      text=key * (kind == "keyDown"))

    def mouse(self, *steps):
        """Send mouse events (kind, x, y)."""
        for kind, x, y in steps:
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left",
                      buttons=int(kind != "mouseReleased"), clickCount=1)


@contextmanager
def chromium():
    """Start a browser and give its Page; the test is skipped where there is no Chromium."""
    connect = pytest.importorskip("websockets.sync.client", reason="needs websockets").connect
    program = next((path for path in map(shutil.which, _NAMES) if path), None)
    if program is None:
        pytest.skip("needs Chromium")
    with (tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
          subprocess.Popen([program, *_FLAGS, f"--user-data-dir={folder}", "about:blank"],
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process):
        try:
            address = _page_address(Path(folder) / "DevToolsActivePort", process)
            with connect(address, max_size=None, open_timeout=_PATIENCE) as socket:
                yield Page(socket)
        finally:
            process.terminate()
            process.wait(_PATIENCE)


def _page_address(file, process):
    end = time.monotonic() + _PATIENCE
    while not (file.is_file() and "\n" in file.read_text()):
        if process.poll() is not None or time.monotonic() > end:
            pytest.skip("Chromium does not start here")
        time.sleep(0.05)
    port = file.read_text().split()[0]
    with urlopen(Request(f"http://127.0.0.1:{port}/json/list")) as answer:
        return next(one for one in json.load(answer) if one["type"] == "page")[
            "webSocketDebuggerUrl"]
