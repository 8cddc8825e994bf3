"""USB and Bluetooth devices by their HID reports."""

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

from wbc_suite.errors import DeviceError
from wbc_suite.extras import import_extra

UDEV_RULE = 'KERNEL=="hidraw*", ATTRS{idVendor}=="%04x", MODE="0660", TAG+="uaccess"'
"""udev rule with which users on Linux may open a vendor's devices."""


def open_hid(
    kind: str, vendors: Sequence[int], products: Sequence[int], count: int = 1
) -> list[Any]:
    """Open `count` devices in non-blocking mode; `kind` names them in messages.

    Raises:
        DeviceError: If hidapi or a device is missing, or may not be opened.
    """
    hid = import_extra(
        "hid", "devices", error=DeviceError, note=f" {kind} needs hidapi."
    )
    found: dict[Any, dict[str, Any]] = {}
    for info in hid.enumerate():
        if info["vendor_id"] in vendors and info["product_id"] in products:
            key = info["serial_number"] or info["path"]
            found.setdefault((info["product_id"], key), info)
    if len(found) < count:
        raise DeviceError(
            f"{count} {kind} needed, {len(found)} found. Plug it in; on Linux "
            "`lsusb` lists connected devices."
        )
    opened = []
    for info in list(found.values())[:count]:
        device = hid.device()
        try:
            device.open_path(info["path"])
        except OSError as error:
            rule = UDEV_RULE % info["vendor_id"]
            raise DeviceError(
                f"{kind} was found but may not be opened. On Linux put this line into "
                f"/etc/udev/rules.d/70-wbc-suite.rules and plug it in again: {rule}"
            ) from error
        device.set_nonblocking(True)
        opened.append(device)
    return opened


def waiting_reports(device: Any) -> Iterator[bytes]:
    """Yield the queued reports; none if the device was unplugged."""
    with contextlib.suppress(OSError, ValueError):
        while report := bytes(device.read(128)):
            yield report
