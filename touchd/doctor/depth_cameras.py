"""Which USB devices are depth cameras or parts of them."""

from collections.abc import Sequence
from dataclasses import dataclass

from touchd.doctor.usb_devices import UsbDevice
from touchd.sources.kinect.commands import NO_SERIAL, PART_OF_PRODUCT, VENDOR_ID, Part, camera_model

_REALSENSE_VENDOR_ID = 0x8086
_ORBBEC_VENDOR_ID = 0x2BC5
# Product ids from librealsense: config/99-realsense-libusb.rules and src/ds/d400/d400-private.h.
_REALSENSE = {
    0x0A66: "F200",
    0x0A80: "R200",
    0x0AA5: "SR300",
    0x0AD1: "D400",
    0x0AD2: "D410",
    0x0AD3: "D415",
    0x0AD4: "D430",
    0x0AD5: "D430",
    0x0AF6: "D420",
    0x0B01: "D430",
    0x0B07: "D435",
    0x0B3A: "D435i",
    0x0B4B: "D430i",
    0x0B5B: "D405",
    0x0B5C: "D455",
    0x0B64: "L515",
}
# From libfreenect2, Microsoft's and PrimeSense's udev rules.
_OTHERS = {
    (VENDOR_ID, 0x02C4): "Kinect v2 (Xbox One or for Windows)",
    (VENDOR_ID, 0x02D8): "Kinect v2 (Xbox One or for Windows)",
    (VENDOR_ID, 0x097C): "Azure Kinect",
    (0x1D27, 0x0600): "PrimeSense or Asus Xtion camera",
    (0x1D27, 0x0601): "PrimeSense or Asus Xtion camera",
    (0x1D27, 0x0609): "PrimeSense or Asus Xtion camera",
}


@dataclass(frozen=True, slots=True)
class PluggedKinect:
    """A Kinect's camera and the devices beside it. ``serial`` is the camera's own, else its audio device's."""

    camera: UsbDevice
    parts: tuple[UsbDevice, ...]  # camera, motor and audio
    model: str
    serial: str | None


@dataclass(frozen=True, slots=True)
class Plugged:
    """All that has to do with depth cameras on the bus."""

    kinects: tuple[PluggedKinect, ...]
    without_camera: tuple[tuple[UsbDevice, Part], ...]  # of each such Kinect the part that tells most
    others: tuple[tuple[UsbDevice, str], ...]  # cameras that this touchd cannot read, with their names


def sort_out(devices: Sequence[UsbDevice]) -> Plugged:
    """Return which of the devices are depth cameras."""
    parts = [(device, part) for device in devices if (part := _part(device)) is not None]
    cameras = [device for device, part in parts if part is Part.CAMERA]
    return Plugged(
        tuple(_kinect(camera, parts) for camera in cameras),
        tuple(_without_camera(parts, {camera.parent for camera in cameras})),
        tuple((device, name) for device in devices if (name := _other(device)) is not None),
    )


def _part(device: UsbDevice) -> Part | None:
    return PART_OF_PRODUCT.get(device.product_id) if device.vendor_id == VENDOR_ID else None


def _kinect(camera: UsbDevice, parts: Sequence[tuple[UsbDevice, Part]]) -> PluggedKinect:
    beside = {part: device for device, part in parts if device.parent == camera.parent and part is not Part.HUB}
    beside[Part.CAMERA] = camera
    serials = [beside[part].serial for part in (Part.CAMERA, Part.AUDIO) if part in beside]
    return PluggedKinect(
        camera,
        tuple(beside.values()),
        str(camera_model(camera.product_id, camera.release)),
        next((serial for serial in serials if serial and serial != NO_SERIAL), None),
    )


def _without_camera(parts: Sequence[tuple[UsbDevice, Part]], with_camera: set[str]) -> list[tuple[UsbDevice, Part]]:
    """Return of each Kinect whose camera is missing the motor, else the audio device, else the hub."""
    found: dict[str, tuple[UsbDevice, Part]] = {}
    for part in (Part.HUB, Part.AUDIO, Part.MOTOR):
        for device in (device for device, one in parts if one is part):
            hub = device.name if part is Part.HUB else device.parent
            if hub not in with_camera:
                found[hub] = (device, part)
    return list(found.values())


def _other(device: UsbDevice) -> str | None:
    if device.vendor_id == _REALSENSE_VENDOR_ID and device.product_id in _REALSENSE:
        return f"RealSense {_REALSENSE[device.product_id]}"
    if device.vendor_id == _ORBBEC_VENDOR_ID:
        return "Orbbec camera"
    return _OTHERS.get((device.vendor_id, device.product_id))
