"""What a program with pyusb and the real libusb sees of the (virtual) Kinect. Prints one line of JSON.

Run it as ``python -m virtual_kinect.usb_client`` with the environment of a ``VirtualBus``.
"""

import json
import struct
import sys
from typing import Any

import usb.core
import usb.util

_CAMERA = 0x02AE
_START = ((0x105, 0), (0x06, 0), (0x12, 3), (0x13, 1), (0x14, 30), (0x06, 2), (0x17, 0))
_POLLS = 100


class Conversation:
    """Commands to the camera and their replies."""

    def __init__(self, camera: Any) -> None:
        self._camera = camera
        self._tag = 0

    def ask(self, command: int, *words: int) -> bytes:
        """Send a command and return the payload of its reply."""
        header = struct.pack("<2sHHH", b"GM", len(words), command, self._tag)
        self._camera.ctrl_transfer(0x40, 0, 0, 0, header + struct.pack(f"<{len(words)}H", *words))
        for _ in range(_POLLS):
            reply = bytes(self._camera.ctrl_transfer(0xC0, 0, 0, 0, 512))
            if len(reply) not in {0, 512}:
                assert reply[:8] == struct.pack("<2sHHH", b"RB", len(reply) // 2 - 4, command, self._tag)
                self._tag += 1
                return reply[8:]
        raise TimeoutError(f"No reply to command {command:#x}")


def look() -> dict[str, Any]:
    """Return what there is, and what the first camera says."""
    devices = list(usb.core.find(find_all=True))
    seen: dict[str, Any] = {
        "devices": [[d.idVendor, d.idProduct, d.bus, d.address, list(d.port_numbers or ())] for d in devices]
    }
    camera = next((device for device in devices if device.idProduct == _CAMERA), None)
    if camera is None:
        return seen
    try:
        seen["kernel_driver"] = camera.is_kernel_driver_active(0)
        if seen["kernel_driver"]:
            camera.detach_kernel_driver(0)
        usb.util.claim_interface(camera, 0)
        seen["serial"] = camera.serial_number
        conversation = Conversation(camera)
        seen["constants"] = struct.unpack_from("<ffff", conversation.ask(0x04, 0, 0, 0, 0, 0), 94)
        for register, value in _START:
            conversation.ask(0x03, register, value)
        seen["fps"] = struct.unpack("<HH", conversation.ask(0x02, 0x14))[1]
        packets = bytes(camera.read(0x82, 32 * 1920, 1000))
        seen["packets"] = packets.count(b"RB\0")
    except usb.core.USBError as error:
        seen["errno"] = error.errno
    return seen


if __name__ == "__main__":
    sys.stdout.write(json.dumps(look()) + "\n")
