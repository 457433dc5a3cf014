"""What was reported of USB controllers, most of it by users of libfreenect; docs/hardware.md has more on each."""

from dataclasses import dataclass

from touchd.doctor.usb_devices import Controller

_MAKERS = {
    0x1002: "AMD",
    0x1022: "AMD",
    0x1033: "NEC",
    0x104C: "Texas Instruments",
    0x1106: "VIA",
    0x10DE: "NVIDIA",
    0x1912: "Renesas",
    0x1B21: "ASMedia",
    0x1B36: "QEMU",
    0x1B6F: "Etron",
    0x1B73: "Fresco Logic",
    0x8086: "Intel",
}
_DRIVERS = {
    "xhci_hcd": "USB 3",
    "xhci-hcd": "USB 3",
    "ehci-pci": "USB 2",
    "ehci_hcd": "USB 2",
    "ehci-platform": "USB 2",
    "dwc_otg": "Raspberry Pi up to 3 and Zero",
    "dwc2": "DesignWare USB 2",
    "vhci_hcd": "USB over the network",
}


@dataclass(frozen=True, slots=True)
class Trouble:
    """What was reported of a controller, what to do if touchd's frames come incomplete, and where it was reported."""

    what: str
    remedy: str
    source: str


_DWC_OTG = Trouble(
    "this controller of the Raspberry Pi up to 3 loses isochronous packets under load, and Kinects at it gave few or no"
    " frames",
    "keep other USB devices and the network off it, give the Pi a strong power supply, or use a Raspberry Pi 4 or a PC",
    "https://github.com/raspberrypi/linux/issues/238, https://github.com/xxorde/librekinect/issues/8",
)
_VL805 = Trouble(
    "at this VL805, which the Raspberry Pi 4 has, a Kinect v1 was reported to lose many packets until another device"
    " was plugged in beside it",
    "if touchd status shows dropped frames, plug a second USB device in beside the Kinect, or use a PC",
    "https://github.com/OpenKinect/libfreenect/issues/639",
)
_ASMEDIA = Trouble(
    "controllers by ASMedia were reported to break isochronous streams of the Kinect v2; of the Kinect v1 nothing is"
    " known",
    "if touchd status shows dropped frames, use another port, of the chipset itself",
    "https://github.com/OpenKinect/libfreenect2/issues/146",
)
_NETWORK = Trouble(
    "USB over the network or into a virtual machine loses a Kinect's depth packets",
    "run touchd on the computer that the Kinect is plugged into",
    "https://github.com/OpenKinect/libfreenect/issues/592",
)
_BY_DRIVER = {"dwc_otg": _DWC_OTG, "vhci_hcd": _NETWORK}
_BY_IDS = {(0x1106, 0x3483): _VL805}
_BY_MAKER = {0x1B21: _ASMEDIA}


def trouble_with(controller: Controller) -> Trouble | None:
    """Return what was reported of a controller; None if nothing was."""
    ids = (controller.vendor_id or 0, controller.device_id or 0)
    return _BY_DRIVER.get(controller.driver or "") or _BY_IDS.get(ids) or _BY_MAKER.get(ids[0])


def controller_name(controller: Controller) -> str:
    """Return a controller in words."""
    driver = controller.driver or "an unknown driver"
    kind = f" ({_DRIVERS[driver]})" if driver in _DRIVERS else ""
    if controller.vendor_id is None:
        return f"{driver}{kind}"
    maker = _MAKERS.get(controller.vendor_id, "maker")
    return f"{maker} {controller.vendor_id:04x}:{controller.device_id or 0:04x}, {driver}{kind}"
