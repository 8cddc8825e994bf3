"""Who may talk to a server of ours: the rules, without any sockets.

- A page of another site that a browser of ours happens to show must not reach us: the
  `Origin` of a request must be the host that it asks for; and without a token, that
  host must be this machine (which stops names that point at 127.0.0.1).
- Anybody beyond this machine needs the token. It comes once, in the address, and is
  traded for a cookie that scripts cannot read.
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

__all__ = ["Admission", "Refusal", "is_loopback", "new_secret"]

logger = logging.getLogger(__name__)


def is_loopback(host: str) -> bool:
    """Whether an address to listen on, or a host name asked for, is this machine's."""
    if host == "localhost":
        return True
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    return False


def new_secret() -> str:
    """Return a secret of 128 bits that may stand in an address."""
    return secrets.token_urlsafe(16)


@dataclass(frozen=True, slots=True)
class Refusal:
    """What is said to a request that is not let through."""

    status: HTTPStatus
    text: str
    headers: tuple[tuple[str, str], ...] = ()


class Admission:
    """Decides about requests by their heads.

    Args:
        host: Address that is listened on.
        token: What people must bring; None when `host` is this machine's own.
        cookie: Name of the cookie that stands for the token.

    Raises:
        DeviceError: If a token is missing.
    """

    def __init__(self, host: str, token: str | None, cookie: str) -> None:
        if token is None and not is_loopback(host):
            raise DeviceError(
                f"A server on '{host}' can be reached by others and needs a token."
            )
        self._token, self._cookie = token, cookie

    def decide(
        self, method: str, target: str, headers: Mapping[str, str]
    ) -> Refusal | None:
        """Return what keeps a request out, or None to let it in.

        Args:
            method: Of HTTP.
            target: Path and query.
            headers: By name in lower case.
        """
        if method != "GET":
            return Refusal(HTTPStatus.METHOD_NOT_ALLOWED, "Only GET is served here.")
        host = headers.get("host", "")
        if self._token is None and not is_loopback(_host_name(host)):
            return Refusal(
                HTTPStatus.FORBIDDEN,
                "This page is for this machine only: open it as 127.0.0.1.",
            )
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            logger.warning("Refused a request from a page of %s.", origin)
            return Refusal(HTTPStatus.FORBIDDEN, "Another site's page asked for this.")
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
        if headers.get("upgrade", "").lower() == "websocket":
            return None
        cookie = f"{self._cookie}={token}; HttpOnly; SameSite=Lax; Path=/"
        place = address.path if address.path.startswith("/") else "/"
        place = "/" + place.lstrip("/\\")  # never another host's
        return Refusal(
            HTTPStatus.SEE_OTHER, "", (("Location", place), ("Set-Cookie", cookie))
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
        jar.load(headers.get("cookie", ""))
    return jar[name].value if name in jar else ""
