"""The Debian packages that the virtual Kinect under umockdev needs."""

import os
import shutil
import subprocess

import pytest

from virtual_kinect.umock import DEBIAN_PACKAGES, DEBIAN_PYTHON

_PROGRAMS = ("lsusb", "fakenect-record", "setpriv")


def need_packages() -> None:
    """Fail in CI, and skip elsewhere, if a package is missing; the message says how to get them all."""
    missing = [program for program in _PROGRAMS if shutil.which(program) is None]
    if not _has_umockdev():
        missing.append("UMockdev for Debian's Python")
    if not missing:
        return
    message = f"The virtual Kinect lacks {', '.join(missing)}: apt-get install {DEBIAN_PACKAGES}"
    if os.environ.get("CI") == "true":
        pytest.fail(message)
    pytest.skip(message)


def _has_umockdev() -> bool:
    if shutil.which(DEBIAN_PYTHON) is None:
        return False
    look = "import gi; gi.require_version('UMockdev', '1.0'); from gi.repository import UMockdev"
    return subprocess.run([DEBIAN_PYTHON, "-c", look], capture_output=True, check=False).returncode == 0
