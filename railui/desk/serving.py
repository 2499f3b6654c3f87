"""Desk in a browser: a web server that asks for a token and by default listens on loopback only."""

from __future__ import annotations

import hmac
import os
import secrets
import shlex
import socket
import sys
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Final

from aiohttp import web
from textual_serve.server import Server

COOKIE: Final = "railui_desk"
TOKEN_VARIABLE: Final = "RAILUI_DESK_TOKEN"  # name of a variable
MIN_TOKEN_CHARACTERS: Final = 16
LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")
REFUSED: Final = "railui desk: open the address with its token that `railui desk --serve` has printed\n"
# nothing is loaded from other machines: a depot may have no other network
CONTENT_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; frame-ancestors 'none'"
)

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class TokenServer(Server):  # type: ignore[misc,unused-ignore]  # textual-serve has no types
    """Server of the desk; every request needs the token, as a query once and as a cookie from then on."""

    def __init__(self, command: str, host: str, port: int, token: str, shown_host: str) -> None:
        super().__init__(command, host=host, port=port, title="railui")
        self.token = token
        self.address = f"http://{shown_host}:{port}/?token={token}"

    def initialize_logging(self) -> None:
        """Log nothing but warnings: addresses contain the token."""

    async def on_startup(self, app: web.Application) -> None:
        """Print the address."""
        print(f"railui desk: {self.address}", flush=True)
        if self.host not in LOOPBACK:
            print("Other machines can open it with this address. It is not encrypted, and the desk has your rights.")
        print("ctrl+c ends it", flush=True)

    async def _make_app(self) -> web.Application:
        app = await super()._make_app()
        app.middlewares.append(self.check_token)
        return app

    @web.middleware
    async def check_token(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse a request without the token, or a connection that a page of another site opens."""
        given = request.query.get("token", "")
        if request.path == "/" and self._is_token(given):
            response: web.StreamResponse = web.HTTPFound("/")
            response.set_cookie(COOKIE, self.token, httponly=True, samesite="Strict")
            return response
        origin = request.headers.get("Origin")
        is_foreign = origin is not None and origin.partition("://")[2] != request.host
        if is_foreign or not self._is_token(request.cookies.get(COOKIE, "")):
            raise web.HTTPForbidden(text=REFUSED)
        response = await handler(request)
        if not response.prepared:
            response.headers["Content-Security-Policy"] = CONTENT_POLICY
            response.headers["Referrer-Policy"] = "no-referrer"
        return response

    async def handle_index(self, request: web.Request) -> web.StreamResponse:
        """Return the page, whose addresses are those of the request."""
        self.public_url = str(request.url.origin())
        page: web.StreamResponse = await super().handle_index(request)
        return page

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self.token.encode())


def serve(words: Sequence[str], host: str, port: int) -> int:
    """Serve the desk until ctrl+c; return the exit code.

    Parameters
    ----------
    words
        Arguments of `railui desk` for every browser that connects.
    host, port
        Address to listen on; port 0: any free one.

    Raises
    ------
    OSError
        If the address cannot be used.
    ValueError
        If the token of the environment is too short.
    """
    token = os.environ.get(TOKEN_VARIABLE) or secrets.token_urlsafe(18)
    if len(token) < MIN_TOKEN_CHARACTERS:
        raise ValueError(f"{TOKEN_VARIABLE} has less than {MIN_TOKEN_CHARACTERS} characters")
    command = shlex.join([sys.executable, "-m", "railui", "desk", *words])
    port = checked_port(host, port)
    shown = socket.gethostname() if host in ("0.0.0.0", "::") else host  # compared, not bound
    TokenServer(command, host, port, token, shown).serve()
    return 0


def checked_port(host: str, port: int) -> int:
    """Return a port that is free on an address; raise OSError if it is not."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        return int(probe.getsockname()[1])


def served_words(file: str | None, plain: bool) -> list[str]:
    """Return the arguments of the desk of a browser.

    >>> served_words(None, True)
    ['--plain']
    """
    return [*(["--plain"] if plain else []), *([str(Path(file).resolve())] if file else [])]
