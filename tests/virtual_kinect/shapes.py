"""What each USB device of a Kinect v1 says of itself: its descriptors, as data and as the bytes on the wire.

Layouts are those of USB 2.0, chapter 9.6. Standard library alone: Debian's own Python imports this, too.
"""

import struct
from dataclasses import dataclass

DEVICE, CONFIGURATION, STRING, INTERFACE, ENDPOINT = 1, 2, 3, 4, 5  # descriptor types
VENDOR_CLASS, HUB_CLASS = 0xFF, 0x09
ISOCHRONOUS_ASYNCHRONOUS = 0x05
_LANGUAGE = 0x0409  # US English
_MANUFACTURER, _PRODUCT, _SERIAL = 1, 2, 3  # string indices


@dataclass(frozen=True, slots=True)
class Endpoint:
    """An endpoint of an interface; ``max_packet`` is wMaxPacketSize as it stands in the descriptor."""

    address: int
    attributes: int = ISOCHRONOUS_ASYNCHRONOUS
    max_packet: int = 0x0BC0
    interval: int = 1

    @property
    def packet_bytes(self) -> int:
        """The most bytes in one microframe: bits 0..10, times one more than bits 11 and 12."""
        return (self.max_packet & 0x7FF) * (((self.max_packet >> 11) & 3) + 1)

    def encoded(self) -> bytes:
        return struct.pack("<BBBBHB", 7, ENDPOINT, self.address, self.attributes, self.max_packet, self.interval)


@dataclass(frozen=True, slots=True)
class Shape:
    """A device as it enumerates: one configuration with one interface, which has ``alternates`` equal settings."""

    product_id: int
    product: str
    serial: str | None = None
    device_release: int = 0x0100  # bcdDevice
    vendor_id: int = 0x045E
    interface_class: int = VENDOR_CLASS
    endpoints: tuple[Endpoint, ...] = ()
    alternates: int = 1
    speed_mbit: int = 480

    @property
    def device_class(self) -> int:
        return HUB_CLASS if self.interface_class == HUB_CLASS else 0

    @property
    def serial_index(self) -> int:
        """The index of the serial's string descriptor, 0 for none."""
        return _SERIAL if self.serial is not None else 0

    def device_descriptor(self) -> bytes:
        return struct.pack(
            "<BBHBBBBHHHBBBB",
            *(18, DEVICE, 0x0200, self.device_class, 0, 0, 64),
            *(self.vendor_id, self.product_id, self.device_release),
            *(_MANUFACTURER, _PRODUCT, self.serial_index, 1),
        )

    def configuration_descriptor(self) -> bytes:
        settings = b"".join(self._interface(alternate) for alternate in range(self.alternates))
        return struct.pack("<BBHBBBBB", 9, CONFIGURATION, 9 + len(settings), 1, 1, 0, 0xC0, 8) + settings

    def _interface(self, alternate: int) -> bytes:
        head = (9, INTERFACE, 0, alternate, len(self.endpoints), self.interface_class, 0, 0, 0)
        return bytes(head) + b"".join(endpoint.encoded() for endpoint in self.endpoints)

    def string_descriptor(self, index: int) -> bytes | None:
        """Return the string descriptor ``index``, the list of languages for 0, None where there is none."""
        if index == 0:
            return struct.pack("<BBH", 4, STRING, _LANGUAGE)
        texts = {_MANUFACTURER: "Microsoft", _PRODUCT: self.product, _SERIAL: self.serial}
        text = texts.get(index)
        if text is None:
            return None
        encoded = text.encode("utf-16-le")
        return bytes((2 + len(encoded), STRING)) + encoded


VIDEO_ENDPOINT, DEPTH_ENDPOINT = 0x81, 0x82
NO_CAMERA_SERIAL = "0000000000000000"  # what a 1473 and a Kinect for Windows say
RELEASE_1414 = 0x010B
_ISOCHRONOUS = (Endpoint(VIDEO_ENDPOINT), Endpoint(DEPTH_ENDPOINT))

ROOT_HUB = Shape(0x0002, "Virtual host controller", vendor_id=0x1D6B, interface_class=HUB_CLASS)
HUB = Shape(0x02C2, "Kinect hub", interface_class=HUB_CLASS)
MOTOR = Shape(0x02B0, "Xbox NUI Motor", device_release=0x0105, speed_mbit=12)


def camera_1414(serial: str) -> Shape:
    return Shape(0x02AE, "Xbox NUI Camera", serial, RELEASE_1414, endpoints=_ISOCHRONOUS)


def camera_1473() -> Shape:
    return Shape(0x02AE, "Xbox NUI Camera", NO_CAMERA_SERIAL, 0x020B, endpoints=_ISOCHRONOUS)


def camera_k4w() -> Shape:
    return Shape(0x02BF, "Kinect for Windows Camera", NO_CAMERA_SERIAL, 0x0211, endpoints=_ISOCHRONOUS, alternates=2)


def audio(serial: str) -> Shape:
    return Shape(0x02AD, "Xbox NUI Audio", serial)


def audio_k4w(serial: str) -> Shape:
    return Shape(0x02BE, "Kinect for Windows Audio", serial)
