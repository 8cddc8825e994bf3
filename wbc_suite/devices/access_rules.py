"""Access rules of the servers of pages and streams.

- A page of another site in the user's browser must not reach the server: the `Origin`
  of a request must be the host that it asks for. Without a token that host must be a
  loopback address, which stops DNS names that point at 127.0.0.1.
- Clients on other machines need the token. The address that opens the page carries it
  once; the answer replaces it by a cookie that scripts cannot read.
"""

import contextlib
import hmac
import ipaddress
import logging
import secrets
from http import HTTPStatus
from http.cookies import CookieError
from urllib.parse import urlsplit

from aiohttp import hdrs, web

logger = logging.getLogger(__name__)


def is_loopback(host: str) -> bool:
    """Return whether a host name or an address is this machine's loopback."""
    if host == "localhost":
        return True
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    return False


def token_for(host: str) -> str | None:
    """Return a new secret of 128 bits, valid in a URL; None for a loopback address."""
    return None if is_loopback(host) else secrets.token_urlsafe(16)


class AccessRules:
    """Decide which requests are admitted.

    Clients need the token; without one those of this machine are admitted. `cookie` is
    the name of the cookie that stands for it.
    """

    def __init__(self, token: str | None, cookie: str) -> None:
        self._token, self._cookie = token, cookie

    def refusal(self, request: web.Request) -> web.Response | None:
        """Return the refusal of a request, or None to admit it."""
        if request.method != hdrs.METH_GET:
            return _response(HTTPStatus.METHOD_NOT_ALLOWED, "Only GET is supported.")
        host = request.headers.get(hdrs.HOST, "")
        if self._token is None and not is_loopback(_host_name(host)):
            return _response(
                HTTPStatus.FORBIDDEN,
                "This page is served to this machine only: open it as 127.0.0.1.",
            )
        origin = request.headers.get(hdrs.ORIGIN)
        if origin is not None and urlsplit(origin).netloc != host:
            logger.warning("Refused a request from a page of %s.", origin)
            return _response(
                HTTPStatus.FORBIDDEN, "Requests of other sites are refused."
            )
        return None if self._token is None else self._check_token(self._token, request)

    def _check_token(self, token: str, request: web.Request) -> web.Response | None:
        with contextlib.suppress(CookieError):
            if _same(token, request.cookies.get(self._cookie, "")):
                return None
        if not _same(token, request.query.get("token", "")):
            return _response(
                HTTPStatus.UNAUTHORIZED,
                "This page needs its token: open the whole address that the terminal "
                "shows, with '?token=' and what follows.",
            )
        if request.headers.get(hdrs.UPGRADE, "").lower() == "websocket":
            return None
        response = _response(HTTPStatus.SEE_OTHER)
        path = request.rel_url.raw_path.lstrip("/\\")  # a redirect to this host only
        response.headers[hdrs.LOCATION] = f"/{path}"
        response.set_cookie(self._cookie, token, httponly=True, samesite="Lax")
        return response


def _response(status: HTTPStatus, text: str = "") -> web.Response:
    headers = {hdrs.CACHE_CONTROL: "no-store"}
    return web.Response(status=status, text=text, headers=headers)


def _same(token: str, candidate: str) -> bool:
    return hmac.compare_digest(candidate.encode(), token.encode())


def _host_name(host: str) -> str:
    """Return the name in a Host header, without its port."""
    with contextlib.suppress(ValueError):
        return urlsplit(f"//{host}").hostname or ""
    return ""
