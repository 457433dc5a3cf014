"""Takes frames from a KinectSource with the real libusb, and prints one line of JSON.

Run it as ``python -m virtual_kinect.source_client FRAMES`` with the environment of a ``VirtualBus``.
"""

import json
import sys
import zlib
from itertools import islice

from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.source import KinectSource


def main() -> None:
    source = KinectSource(None, None, CameraSettings())
    frames = islice(source.frames(), int(sys.argv[1]))
    seen = [(frame.index, frame.missing_packets, zlib.crc32(frame.raw.tobytes())) for frame in frames]
    sys.stdout.write(json.dumps(seen) + "\n")


if __name__ == "__main__":
    main()
