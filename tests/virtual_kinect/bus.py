"""A USB bus with virtual Kinects on it. Standard library alone: Debian's own Python imports this, too."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

from virtual_kinect import shapes
from virtual_kinect.camera import Camera, Constants
from virtual_kinect.model import Clock, Device, Motor
from virtual_kinect.stream import Film

_GREATEST_ADDRESS = 127


class Model(StrEnum):
    """What is printed under the Kinect."""

    XBOX_1414 = "1414"
    XBOX_1473 = "1473"
    K4W = "k4w"


class Part(StrEnum):
    """A device inside a Kinect, behind its hub."""

    MOTOR = "motor"
    AUDIO = "audio"
    CAMERA = "camera"


_PORTS = {Part.MOTOR: 1, Part.AUDIO: 2, Part.CAMERA: 4}


@dataclass(frozen=True, slots=True)
class KinectPlan:
    """A Kinect to be made. ``serial`` is the camera's for a 1414, the audio device's for the others.

    Without its external power supply only the motor enumerates: ``parts=(Part.MOTOR,)``.
    """

    model: Model = Model.XBOX_1414
    serial: str = "A00362A08602047A"
    ports: tuple[int, ...] = (1,)
    parts: tuple[Part, ...] = tuple(Part)
    constants: Constants = field(default_factory=Constants)


class Kinect:
    """The devices of one Kinect. What a plan leaves out is None."""

    def __init__(self, plan: KinectPlan, film: Film, clock: Clock) -> None:
        self.plan = plan
        self._film = film
        self._clock = clock
        self.motor: Motor | None = None
        self.audio: Device | None = None
        self.camera: Camera | None = None
        self.devices: list[Device] = [Device(shapes.HUB, plan.ports)]
        for part in plan.parts:
            self._add(part, (*plan.ports, _PORTS[part]))

    def _add(self, part: Part, ports: tuple[int, ...]) -> None:
        old = self.plan.model is Model.XBOX_1414
        k4w = self.plan.model is Model.K4W
        serial = self.plan.serial
        if part is Part.CAMERA:
            shape = shapes.camera_1414(serial) if old else shapes.camera_k4w() if k4w else shapes.camera_1473()
            self.camera = Camera(shape, ports, self._film, self._clock, self.plan.constants)
            self.devices.append(self.camera)
        elif part is Part.AUDIO:
            self.audio = Device(shapes.audio_k4w(serial) if k4w else shapes.audio(serial), ports)
            self.devices.append(self.audio)
        elif old:
            self.motor = Motor(shapes.MOTOR, ports)
            self.devices.append(self.motor)

    def device(self, part: Part) -> Device:
        """Return one of its devices; LookupError where this Kinect has none such."""
        found = {Part.MOTOR: self.motor, Part.AUDIO: self.audio, Part.CAMERA: self.camera}[part]
        if found is None:
            raise LookupError(
                f"This Kinect has no {part}: its plan has the model {self.plan.model} and {self.plan.parts}"
            )
        return found


class Bus:
    """Bus 1: a root hub and whatever is plugged in. Addresses count up with every plugging, as the kernel's do."""

    def __init__(self, kinects: Iterable[Kinect] = ()) -> None:
        self.root = Device(shapes.ROOT_HUB, ())
        self.root.plugged, self.root.address = True, 1
        self.kinects: list[Kinect] = []
        self._last_address = 1
        for kinect in kinects:
            self.plug(kinect)

    @property
    def devices(self) -> list[Device]:
        """All devices that are plugged in, parents first."""
        return [self.root, *(device for kinect in self.kinects for device in kinect.devices)]

    def plug(self, kinect: Kinect) -> None:
        """Plug a Kinect in, or in again; its devices get new addresses."""
        for device in kinect.devices:
            device.address = self._free_address()
            device.plugged = True
            device.on_fault_unplug = lambda: self.unplug(kinect)
            device.attach_kernel_driver()
        self.kinects.append(kinect)

    def _free_address(self) -> int:
        taken = {device.address for device in self.devices}
        while True:
            self._last_address = self._last_address % _GREATEST_ADDRESS + 1
            if self._last_address not in taken:
                return self._last_address

    def unplug(self, kinect: Kinect) -> None:
        """Pull a Kinect's plug: everything on its devices fails with ENODEV from now on."""
        for device in kinect.devices:
            device.plugged = False
            device.close_down()
        self.kinects.remove(kinect)

    def parent(self, device: Device) -> Device | None:
        """Return the hub that a device hangs on, None for the root hub."""
        above = (other for other in self.devices if device.ports and other.ports == device.ports[:-1])
        return next(above, None)
