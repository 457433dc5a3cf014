"""One opened Kinect: its camera's commands and depth stream, and its LED and accelerometer where it has them."""

import errno
import logging
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import usb.core
import usb.util
from usb.core import USBError

from touchd.errors import DeviceLost, SourceError
from touchd.sources.kinect.commands import (
    ACCELEROMETER,
    COMMAND_REQUEST,
    CONST_SHIFT,
    DEPTH_ENDPOINT,
    DEPTH_PACKET_BYTES,
    FIXED_PARAMETERS,
    FROM_DEVICE,
    INTERFACE,
    KINECT_FOR_WINDOWS_ALTERNATE_SETTING,
    NEAR_MODE_OFF,
    NEAR_MODE_ON,
    REPLY_BYTES,
    START_DEPTH,
    STOP_DEPTH,
    TO_DEVICE,
    Command,
    Led,
    Model,
    MotorRequest,
    Step,
    acceleration_g,
    ir_brightness,
    led_request,
    reply_payload,
)
from touchd.sources.kinect.constants import DeviceConstants, device_constants
from touchd.sources.kinect.devices import KinectDevice
from touchd.sources.kinect.failures import told_for
from touchd.sources.kinect.stream import IsoStream, OpenStream, TakeTransfer

log = logging.getLogger(__name__)

_TIMEOUT_MS = 500  # of a control transfer
_POLLS = 100  # for a reply
_POLL_S = 0.01
_MOTOR_TIMEOUT_MS = 50  # nobody needs it, and frames wait meanwhile

Pause = Callable[[float], object]


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """What the user may set of a Kinect's projector; None leaves it as it is."""

    ir_brightness: int | None = None
    near_mode: bool | None = None  # Kinect for Windows alone has it


class KinectCamera:
    """An opened Kinect. Use it from one thread, and close it."""

    def __init__(self, kinect: KinectDevice, open_stream: OpenStream, pause: Pause = time.sleep) -> None:
        """Take the camera from the kernel's driver and for ourselves. Raises SourceError."""
        self.name = kinect.name
        self.identity = kinect.identity
        self._kinect = kinect
        self._open_stream = open_stream
        self._pause = pause
        self._device = kinect.camera
        self._motor = None if kinect.motor is None else _Motor(self.name, kinect.motor)
        self._tag = 0
        self._stream: IsoStream | None = None
        try:
            self._claim()
        except BaseException:
            self._dispose()
            raise

    def constants(self) -> DeviceConstants:
        """Ask the camera for its factory's constants. Raises SourceError."""
        return device_constants(self.ask(FIXED_PARAMETERS), self.ask(CONST_SHIFT))

    def start(self, settings: CameraSettings, take: TakeTransfer) -> IsoStream:
        """Start the stream whose transfers ``take`` gets while what is returned is pumped. Raises SourceError."""
        if settings.near_mode is not None and self._kinect.model is not Model.WINDOWS:
            raise SourceError(
                f"{self.name}: source.near_mode is for the Kinect for Windows alone, and this is a "
                f"{self._kinect.model}; remove it from the config"
            )
        self._stream = self._open_stream(self.name, self._device, DEPTH_ENDPOINT, DEPTH_PACKET_BYTES, take)
        self._run(START_DEPTH)
        if settings.near_mode is not None:
            self._run(NEAR_MODE_ON if settings.near_mode else NEAR_MODE_OFF)
        if settings.ir_brightness is not None:
            self._run(ir_brightness(settings.ir_brightness))
        return self._stream

    def ask(self, command: Command) -> bytes:
        """Send a command and return what its reply brings. Raises SourceError, DeviceLost where no reply comes."""
        tag, self._tag = self._tag, (self._tag + 1) & 0xFFFF
        with told_for(self.name, f"sending {command}"):
            self._device.ctrl_transfer(TO_DEVICE, COMMAND_REQUEST, 0, 0, command.as_bytes(tag), _TIMEOUT_MS)
            for _ in range(_POLLS):
                reply = self._device.ctrl_transfer(FROM_DEVICE, COMMAND_REQUEST, 0, 0, REPLY_BYTES, _TIMEOUT_MS)
                payload = reply_payload(command, tag, bytes(reply))
                if payload is not None:
                    return payload
                self._pause(_POLL_S)
        raise DeviceLost(
            f"{self.name}: it does not answer {command} ({_POLLS} tries): unplug the camera and plug it in again"
        )

    def show(self, led: Led) -> None:
        """Switch the LED, where there is one that may be used."""
        if self._motor is not None:
            self._motor.show(led)

    def acceleration_g(self) -> tuple[float, float, float] | None:
        """Return which way is up, in g along the Kinect's axes; None where there is no accelerometer."""
        return None if self._motor is None else self._motor.acceleration_g()

    def close(self) -> None:
        """Stop the stream, wait for its last transfer, and let go of the devices; also when the camera is gone."""
        if self._stream is not None:
            with suppress(SourceError):
                self._run(STOP_DEPTH)
            self._stream.stop()
            self._stream = None
        self._dispose()

    def _claim(self) -> None:
        with told_for(self.name, "opening it"):
            with suppress(NotImplementedError):  # not every system has kernel drivers to ask about
                if self._device.is_kernel_driver_active(INTERFACE):
                    self._device.detach_kernel_driver(INTERFACE)
            usb.util.claim_interface(self._device, INTERFACE)
            if self._kinect.model is Model.WINDOWS:
                self._device.set_interface_altsetting(INTERFACE, KINECT_FOR_WINDOWS_ALTERNATE_SETTING)

    def _run(self, steps: Iterable[Step]) -> None:
        for step in steps:
            self.ask(step.command)
            if step.wait_s:
                self._pause(step.wait_s)

    def _dispose(self) -> None:
        if self._motor is not None:
            self._motor.close()
        with suppress(USBError):
            usb.util.dispose_resources(self._device)


class _Motor:
    """The LED and accelerometer. Nobody needs them, so a failure is told once and they are left alone."""

    def __init__(self, name: str, device: usb.core.Device) -> None:
        self._name = name
        self._device = device
        self._works = True

    def show(self, led: Led) -> None:
        self._ask(led_request(led), None)

    def acceleration_g(self) -> tuple[float, float, float] | None:
        reply = self._ask(ACCELEROMETER, ACCELEROMETER.length)
        if reply is None:
            return None
        try:
            return acceleration_g(bytes(reply))
        except SourceError as error:
            self._give_up(str(error))
            return None

    def close(self) -> None:
        with suppress(USBError):
            usb.util.dispose_resources(self._device)

    def _ask(self, request: MotorRequest, data: int | None) -> Any:
        """Return what comes back of ``data`` bytes; None if that failed, now or before."""
        if not self._works:
            return None
        try:
            return self._device.ctrl_transfer(
                request.request_type, request.request, request.value, 0, data, _MOTOR_TIMEOUT_MS
            )
        except USBError as error:
            self._works = False
            if error.errno != errno.ENODEV:  # else it went with the camera, which is told already
                self._give_up(error.strerror)
            return None

    def _give_up(self, why: str) -> None:
        self._works = False
        log.info("%s: its LED and accelerometer cannot be used: %s", self._name, why)
