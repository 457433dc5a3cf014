"""A Debian of its own, booted in a container by systemd-nspawn, in which touchd can be installed and run for real."""

import contextlib
import ctypes
import os
import platform
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, TypeVar

T = TypeVar("T")
REPOSITORY = Path(__file__).parents[2]
CACHE = REPOSITORY / ".cache" / "vm"
RELEASE = "bookworm"
PYTHON = "3.11"  # the one of RELEASE
PACKAGES = ("systemd", "systemd-sysv", "dbus", "udev", "python3", "python3-venv", "make", "procps")
_TOOLS = ("systemd-nspawn", "debootstrap", "nsenter", "unshare")
_BOOT_S = 60.0
_LOOK_S = 0.2
_CLONE_NEWNET = 0x40000000
_EMPTY_ENV = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin", "LC_ALL": "C.UTF-8"}


def why_not() -> str | None:
    """Return what this computer lacks for a machine, None if it has all."""
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if missing:
        return f"{', '.join(missing)} missing: apt-get install systemd-container debootstrap util-linux"
    return None if os.geteuid() == 0 else "a machine can only be booted by root: sudo make test-vm"


def debian() -> Path:
    """Return the root folder of a small Debian, made on the first call and kept in the cache."""
    root = CACHE / f"{RELEASE}-{platform.machine()}"
    stamp = root / "etc" / "touchd-test-packages"
    if not (stamp.exists() and stamp.read_text() == " ".join(PACKAGES)):
        shutil.rmtree(root, ignore_errors=True)
        root.parent.mkdir(parents=True, exist_ok=True)
        include = "--include=" + ",".join(PACKAGES)
        subprocess.run(["debootstrap", "--variant=minbase", include, RELEASE, root, *_mirror()], check=True)
        shutil.rmtree(root / "var/cache/apt", ignore_errors=True)
        shutil.rmtree(root / "var/lib/apt/lists", ignore_errors=True)
        stamp.write_text(" ".join(PACKAGES))
    return root


def _mirror() -> list[str]:
    """Return the mirror that this computer itself installs the release from, or nothing for debootstrap's default."""
    asked = ["apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages", f"Codename: {RELEASE}"]
    return subprocess.run(asked, check=False, capture_output=True, text=True).stdout.split()[:1]


def wheels() -> Path:
    """Return a folder with every wheel that an install in the Debian needs, fetched by this computer's pip.

    So this computer's own settings of pip hold, and the machine needs no network.
    """
    folder = CACHE / f"wheels-{platform.machine()}"
    stamp = folder / "pyproject.toml"
    wanted = (REPOSITORY / "pyproject.toml").read_text()
    if not (stamp.exists() and stamp.read_text() == wanted):
        shutil.rmtree(folder, ignore_errors=True)
        kinds = [
            "manylinux_2_17",
            "manylinux2014",
            "manylinux_2_24",
            "manylinux_2_27",
            "manylinux_2_28",
            "manylinux_2_31",
        ]
        platforms = [f"--platform={kind}_{platform.machine()}" for kind in kinds]
        pip = [sys.executable, "-m", "pip", "download", "--quiet", f"--dest={folder}", "--only-binary=:all:"]
        options = [f"--python-version={PYTHON}", "--implementation=cp", *platforms]
        subprocess.run([*pip, *options, *_requirements()], check=True)
        stamp.write_text(wanted)
    return folder


def _requirements() -> list[str]:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    return [*project["project"]["dependencies"], *project["build-system"]["requires"]]


class Machine:
    """The running container. It has a loopback of its own and no other network."""

    def __init__(self, leader: int) -> None:
        self._leader = leader

    def run(self, *command: str | Path, check: bool = True, user_input: str | None = None) -> str:
        """Run a command as root and return what it printed; what it printed is in the error if it fails."""
        enter = ["nsenter", f"--target={self._leader}", "--all", "--", *command]
        done = subprocess.run(
            enter, check=False, input=user_input, capture_output=True, text=True, env=_EMPTY_ENV, timeout=300
        )
        assert done.returncode == 0 or not check, f"{command}: exit {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr

    def shell(self, script: str, check: bool = True) -> str:
        """Run a shell script as root and return what it printed."""
        return self.run("bash", "-euc", script, check=check)

    def write(self, path: str, text: str) -> None:
        """Write a file."""
        self.run("bash", "-euc", 'mkdir -p "$(dirname "$1")"; cat >"$1"', "bash", path, user_input=text)

    def in_its_network(self, job: Callable[[], T]) -> T:
        """Call ``job`` so that the sockets which it makes are in the machine's network."""
        libc = ctypes.CDLL(None, use_errno=True)
        with Path(f"/proc/{self._leader}/ns/net").open() as there, Path("/proc/thread-self/ns/net").open() as here:
            assert libc.setns(there.fileno(), _CLONE_NEWNET) == 0, os.strerror(ctypes.get_errno())
            try:
                return job()
            finally:
                assert libc.setns(here.fileno(), _CLONE_NEWNET) == 0


@contextlib.contextmanager
def booted(log: IO[bytes], binds: dict[Path, str]) -> Iterator[Machine]:
    """Boot a machine from a copy of the Debian; ``binds`` says which folders of this computer are where, read-only."""
    # The machine's own root is below the repository: with what is mounted in a folder it would be in itself.
    what = [f"--bind-ro={here}:{there}:norbind" for here, there in binds.items()]
    # Not registered and in no unit of its own: it must also boot where no systemd runs.
    how = ["--boot", "--private-network", "--register=no", "--keep-unit", "--console=pipe", "--machine=touchd-test"]
    how += ["--capability=CAP_BPF", "--system-call-filter=bpf"]  # by which systemd enforces DevicePolicy
    nspawn = subprocess.Popen(
        ["systemd-nspawn", "--quiet", f"--directory={debian()}", "--ephemeral", *how, *what],
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=subprocess.STDOUT,
        env={**os.environ, "SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"},
    )
    try:
        yield _wait_until_up(nspawn)
    finally:
        nspawn.terminate()
        nspawn.wait()


def _wait_until_up(nspawn: "subprocess.Popen[bytes]") -> Machine:
    deadline_s = time.monotonic() + _BOOT_S
    children = Path(f"/proc/{nspawn.pid}/task/{nspawn.pid}/children")
    state = "it did not start"
    while time.monotonic() < deadline_s and nspawn.poll() is None:
        leaders = children.read_text().split()
        if leaders:
            machine = Machine(int(leaders[-1]))
            state = machine.run("systemctl", "is-system-running", check=False).strip()
            if state in ("running", "degraded"):
                return machine
        time.sleep(_LOOK_S)
    raise TimeoutError(f"the machine did not boot: {state}; nspawn's exit code: {nspawn.poll()}")
