"""Certificates: files of others, damaged ones and keys with a password."""

import random
import shutil
import subprocess
from contextlib import suppress

import pytest

from wbc_suite.errors import DeviceError
from wbc_suite.web.certificate import (
    fingerprint,
    installation_certificate,
    server_context,
)

pytestmark = pytest.mark.skipif(not shutil.which("openssl"), reason="needs openssl")


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    return installation_certificate(tmp_path_factory.mktemp("tls"))


def test_a_fingerprint_is_that_of_openssl_whatever_stands_around(pair, tmp_path):
    certificate, _ = pair
    command = ["openssl", "x509", "-noout", "-fingerprint", "-sha256", "-in"]
    told = subprocess.run([*command, certificate], capture_output=True, check=True)
    chain = tmp_path / "chain.pem"
    text = certificate.read_text()
    chain.write_bytes("Zürich\n".encode("latin-1") + f"{text}\n{text}".encode())
    assert told.stdout.decode().strip().endswith(fingerprint(chain))


def test_a_key_with_a_password_is_refused_and_not_asked_for(pair, tmp_path):
    certificate, key = pair
    locked = tmp_path / "locked.pem"
    words = ["-aes256", "-passout", "pass:secret", "-in", key, "-out", locked]
    subprocess.run(["openssl", "ec", *words], capture_output=True, check=True)
    with pytest.raises(DeviceError, match="without a password"):
        server_context(certificate, locked)


def test_damaged_files_work_or_are_told(pair, tmp_path):
    rng = random.Random(0)
    broken = tmp_path / "broken.pem"
    for k in range(100):
        content = bytearray(pair[k % 2].read_bytes())
        at = rng.randrange(len(content))
        content[at : at + rng.randrange(40)] = rng.randbytes(rng.randrange(40))
        broken.write_bytes(content)
        with suppress(DeviceError):
            server_context(*((broken, pair[1]) if k % 2 == 0 else (pair[0], broken)))
        with suppress(DeviceError):
            fingerprint(broken)
