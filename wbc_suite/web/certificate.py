"""TLS: the certificate of this installation, or the user's own."""

import hashlib
import shutil
import socket
import ssl
import subprocess
from pathlib import Path

from wbc_suite.catalogue import user_config
from wbc_suite.errors import ConfigError, DeviceError
from wbc_suite.files import check_file, read_bytes
from wbc_suite.web.server import reachable_name

BEGIN, END = (f"-----{word} CERTIFICATE-----" for word in ("BEGIN", "END"))
MAX_BYTES = 1_000_000  # of a certificate or key
DAYS = 825  # of validity of a certificate; the most that browsers accept


def installation_certificate(folder: Path | None = None) -> tuple[Path, Path]:
    """Return certificate and key of this installation; the first call makes them.

    They are kept in the folder `tls` of the user's configuration.

    Raises:
        DeviceError: If the key cannot be created.
    """
    folder = folder or user_config() / "tls"
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    if not (key.exists() and certificate.exists()):
        make_certificate(certificate, key)
    return certificate, key


def server_context(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return the server side of TLS.

    Raises:
        DeviceError: If the files cannot be read, or do not belong together.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        for file in (certificate, key):
            check_file(file, most=MAX_BYTES)
        context.load_cert_chain(certificate, key, password="")  # else it is asked for
    except (OSError, ssl.SSLError, ConfigError) as error:
        raise DeviceError(
            f"Certificate '{certificate}' with key '{key}' cannot be used: {error}. "
            "Both must be PEM files without a password. If they were made by this "
            "package, delete both to have new ones made."
        ) from error
    return context


def fingerprint(certificate: Path) -> str:
    """Return the SHA-256 fingerprint of a file's first certificate, as browsers do.

    Raises:
        DeviceError: If the file holds none.
    """
    try:
        content = read_bytes(certificate, most=MAX_BYTES, error=DeviceError)
        text = content.decode("utf-8", errors="replace")
        der = ssl.PEM_cert_to_DER_cert(text[text.index(BEGIN) : text.index(END)] + END)
    except ValueError as error:
        raise DeviceError(
            f"'{certificate}' holds no PEM certificate: {error}. Delete it and its "
            "key to have new ones made."
        ) from error
    return hashlib.sha256(der).digest().hex(":").upper()


def make_certificate(certificate: Path, key: Path) -> None:
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
            "-addext", f"subjectAltName={_names()}",
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


def _names() -> str:
    """Return the names and addresses of this machine, as openssl takes them."""
    names = ["DNS:localhost", "IP:127.0.0.1"]
    host, address = socket.gethostname(), reachable_name("0.0.0.0")
    if all(label.replace("-", "").isalnum() for label in host.split(".")):
        names += [f"DNS:{host}", f"DNS:{host}.local"]
    if address != host:
        names.append(f"IP:{address}")
    return ",".join(names)
