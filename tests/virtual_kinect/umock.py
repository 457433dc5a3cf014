"""Virtual Kinects under umockdev, from the test's side: starts the server and says how to start a client.

A client is any program that uses libusb, started with ``VirtualBus.environment``.
"""

import json
import os
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from virtual_kinect.bus import KinectPlan, Part
from virtual_kinect.faults import Faults
from virtual_kinect.pictures import write_pictures

DEBIAN_PACKAGES = "umockdev gir1.2-umockdev-1.0 python3-gi libusb-1.0-0 usbutils libfreenect-bin util-linux"
# Put before a command, it forbids root what is forbidden to others: Faults(open_errno=errno.EACCES) holds for it, too.
UNPRIVILEGED = ("setpriv", "--bounding-set", "-all", "--inh-caps", "-all")
DEBIAN_PYTHON = "/usr/bin/python3"
_PRELOAD = "libumockdev-preload.so.0"
_PATIENCE_S = 20


class VirtualBus:
    """A context in which virtual Kinects, numbered from 0, can be plugged in, pulled out and broken.

    Their pictures, all the same, play in a loop at 30 a second (or in ``order``; see ``Film``). ``plugged`` are the
    Kinects that are there from the beginning, all of them unless it is given. A client that is too late loses packets,
    as in reality; if ``patient``, the camera waits for it. ``folder`` is for the pictures' file and the server's log.
    """

    def __init__(
        self,
        folder: Path,
        pictures: Iterable[bytes],
        kinects: Sequence[KinectPlan] = (KinectPlan(),),
        order: Sequence[int] | None = None,
        plugged: Sequence[int] | None = None,
        *,
        patient: bool = False,
    ) -> None:
        write_pictures(folder / "pictures.raw", pictures)
        self._order = {
            "pictures": str(folder / "pictures.raw"),
            "order": order,
            "kinects": [asdict(plan) for plan in kinects],
            "patient": patient,
            "plugged": list(range(len(kinects)) if plugged is None else plugged),
        }
        self._folder = folder
        self.environment: dict[str, str] = {}

    def __enter__(self) -> Self:
        # The name of a socket in it may have 107 letters; a test's own folder has a long name.
        self._sockets = tempfile.TemporaryDirectory(prefix="usb-")
        environment = os.environ | {
            "LD_PRELOAD": _PRELOAD,
            "TMPDIR": self._sockets.name,
            "PYTHONPATH": str(Path(__file__).parents[1]),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        self._errors = (self._folder / "server.log").open("w+")
        self._server = subprocess.Popen(
            [DEBIAN_PYTHON, "-m", "virtual_kinect.umock_server"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env=environment,
            text=True,
        )
        mock = self._ask(self._order)["folder"]
        self.environment = os.environ | {"LD_PRELOAD": _PRELOAD, "UMOCKDEV_DIR": mock}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._server.communicate(timeout=_PATIENCE_S)
        finally:
            self._server.kill()
            self._server.wait(_PATIENCE_S)
            self._errors.close()
            self._sockets.cleanup()

    @property
    def server_pid(self) -> int:
        return self._server.pid

    def plug(self, kinect: int = 0) -> None:
        """Plug a Kinect in; its devices get addresses that they never had."""
        self._ask({"do": "plug", "kinect": kinect})

    def unplug(self, kinect: int = 0) -> None:
        self._ask({"do": "unplug", "kinect": kinect})

    def set_faults(self, faults: Faults, part: Part = Part.CAMERA, kinect: int = 0) -> None:
        self._ask({"do": "faults", "kinect": kinect, "part": part, "faults": faults.as_json()})

    def state(self, kinect: int = 0) -> dict[str, Any]:
        """Return what a Kinect has seen: see ``Mock`` in umock_server.py for the keys."""
        return self._ask({"do": "state", "kinect": kinect})

    def _ask(self, command: dict[str, Any]) -> dict[str, Any]:
        assert self._server.stdin
        assert self._server.stdout
        try:
            self._server.stdin.write(json.dumps(command) + "\n")
            self._server.stdin.flush()
            answer: dict[str, Any] = json.loads(self._server.stdout.readline())
        except (BrokenPipeError, json.JSONDecodeError) as error:
            self._server.wait(_PATIENCE_S)
            self._errors.seek(0)
            raise RuntimeError(
                f"The server of the virtual Kinect has ended. Are its packages installed "
                f"(apt-get install {DEBIAN_PACKAGES})? It said: {self._errors.read()}"
            ) from error
        return answer
