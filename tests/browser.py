"""Pages as a browser shows them: headless Chromium, driven over a pair of pipes with the DevTools protocol.

    with open_page(path) as page:
        page.check_plays()
        page.screenshot("picture.png")

No name can be resolved by this browser, so a page that needs the network cannot pass for one that does not.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
TIMEOUT = 60.0  # s, for one answer of the browser
LOCAL = ("file:", "data:", "blob:", "about:")

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--metrics-recording-only",
    "--no-default-browser-check",
    "--no-first-run",
    "--remote-debugging-pipe",
)


def browser() -> str | None:
    """Path of a Chromium, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def require_browser() -> str:
    """Path of a Chromium. Without one the test is skipped; under CI it fails."""
    path = browser()
    if path is None:
        report = pytest.fail if os.environ.get("CI") else pytest.skip
        report("no Chromium on this machine (Debian: apt-get install chromium)")
    return str(path)


@dataclass
class Page:
    """An open page.

    Attributes:
        requests: addresses it asked for that are not local.
        files: addresses of the files that it asked for.
        errors: uncaught exceptions, console errors, blocked resources, dialogs it opened.
    """

    pipe: Pipe
    session: str
    requests: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the DevTools protocol and its answer; events on the way are recorded."""
        number = self.pipe.send(method, parameters, self.session)
        while True:
            message = self.pipe.receive()
            if message.get("id") == number:
                return self.pipe.result(message)
            self._record(message)

    def evaluate(self, expression: str) -> Any:
        """Value of a JavaScript expression, or of the promise it gives."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression}: {_exception(answer['exceptionDetails'])}")
        return answer["result"].get("value")

    def wait_for(self, expression: str, timeout: float = 30.0) -> Any:
        """The first true value of an expression; fails with the page's errors when there is none in time."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            value = self.evaluate(expression)
            if value:
                return value
            time.sleep(0.05)
        raise AssertionError(
            f"{expression} stayed false for {timeout:g} s; errors of the page: {self.errors}"
        )

    def go(self, path: str | Path, query: str = "") -> None:
        """Open another local file, with what follows its name in the address."""
        answer = self.call("Page.navigate", url=Path(path).resolve().as_uri() + query)
        assert "errorText" not in answer, f"{path}: {answer['errorText']}"
        self.wait_for("document.readyState == 'complete'")

    def check_plays(self) -> None:
        """An animation of MeshCat that runs by itself, in a page without errors that asks for nothing."""
        self.wait_for("typeof viewer === 'object' && viewer.animator.playing")
        start = self.evaluate("viewer.animator.time")
        self.wait_for(f"viewer.animator.time !== {start}")
        assert self.evaluate("viewer.animator.playing")
        assert self.requests == [], f"the page asked the network for {self.requests}"
        assert self.errors == [], f"the page reported {self.errors}"

    def screenshot(self, path: str | Path) -> Path:
        """A PNG picture of the page."""
        picture = self.call("Page.captureScreenshot", format="png")
        Path(path).write_bytes(base64.b64decode(picture["data"]))
        return Path(path)

    def _record(self, message: dict[str, Any]) -> None:
        parameters = message.get("params", {})
        match message.get("method"):
            case "Network.requestWillBeSent" if not parameters["request"]["url"].startswith(LOCAL):
                self.requests.append(parameters["request"]["url"])
            case "Network.requestWillBeSent" if parameters["request"]["url"].startswith("file:"):
                self.files.append(parameters["request"]["url"])
            case "Network.loadingFailed" if not parameters.get("canceled"):
                self.errors.append(f"not loaded: {parameters.get('errorText')}")
            case "Network.webSocketCreated" | "Network.webTransportCreated":
                self.requests.append(parameters["url"])
            case "Runtime.exceptionThrown":
                self.errors.append(_exception(parameters["exceptionDetails"]))
            case "Runtime.consoleAPICalled" if parameters["type"] in ("error", "assert"):
                self.errors.append(" ".join(str(a.get("value", a)) for a in parameters["args"]))
            case "Log.entryAdded" if parameters["entry"]["level"] == "error":
                self.errors.append(parameters["entry"]["text"])
            case "Page.javascriptDialogOpening":
                self.errors.append(f"dialog: {parameters['message']}")
                self.pipe.send("Page.handleJavaScriptDialog", {"accept": False}, self.session)


@contextmanager
def open_page(path: str | Path, size: tuple[int, int] = (1200, 800)) -> Iterator[Page]:
    """A local HTML file, opened in a fresh browser without network; skips or fails where there is none."""
    command = [require_browser(), *FLAGS]
    folder = tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True)
    with folder as profile, _pipe([*command, f"--user-data-dir={profile}", "about:blank"]) as pipe:
        target = pipe.ask("Target.createTarget", url="about:blank")["targetId"]
        page = Page(pipe, pipe.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"])
        for domain in ("Network", "Runtime", "Log", "Page"):
            page.call(f"{domain}.enable")
        screen = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        page.call("Emulation.setDeviceMetricsOverride", **screen)
        page.go(path)
        yield page


class Pipe:
    """Messages to and from the browser: JSON, each ended by a zero byte."""

    def __init__(self, to_browser: int, from_browser: int):
        self._out, self._in = to_browser, from_browser
        self._buffer = b""
        self._count = 0

    def send(self, method: str, parameters: dict[str, Any], session: str | None = None) -> int:
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._out, data) :]
        return self._count

    def receive(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._in], [], [], TIMEOUT)
            chunk = os.read(self._in, 1 << 20) if ready else b""
            if not chunk:
                raise AssertionError(
                    "the browser ended" if ready else f"no answer of the browser in {TIMEOUT:g} s"
                )
            self._buffer += chunk
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = self.send(method, parameters)
        while (message := self.receive()).get("id") != number:
            pass
        return self.result(message)

    @staticmethod
    def result(message: dict[str, Any]) -> dict[str, Any]:
        if "error" in message:
            raise AssertionError(f"the browser refused: {message['error']}")
        return message["result"]


@contextmanager
def _pipe(command: list[str]) -> Iterator[Pipe]:
    """A running browser that reads its commands from descriptor 3 and answers on 4."""
    its_in, to_browser = os.pipe()
    from_browser, its_out = os.pipe()
    redirect = f'exec "$@" 3<&{its_in} 4>&{its_out}'
    process = subprocess.Popen(
        ["/bin/bash", "-c", redirect, "browser", *command],
        pass_fds=(its_in, its_out),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(its_in), os.close(its_out)
    try:
        pipe = Pipe(to_browser, from_browser)
        yield pipe
        pipe.ask("Browser.close")
        process.wait(timeout=10)
    finally:
        os.close(to_browser), os.close(from_browser)
        if process.poll() is None:
            process.kill()
            process.wait()


def _exception(details: dict[str, Any]) -> str:
    return str(details.get("exception", {}).get("description") or details["text"])
