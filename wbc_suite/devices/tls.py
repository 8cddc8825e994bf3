"""The TLS key and certificate of this installation; headsets need TLS for WebXR.

The key is created once, in the user's cache.
"""

import shutil
import ssl
import subprocess
from pathlib import Path

from wbc_suite.catalogue import user_cache
from wbc_suite.errors import DeviceError

DAYS = 825  # of validity; the most that browsers accept


def server_context(folder: Path | None = None) -> ssl.SSLContext:
    """Return the server side of TLS; the first call creates the key.

    Raises:
        DeviceError: If the key cannot be created or read.
    """
    folder = folder or user_cache() / "tls"
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    if not (key.exists() and certificate.exists()):
        make_key(key, certificate)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        raise DeviceError(
            f"The key in '{folder}' cannot be used: {error}. Delete the folder; the "
            "next start creates a new one."
        ) from error
    return context


def make_key(key: Path, certificate: Path) -> None:
    """Create a key that only this user can read, and a self-signed certificate.

    Raises:
        DeviceError: If the program `openssl` is missing or fails.
    """
    program = shutil.which("openssl")
    if program is None:
        raise DeviceError(
            "TLS needs a key, and the program 'openssl' to create it: install it (apt "
            f"install openssl), or put key.pem and certificate.pem into '{key.parent}'."
        )
    key.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    key.touch(mode=0o600)
    made = subprocess.run(
        [
            program, "req", "-x509", "-newkey", "ec", "-nodes", "-sha256",
            "-pkeyopt", "ec_paramgen_curve:prime256v1",
            "-days", str(DAYS), "-subj", "/CN=wbc-suite",
            "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1",
            "-keyout", str(key), "-out", str(certificate),
        ],
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    key.chmod(0o600)
    if made.returncode != 0:
        key.unlink()
        raise DeviceError(
            f"openssl failed to create a key: {made.stderr.strip()[-300:]}"
        )
