"""The virtual Kinect as a backend of pyusb: no libusb, no kernel, and time passes only as packets are read.

Behaves as pyusb's libusb1 backend does, down to its errors and to what its iso_read throws away.
"""

import errno
import os
import struct
from array import array
from types import SimpleNamespace
from typing import Any, Never

import usb.backend
import usb.core

from virtual_kinect.bus import Bus
from virtual_kinect.model import Device, DeviceClock, Handle, Setup, UsbError
from virtual_kinect.shapes import CONFIGURATION, ENDPOINT, INTERFACE

_LIBUSB_CODES = {
    errno.EIO: -1,
    errno.EINVAL: -2,
    errno.EACCES: -3,
    errno.ENODEV: -4,
    errno.ENOENT: -5,
    errno.EBUSY: -6,
    errno.ETIMEDOUT: -7,
    errno.EPIPE: -9,
}
# No driver is bound; no memory for a transfer, which libusb 1.0.26 reports as any failed submission.
_MADE_OTHERS_BY_LIBUSB = {errno.ENODATA: errno.ENOENT, errno.ENOMEM: errno.EIO}
_SPEEDS = {12: 2, 480: 3}  # libusb_speed
_DEVICE_FIELDS = (
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 idVendor idProduct "
    "bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations"
)
_FIELDS = {
    CONFIGURATION: (
        "<BBHBBBBB",
        "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration bmAttributes bMaxPower",
    ),
    INTERFACE: (
        "<9B",
        "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass bInterfaceSubClass "
        "bInterfaceProtocol iInterface",
    ),
    ENDPOINT: ("<BBBBHB", "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval"),
}


