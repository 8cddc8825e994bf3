"""Access rules of the servers of pages and streams, without any sockets.

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
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from wbc_suite.errors import DeviceError

__all__ = ["AccessRules", "Refusal", "is_loopback", "new_token"]

logger = logging.getLogger(__name__)


def is_loopback(host: str) -> bool:
    """Return whether a host name or an address is this machine's loopback."""
    if host == "localhost":
        return True
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    return False


def new_token() -> str:
    """Return a secret of 128 bits that is valid in a URL."""
    return secrets.token_urlsafe(16)


@dataclass(frozen=True, slots=True)
class Refusal:
    """The response to a request that is not admitted."""

    status: HTTPStatus
    text: str
    headers: tuple[tuple[str, str], ...] = ()


class AccessRules:
    """Decide which requests are admitted.

    Args:
        host: Address that the server listens on.
        token: Secret that clients need; None if `host` is a loopback address.
        cookie: Name of the cookie that stands for the token.

    Raises:
        DeviceError: If the host is not a loopback address and there is no token.
    """

    def __init__(self, host: str, token: str | None, cookie: str = "") -> None:
        if token is None and not is_loopback(host):
            raise DeviceError(
                f"A server on '{host}' can be reached by others and needs a token."
            )
        self._token, self._cookie = token, cookie

    def check(
        self, method: str, target: str, headers: Mapping[str, str]
    ) -> Refusal | None:
        """Return the refusal of a request, or None to admit it.

        Args:
            method: HTTP method.
            target: Path and query.
            headers: Header fields; keys are matched without regard to case.
        """
        if method != "GET":
            return Refusal(HTTPStatus.METHOD_NOT_ALLOWED, "Only GET is supported.")
        host = headers.get("Host", "")
        if self._token is None and not is_loopback(_host_name(host)):
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "This page is served to this machine only: open it as 127.0.0.1.",
            )
        origin = headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            logger.warning("Refused a request from a page of %s.", origin)
            return Refusal(HTTPStatus.FORBIDDEN, "Requests of other sites are refused.")
        return self._check_token(target, headers)

    def _check_token(self, target: str, headers: Mapping[str, str]) -> Refusal | None:
        token = self._token
        if token is None or _same(token, _cookie(headers, self._cookie)):
            return None
        address = urlsplit(target)
        if not _same(token, parse_qs(address.query).get("token", [""])[0]):
            return Refusal(
                HTTPStatus.UNAUTHORIZED,
                "This page needs its token: open the whole address that the terminal "
                "shows, with '?token=' and what follows.",
            )
        if headers.get("Upgrade", "").lower() == "websocket":
            return None
        cookie = f"{self._cookie}={token}; HttpOnly; SameSite=Lax; Path=/"
        path = "/" + address.path.lstrip("/\\")  # a redirect to this host only
        return Refusal(
            HTTPStatus.SEE_OTHER, "", (("Location", path), ("Set-Cookie", cookie))
        )


def _same(token: str, candidate: str) -> bool:
    return hmac.compare_digest(candidate.encode(), token.encode())


def _host_name(host: str) -> str:
    """Return the name in a Host header, without its port."""
    with contextlib.suppress(ValueError):
        return urlsplit(f"//{host}").hostname or ""
    return ""


def _cookie(headers: Mapping[str, str], name: str) -> str:
    jar: SimpleCookie = SimpleCookie()
    with contextlib.suppress(CookieError):
        jar.load(headers.get("Cookie", ""))
    return jar[name].value if name in jar else ""
