"""Takes a frame from a Kinect, lets it go and opens it again, with the real libusb. Prints one line of JSON.

Run it as ``python -m virtual_kinect.reopening_client TIMES`` with the environment of a ``VirtualBus``. It tells of open
file descriptors and of resident memory in bytes, after a tenth of the times and in the end.
"""

import json
import sys
from pathlib import Path

from touchd.memory import resident_bytes
from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.source import KinectSource


def main() -> None:
    times = int(sys.argv[1])
    held = []
    for time in range(times):
        source = KinectSource(None, None, CameraSettings())
        for _ in source.frames():
            source.close()
        if time in {times // 10, times - 1}:
            held.append((len(list(Path("/proc/self/fd").iterdir())), resident_bytes()))
    sys.stdout.write(json.dumps(held) + "\n")


if __name__ == "__main__":
    main()