class ModelBackend(usb.backend.IBackend):  # type: ignore[misc]
    """Give it to ``usb.core.find(backend=...)``. ``clock`` advances by the packets of every isochronous read."""

    def __init__(self, bus: Bus, clock: DeviceClock) -> None:
        super().__init__()
        self._bus = bus
        self._clock = clock

    def enumerate_devices(self) -> list[Device]:
        return self._bus.devices

    def get_parent(self, dev: Device) -> Device | None:
        return self._bus.parent(dev)

    def get_device_descriptor(self, dev: Device) -> SimpleNamespace:
        values = struct.unpack("<BBHBBBBHHHBBBB", dev.shape.device_descriptor())
        return SimpleNamespace(
            **dict(zip(_DEVICE_FIELDS.split(), values, strict=True)),
            bus=dev.bus,
            address=dev.address,
            speed=_SPEEDS[dev.shape.speed_mbit],
            port_number=dev.ports[-1] if dev.ports else 0,
            port_numbers=dev.ports or None,
        )

    def get_configuration_descriptor(self, dev: Device, config: int) -> SimpleNamespace:
        if config != 0:
            raise IndexError(f"Invalid configuration index {config}")
        return _descriptors(dev)[0]

    def get_interface_descriptor(self, dev: Device, intf: int, alt: int, config: int) -> SimpleNamespace:
        settings = [one for one in _descriptors(dev) if one.bDescriptorType == INTERFACE]
        if config != 0 or intf != 0 or alt >= len(settings):
            raise IndexError(f"Invalid interface index {intf}, alternate setting {alt}")
        return settings[alt]

    def get_endpoint_descriptor(self, dev: Device, ep: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        count = self.get_interface_descriptor(dev, intf, alt, config).bNumEndpoints
        endpoints = [one for one in _descriptors(dev) if one.bDescriptorType == ENDPOINT]
        return endpoints[alt * count : (alt + 1) * count][ep]

    def open_device(self, dev: Device) -> Handle:
        try:
            return Handle(dev)
        except UsbError as error:
            _raise(error)

    def close_device(self, dev_handle: Handle) -> None:
        dev_handle.close()

    def get_configuration(self, dev_handle: Handle) -> int:
        del dev_handle
        return 1

    def set_configuration(self, dev_handle: Handle, config_value: int) -> None:
        if dev_handle.device.kernel_driver is not None:
            _raise(UsbError(errno.EBUSY))
        self.ctrl_transfer(dev_handle, 0x00, 9, config_value, 0, array("B"), 0)

    def set_interface_altsetting(self, dev_handle: Handle, intf: int, altsetting: int) -> None:
        del intf
        try:
            dev_handle.set_alternate(altsetting)
        except UsbError as error:
            _raise(error)

    def claim_interface(self, dev_handle: Handle, intf: int) -> None:
        if intf != 0:
            _raise(UsbError(errno.ENOENT))
        try:
            dev_handle.claim()
        except UsbError as error:
            _raise(error)

    def release_interface(self, dev_handle: Handle, intf: int) -> None:
        del intf
        dev_handle.release()

    def is_kernel_driver_active(self, dev_handle: Handle, intf: int) -> bool:
        del intf
        try:
            dev_handle.device.check()
        except UsbError as error:
            _raise(error)
        return dev_handle.device.kernel_driver is not None

    def detach_kernel_driver(self, dev_handle: Handle, intf: int) -> None:
        del intf
        try:
            dev_handle.detach_kernel_driver()
        except UsbError as error:
            _raise(error)

    def attach_kernel_driver(self, dev_handle: Handle, intf: int) -> None:
        del intf
        dev_handle.device.attach_kernel_driver()

    def reset_device(self, dev_handle: Handle) -> None:
        try:
            dev_handle.reset()
        except UsbError as error:
            _raise(error)

    def ctrl_transfer(
        self,
        dev_handle: Handle,
        bmRequestType: int,  # noqa: N803
        bRequest: int,  # noqa: N803
        wValue: int,  # noqa: N803
        wIndex: int,  # noqa: N803
        data: "array[int]",
        timeout: int,
    ) -> int:
        del timeout
        setup = Setup(bmRequestType, bRequest, wValue, wIndex)
        length = len(data) * data.itemsize
        try:
            answer = dev_handle.device.control(setup, data.tobytes(), length)
        except UsbError as error:
            _raise(error)
        if not bmRequestType & 0x80:
            return length
        _fill(data, 0, answer)
        return len(answer)

    def iso_read(self, dev_handle: Handle, ep: int, intf: int, buff: "array[int]", timeout: int) -> int:
        """Do one transfer. As in pyusb, packets lie at multiples of the greatest size and their lengths are lost."""
        del intf, timeout
        device = dev_handle.device
        try:
            size = device.check_endpoint(ep)
            dev_handle.need_claim()
            dev_handle.hold_iso_memory(len(buff))
            dev_handle.free_iso_memory(len(buff))
            count = -(-len(buff) // size)
            first = self._clock.microframe() + 1
            packets = device.iso_packets(ep, first, count)
        except UsbError as error:
            _raise(error)
        self._clock.advance(count)
        for index, packet in enumerate(packets):
            _fill(buff, index * size, packet)
        return sum(map(len, packets))


def _raise(error: UsbError) -> Never:
    """Raise what pyusb raises where libusb meets this error: some of the kernel's become others on the way."""
    number = _MADE_OTHERS_BY_LIBUSB.get(error.errno, error.errno)
    kind = usb.core.USBTimeoutError if number == errno.ETIMEDOUT else usb.core.USBError
    raise kind(os.strerror(number), _LIBUSB_CODES.get(number, -1), number) from error


def _descriptors(device: Device) -> list[SimpleNamespace]:
    """Return the configuration descriptor and all that follow it, read from their bytes."""
    data = device.shape.configuration_descriptor()
    found = []
    while data:
        layout, names = _FIELDS[data[1]]
        values: dict[str, Any] = dict(zip(names.split(), struct.unpack_from(layout, data), strict=True))
        found.append(SimpleNamespace(**values, bRefresh=0, bSynchAddress=0, extra_descriptors=[]))
        data = data[data[0] :]
    return found


def _fill(buffer: "array[int]", at: int, data: bytes) -> None:
    memoryview(buffer).cast("B")[at : at + len(data)] = data
