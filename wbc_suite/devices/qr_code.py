"""QR codes of short texts such as addresses, without another library.

Bytes in versions 1 to 5 with error correction L, which is one block: up to 106 bytes.
Source: ISO/IEC 18004:2015; the section is named where it is used.
"""

import numpy as np

from wbc_suite.errors import DeviceError

DATA = (19, 34, 55, 80, 108)  # data codewords of versions 1 to 5 with level L, table 7
CORRECTION = (7, 10, 15, 20, 26)  # error correction codewords, table 9
FIELD = 0x11D  # x^8 + x^4 + x^3 + x^2 + 1 generates GF(256), 7.5.2
LEVEL = 0b01  # L, table 12
MASKS = (  # table 10; row i, column j
    lambda i, j: (i + j) % 2,
    lambda i, j: i % 2 + 0 * j,
    lambda i, j: j % 3 + 0 * i,
    lambda i, j: (i + j) % 3,
    lambda i, j: (i // 2 + j // 3) % 2,
    lambda i, j: i * j % 2 + i * j % 3,
    lambda i, j: (i * j % 2 + i * j % 3) % 2,
    lambda i, j: ((i + j) % 2 + i * j % 3) % 2,
)
FINDER = np.array(
    [[max(abs(i), abs(j)) != 2 for j in range(-3, 4)] for i in range(-3, 4)]
)
ALIGNMENT = np.array(
    [[max(abs(i), abs(j)) != 1 for j in range(-2, 3)] for i in range(-2, 3)]
)
QUIET = 4  # light modules around the code, 5.3.8


def qr_code(text: str) -> np.ndarray:
    """Return the modules of a QR code, True for dark, shape (n, n), without margin.

    Raises:
        DeviceError: If the text has more than 106 bytes.
    """
    data = text.encode()
    fits = [v for v, size in enumerate(DATA, start=1) if len(data) + 2 <= size]
    if not fits:
        raise DeviceError(f"A QR code takes at most 106 bytes, not {len(data)}.")
    version = fits[0]
    codewords = _codewords(data, version)
    modules, free = _patterns(version)
    codes = [_masked(modules, free, codewords, mask) for mask in range(len(MASKS))]
    return min(codes, key=_penalty)


def qr_text(text: str) -> str:
    """Return a QR code for a terminal, two rows of modules to a line."""
    code = np.pad(qr_code(text), QUIET)
    code = np.pad(code, ((0, len(code) % 2), (0, 0)))
    rows = ("".join(" ▀▄█"[2 * b + a] for a, b in zip(*pair, strict=True))
            for pair in zip(~code[::2], ~code[1::2], strict=True))  # fmt: skip
    return "\n".join(rows)


def qr_svg(text: str) -> str:
    """Return a QR code as an SVG picture."""
    code = np.pad(qr_code(text), QUIET)
    path = "".join(f"M{x} {y}h1v1h-1z" for y, x in np.argwhere(code))
    size = len(code)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size} {size}" '
        f'shape-rendering="crispEdges"><rect width="{size}" height="{size}" '
        f'fill="#fff"/><path d="{path}"/></svg>'
    )


def _codewords(data: bytes, version: int) -> list[int]:
    """Return data codewords followed by those of error correction, 7.4 and 7.5."""
    size = DATA[version - 1]
    bits = f"0100{len(data):08b}" + "".join(f"{byte:08b}" for byte in data) + "0000"
    filled = [int(bits[k : k + 8], 2) for k in range(0, len(bits), 8)]
    filled += [0xEC if k % 2 == 0 else 0x11 for k in range(size - len(filled))]
    return filled + _remainder(filled, CORRECTION[version - 1])


def _remainder(data: list[int], degree: int) -> list[int]:
    """Return the remainder of a division by the generator of this degree, 7.5.2."""
    generator, root = [1], 1
    for _ in range(degree):
        shifted = [*generator, 0]
        scaled = [0, *(_product(value, root) for value in generator)]
        generator = [a ^ b for a, b in zip(shifted, scaled, strict=True)]
        root = _product(root, 2)
    rest = [0] * degree
    for value in data:
        factor = value ^ rest[0]
        rest = [
            a ^ _product(factor, b)
            for a, b in zip([*rest[1:], 0], generator[1:], strict=True)
        ]
    return rest


def _product(a: int, b: int) -> int:
    """Return the product of two elements of GF(256)."""
    product = 0
    while b:
        product ^= a if b & 1 else 0
        a = a << 1 ^ (FIELD if a & 0x80 else 0)
        b >>= 1
    return product


def _patterns(version: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the function patterns, 6.3, and which modules are left for data."""
    n = 17 + 4 * version
    modules, free = np.zeros((n, n), dtype=bool), np.ones((n, n), dtype=bool)
    modules[6, ::2] = modules[::2, 6] = True
    free[6, :] = free[:, 6] = False
    for rows, columns in ((slice(0, 9), slice(0, 9)), (slice(0, 9), slice(n - 8, n)),
                          (slice(n - 8, n), slice(0, 9))):  # fmt: skip
        modules[rows, columns] = free[rows, columns] = False
    for row, column in ((0, 0), (0, n - 7), (n - 7, 0)):
        modules[row : row + 7, column : column + 7] = FINDER
    if version > 1:
        modules[n - 9 : n - 4, n - 9 : n - 4] = ALIGNMENT
        free[n - 9 : n - 4, n - 9 : n - 4] = False
    modules[n - 8, 8] = True
    return modules, free


def _masked(
    modules: np.ndarray, free: np.ndarray, codewords: list[int], mask: int
) -> np.ndarray:
    """Return the code with its data under a mask, 7.7.3 and 7.8, and format, 7.9."""
    code, n = modules.copy(), len(modules)
    bits = iter("".join(f"{word:08b}" for word in codewords))
    columns = [c for c in range(n - 1, 0, -2) if c > 6] + [5, 3, 1]
    for k, right in enumerate(columns):
        for row in range(n - 1, -1, -1) if k % 2 == 0 else range(n):
            for column in (right, right - 1):
                if free[row, column]:
                    dark = next(bits, "0") == "1"
                    code[row, column] = dark ^ (MASKS[mask](row, column) == 0)
    information = _format(mask)
    for k in range(15):
        bit = bool(information >> k & 1)
        code[(*range(6), 7, 8, *range(n - 7, n))[k], 8] = bit
        code[8, (*range(n - 1, n - 9, -1), 7, *range(5, -1, -1))[k]] = bit
    return code


def _format(mask: int) -> int:
    """Return the 15 bits of level and mask, 7.9.1."""
    value = LEVEL << 3 | mask
    rest = value << 10
    for k in range(4, -1, -1):
        if rest >> k + 10 & 1:
            rest ^= 0x537 << k
    return (value << 10 | rest) ^ 0x5412


def _penalty(code: np.ndarray) -> int:
    """Return how hard a code is to read, 7.8.3: runs, blocks, and the share of dark."""
    score = 0
    for lines in (code, code.T):
        for line in lines:
            edges = np.flatnonzero(np.diff(line)) + 1
            runs = np.diff(np.concatenate([[0], edges, [len(line)]]))
            score += int((runs[runs >= 5] - 2).sum())
            text = "".join("1" if dark else "0" for dark in line)
            score += 40 * (text.count("10111010000") + text.count("00001011101"))
    same = (code[1:, 1:] == code[:-1, 1:]) & (code[1:, 1:] == code[1:, :-1])
    score += 3 * int((same & (code[1:, 1:] == code[:-1, :-1])).sum())
    return score + 10 * int(abs(code.mean() - 0.5) * 20)
