"""The doctor on this computer's own /proc: a real touchd's claim, a real listener, the process that it belongs to."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from touchd.doctor.computer import Computer
from touchd.doctor.examine import examine

CLAIM = """
import sys
from touchd.claims import DestinationClaims
claims = DestinationClaims()
assert claims.hold([sys.argv[1]]) == []
print("claimed", flush=True)
sys.stdin.read()
"""


@contextmanager
def claiming(destination: str) -> Iterator[int]:
    """Have another process claim a destination as a touchd does; yield its pid."""
    with subprocess.Popen(
        [sys.executable, "-c", CLAIM, destination], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout
        assert other.stdout.readline() == "claimed\n"
        yield other.pid


@pytest.fixture
def computer(tmp_path: Path) -> Computer:
    folder = str(tmp_path)
    return Computer({"HOME": folder, "XDG_RUNTIME_DIR": folder, "XDG_CONFIG_HOME": folder, "XDG_STATE_HOME": folder})


def ports(computer: Computer, folder: Path, destination: str) -> list[tuple[str, str]]:
    path = folder / "touchd.yaml"
    path.write_text(f"outputs: [{{tuio: {{to: ['{destination}']}}}}]\n")
    return [(str(one.level), one.text) for one in examine(computer, path, None) if one.section == "ports"]


def test_a_program_that_listens_is_seen_while_it_does(tmp_path: Path, computer: Computer) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        destination = f"127.0.0.1:{listener.getsockname()[1]}"
        assert ports(computer, tmp_path, destination) == [("ok", f"a program listens at {destination}")]
    assert ports(computer, tmp_path, destination) == [("note", f"nobody listens at {destination}")]


def test_a_process_that_claims_a_destination_is_named_with_its_pid(tmp_path: Path, computer: Computer) -> None:
    destination = f"127.0.0.1:{10000 + os.getpid() % 50000}"
    with claiming(destination) as pid:
        told = ports(computer, tmp_path, destination)
    assert len(told) == 2
    assert told[1][0] == "note"
    assert f"(pid {pid}) sends to {destination} already" in told[1][1]
    assert len(ports(computer, tmp_path, destination)) == 1
