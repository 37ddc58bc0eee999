"""Access to the page and its buttons, checked before anything else in a request.

A page of another site must not reach the robot through a person's browser, neither by sending requests (CSRF) nor by
having its own name resolved to this computer (DNS rebinding). And other users of this computer must not get past the
control socket's permissions: where the page is on a port, only who was told its key gets in.
"""

from __future__ import annotations

import hmac
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from secrets import token_urlsafe

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

KEY_BYTES = 18
"""144 bits: cannot be guessed."""
COOKIE = "hvcpd-console"
"""Beginning of the cookie's name. The port follows: browsers keep cookies by host alone, and a second page at another
port would take the first one's key away."""
TOKEN_HEADER = "x-hvcpd-token"
"""A form of another site cannot set this header (Fetch standard, CORS)."""
MAX_BODY_BYTES = 4096

_LOOPBACK = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?")

SAFETY_HEADERS: Mapping[str, str] = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "media-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


@dataclass(frozen=True)
class PageAccess:
    """Who may open the page, and the secrets of this run.

    `hosts`: accepted Host headers besides those of the loopback interface; `key`: needed to open the page, None where
    a socket's permissions protect it; `token`: sent by the page's own buttons.
    """

    hosts: frozenset[str] = frozenset()
    key: str | None = None
    token: str = field(default_factory=lambda: token_urlsafe(KEY_BYTES))

    def knows(self, host: str) -> bool:
        """Whether a Host header names this page."""
        return _LOOPBACK.fullmatch(host.lower()) is not None or host.lower() in self.hosts


class Guard:
    """ASGI middleware: refuses requests that do not come from the page itself, and adds SAFETY_HEADERS to responses."""

    def __init__(self, app: ASGIApp, access: PageAccess) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in SAFETY_HEADERS.items():
                    headers[name] = value
                headers.setdefault("cache-control", "no-store")
            await send(message)

        refusal = self._refusal(Request(scope))
        await (refusal or self._app)(scope, receive, send_safely)

    def _refusal(self, request: Request) -> Response | None:
        if not self._access.knows(request.headers.get("host", "")):
            return _refuse(HTTPStatus.MISDIRECTED_REQUEST, "This page is not served under that name.")
        if request.method not in ("GET", "HEAD") and not self._is_from_page(request.headers):
            return _refuse(HTTPStatus.FORBIDDEN, "Only the page itself may ask for that.")
        return self._key_refusal(request)

    def _is_from_page(self, headers: Headers) -> bool:
        origin = headers.get("origin", "")
        return origin in (f"http://{headers['host']}", f"https://{headers['host']}") and _same(
            headers.get(TOKEN_HEADER, ""), self._access.token
        )

    def _key_refusal(self, request: Request) -> Response | None:
        key, cookie = self._access.key, COOKIE + re.sub(r"\W", "", request.headers["host"])
        if key is None or _same(request.cookies.get(cookie, ""), key):
            return None
        if request.url.path == "/" and _same(request.query_params.get("key", ""), key):
            answer = RedirectResponse("/", HTTPStatus.SEE_OTHER)
            answer.set_cookie(cookie, key, httponly=True, samesite="strict", path="/")
            return answer
        return _refuse(HTTPStatus.FORBIDDEN, "Open the whole address that `hvcpctl console` printed, with its key.")


def _same(given: str, right: str) -> bool:
    """Compare in constant time."""
    return hmac.compare_digest(given.encode(), right.encode())


def _refuse(status: HTTPStatus, text: str) -> Response:
    return PlainTextResponse(text + "\n", status)
