"""QR codes, read back by a reader of their own: table of logarithms, zigzag, masks."""

import numpy as np
import pytest

from wbc_suite.devices.qr_code import qr_code, qr_svg, qr_text
from wbc_suite.errors import DeviceError

POWERS = [1]
for _ in range(254):
    doubled = 2 * POWERS[-1]
    POWERS.append(doubled ^ 0x11D if doubled > 255 else doubled)
LOGS = {power: k for k, power in enumerate(POWERS)}
SIZES = {21: (19, 7), 25: (34, 10), 29: (55, 15), 33: (80, 20), 37: (108, 26)}
CONDITIONS = (
    lambda i, j: (i + j) % 2,
    lambda i, j: i % 2,
    lambda i, j: j % 3,
    lambda i, j: (i + j) % 3,
    lambda i, j: (i // 2 + j // 3) % 2,
    lambda i, j: (i * j) % 2 + (i * j) % 3,
    lambda i, j: ((i * j) % 2 + (i * j) % 3) % 2,
    lambda i, j: ((i + j) % 2 + (i * j) % 3) % 2,
)


def is_function(n, i, j):
    finder = (i < 9 and j < 9) or (i < 9 and j >= n - 8) or (i >= n - 8 and j < 9)
    aligned = n > 21 and n - 9 <= i <= n - 5 and n - 9 <= j <= n - 5
    return finder or aligned or i == 6 or j == 6


def read(code):
    """Return the codewords and the text of a code."""
    n = len(code)
    bits = [int(code[8, j]) for j in (0, 1, 2, 3, 4)]  # level and mask
    level_and_mask = int("".join(map(str, bits)), 2) ^ 0b10101
    assert level_and_mask >> 3 == 0b01  # level L
    condition = CONDITIONS[level_and_mask & 7]
    stream, column, up = [], n - 1, True
    while column > 0:
        column -= column == 6
        for i in range(n - 1, -1, -1) if up else range(n):
            for j in (column, column - 1):
                if not is_function(n, i, j):
                    stream.append(int(code[i, j]) ^ (condition(i, j) == 0))
        column, up = column - 2, not up
    words = [
        int("".join(map(str, stream[k : k + 8])), 2)
        for k in range(0, len(stream) - 7, 8)
    ]
    assert words[0] >> 4 == 0b0100  # bytes
    size = (words[0] & 15) << 4 | words[1] >> 4
    data = [(words[k + 1] & 15) << 4 | words[k + 2] >> 4 for k in range(size)]
    return words, bytes(data).decode()


def syndrome(words, k):
    """Return the value of the codewords' polynomial at the k-th power of 2."""
    value = 0
    for word in words:
        value = (POWERS[(LOGS[value] + k) % 255] if value else 0) ^ word
    return value


@pytest.mark.parametrize("size", [0, 1, 17, 18, 32, 53, 60, 78, 79, 106])
def test_code_is_read_back_and_its_error_correction_is_right(size):
    text = "".join(chr(33 + (7 * k + size) % 90) for k in range(size))
    code = qr_code(text)
    words, found = read(code)
    assert found == text
    total, correction = sum(SIZES[len(code)]), SIZES[len(code)][1]
    assert len(words) == total
    assert [syndrome(words, k) for k in range(correction)] == [0] * correction


def test_text_and_picture_show_the_same_modules():
    code = qr_code("https://192.168.1.23:8090/?token=abc")
    lines = qr_text("https://192.168.1.23:8090/?token=abc").splitlines()
    halves = {" ": (1, 1), "▀": (0, 1), "▄": (1, 0), "█": (0, 0)}
    shown = np.array([[halves[c] for c in line] for line in lines])
    shown = shown.transpose(0, 2, 1).reshape(-1, shown.shape[1])
    margin = (shown.shape[1] - len(code)) // 2
    inside = slice(margin, margin + len(code))
    np.testing.assert_array_equal(shown[inside, inside].astype(bool), code)
    assert margin >= 4
    assert qr_svg("x").count("h1v1h-1z") == qr_code("x").sum()


def test_a_long_text_is_refused():
    with pytest.raises(DeviceError, match="106 bytes"):
        qr_code("x" * 107)
