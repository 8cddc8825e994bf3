"""Devices on the USB bus, by their raw reports."""

import importlib
from collections.abc import Iterator, Sequence
from typing import Any

from wbc_suite.errors import DeviceError

__all__ = ["UDEV_RULE", "open_hid", "waiting_reports"]

UDEV_RULE = 'KERNEL=="hidraw*", ATTRS{idVendor}=="%04x", MODE="0660", TAG+="uaccess"'
"""What lets a person on Linux open a device of a vendor without being root."""


def open_hid(
    kind: str, vendors: Sequence[int], products: Sequence[int], count: int = 1
) -> list[Any]:
    """Open devices; their `read(n)` returns at once, with nothing when nothing waits.

    Args:
        kind: What people call it.
        vendors: Numbers of vendors.
        products: Numbers of products.
        count: How many are needed.

    Raises:
        DeviceError: If the package is missing, or devices are, or may not be opened.
    """
    try:
        hid: Any = importlib.import_module("hid")
    except ImportError as error:
        raise DeviceError(
            f"{kind} needs the package hidapi: pip install 'wbc-suite[devices]'."
        ) from error
    found: dict[Any, dict[str, Any]] = {}
    for info in hid.enumerate():
        if info["vendor_id"] in vendors and info["product_id"] in products:
            key = info["serial_number"] or info["path"]
            found.setdefault((info["product_id"], key), info)
    if len(found) < count:
        raise DeviceError(
            f"{count} {kind} needed, {len(found)} found. Plug it in; on Linux "
            "`lsusb` shows whether the computer sees it."
        )
    opened = []
    for info in list(found.values())[:count]:
        device = hid.device()
        try:
            device.open_path(info["path"])
        except OSError as error:
            raise DeviceError(
                f"{kind} is there but may not be opened. On Linux put this line into "
                "/etc/udev/rules.d/70-wbc-suite.rules and plug it in again: "
                + UDEV_RULE
                % info["vendor_id"]
            ) from error
        device.set_nonblocking(True)
        opened.append(device)
    return opened


def waiting_reports(device: Any) -> Iterator[bytes]:
    """Yield the reports that wait; none of a device that was pulled out."""
    while True:
        try:
            report = bytes(device.read(128))
        except (OSError, ValueError):
            return
        if not report:
            return
        yield report
