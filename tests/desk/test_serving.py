"""Desk in a browser: token, loopback, and a design that is edited and saved in headless Chromium."""

from __future__ import annotations

import asyncio
import base64
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("textual_serve")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ADDRESS = re.compile(r"railui desk: (http://127\.0\.0\.1:(\d+)/\?token=(\S+))")
DEVTOOLS = re.compile(r"DevTools listening on ws://127\.0\.0\.1:(\d+)/")


@pytest.fixture
def served(bogie: Path, tmp_path: Path) -> Iterator[str]:
    """Address of a desk that is served with a design."""
    words = [sys.executable, "-m", "railui", "desk", "--serve", "--port", "0", str(bogie)]
    environment = os.environ | {"XDG_STATE_HOME": str(tmp_path / "state")}
    with subprocess.Popen(words, stdout=subprocess.PIPE, env=environment, text=True) as process:
        assert process.stdout is not None
        match = ADDRESS.match(process.stdout.readline())
        assert match is not None
        _wait_until_listening(int(match[2]))
        yield match[1]
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0


def _wait_until_listening(port: int, seconds: float = 30.0) -> None:
    for _ in range(int(seconds / 0.1)):
        with socket.socket() as connection:
            if connection.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise AssertionError(f"nothing listens on port {port}")


def status(url: str, headers: dict[str, str] | None = None) -> int:
    """Return the status of a request without following a redirection."""

    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: Any) -> None:
            return None

    try:
        with urllib.request.build_opener(Stay).open(urllib.request.Request(url, headers=headers or {})) as reply:
            return int(reply.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_every_request_needs_the_token(served: str) -> None:
    base, token = served.split("/?token=")
    for path in ("/", "/?token=wrong", "/static/js/textual.js", "/ws", "/download/x"):
        assert status(base + path) == 403
    assert status(served) == 302
    cookie = {"Cookie": f"railui_desk={token}"}
    assert status(f"{base}/", cookie) == 200
    assert status(f"{base}/ws", cookie | {"Origin": "http://elsewhere.example"}) == 403


def test_a_short_token_and_a_used_port_are_refused(served: str, bogie: Path) -> None:
    port = served.split(":")[2].split("/")[0]
    words = [sys.executable, "-m", "railui", "desk", "--serve", str(bogie), "--port"]
    process = subprocess.run([*words, port], capture_output=True, text=True, timeout=60)
    assert process.returncode == 1 and "cannot serve the desk" in process.stderr
    environment = os.environ | {"RAILUI_DESK_TOKEN": "short"}
    process = subprocess.run([*words, "0"], capture_output=True, text=True, timeout=60, env=environment)
    assert process.returncode == 1 and "less than 16 characters" in process.stderr


class Browser:
    """Page of headless Chromium, driven over its DevTools protocol."""

    def __init__(self, socket: Any) -> None:
        self.socket, self.number = socket, 0

    async def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method and return its result."""
        self.number += 1
        await self.socket.send_json({"id": self.number, "method": method, "params": parameters})
        while True:
            message = await self.socket.receive_json()
            if message.get("id") == self.number:
                return dict(message["result"])

    async def value(self, expression: str) -> Any:
        """Evaluate JavaScript."""
        result = await self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        return result["result"].get("value")

    async def key(self, key: str, code: int, modifiers: int = 0) -> None:
        """Press a key."""
        for kind in ("rawKeyDown", "keyUp"):
            await self.call(
                "Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, modifiers=modifiers
            )

    async def picture(self) -> bytes:
        """Return a screenshot as PNG."""
        return base64.b64decode((await self.call("Page.captureScreenshot"))["data"])


async def until(condition: Any, seconds: float = 90.0) -> None:
    """Wait until an asynchronous condition holds."""
    end = time.monotonic() + seconds
    while not await condition():
        assert time.monotonic() < end, "the condition was not met"
        await asyncio.sleep(0.2)


async def edit_in_browser(browser: Browser, url: str, design: Path, picture: Path) -> None:
    """Move a slider and save the design with keys in the browser."""
    await browser.call("Page.enable")
    await browser.call("Page.navigate", url=url)

    async def is_drawn() -> bool:
        return bool(await browser.value("document.body && document.body.classList.contains('-first-byte')"))

    await until(is_drawn)
    assert "token" not in await browser.value("location.href")
    before = design.read_text()
    await asyncio.sleep(3.0)
    await browser.value("document.querySelector('textarea').focus()")
    for _ in range(4):
        await browser.key("ArrowDown", 40)
    await browser.key("ArrowRight", 39)
    await asyncio.sleep(2.0)

    async def is_saved() -> bool:
        await browser.key("s", 83, modifiers=2)
        await asyncio.sleep(1.0)
        return design.read_text() != before

    await until(is_saved)

    async def is_pictured() -> bool:
        picture.write_bytes(await browser.picture())
        return picture.stat().st_size > 20_000  # a drawn desk, not an empty page

    await until(is_pictured)


@pytest.mark.asyncio
@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
async def test_a_design_is_edited_and_saved_in_a_browser(served: str, bogie: Path, tmp_path: Path) -> None:
    from aiohttp import ClientSession

    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    words += [f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1280,800", "about:blank"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as chromium:
        assert chromium.stderr is not None
        try:
            found = next(m for line in chromium.stderr if (m := DEVTOOLS.search(line)))
            async with ClientSession() as session:
                async with session.get(f"http://127.0.0.1:{found[1]}/json/list") as reply:
                    pages = await reply.json()
                target = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
                async with session.ws_connect(target, max_msg_size=0) as socket:
                    picture = Path(os.environ.get("RAILUI_PICTURE", tmp_path / "desk.png"))
                    await edit_in_browser(Browser(socket), served, bogie, picture)
        finally:
            chromium.terminate()
            chromium.wait(20)
