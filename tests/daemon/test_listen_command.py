"""`touchd listen` in a process of its own, on the real daemon and on nobody."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clients.harness import PATIENCE_S, PythonTuio, free_udp_port
from clients.stamped import crowd, write_stamped
from daemon.running import TOUCHD, running, wait_until


@contextmanager
def listening(port: int, *options: str) -> Iterator[subprocess.Popen[str]]:
    """Run the command until the end of the block, once it listens."""
    process = subprocess.Popen(
        [*TOUCHD, "listen", str(port), "--json", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(f"listening on UDP port {port} ")
        yield process
    finally:
        process.kill()
        process.wait(PATIENCE_S)


def test_it_finds_nothing_wrong_with_sixty_cursors_a_kill_a_restart_and_a_stop(tmp_path: Path) -> None:
    config = write_stamped(tmp_path, crowd(most=60, frames=60, seed=1))
    port = free_udp_port()
    with PythonTuio() as witness, listening(port, "--host", "127.0.0.1") as process:
        text = config.read_text()
        config.write_text(f'{text}outputs: [{{tuio: {{to: ["127.0.0.1:{port}", "{witness.destination}"]}}}}]\n')
        for number in (signal.SIGKILL, signal.SIGTERM):
            before = len(witness.log.adds)
            with running(config, tmp_path / "state") as daemon:
                wait_until(lambda seen=before: len(witness.log.adds) > seen + 100)  # type: ignore[misc]
                daemon.end(number)
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=PATIENCE_S)
    summary = json.loads(out)
    assert (summary["broken"], process.returncode) == ([], 0)
    assert sum(sender["adds"] for sender in summary["senders"]) > 200


def test_where_nothing_arrives_the_exit_code_says_so() -> None:
    with listening(free_udp_port(), "--for", "0.1") as process:
        out, _ = process.communicate(timeout=PATIENCE_S)
    assert (json.loads(out)["exit_code"], process.returncode) == (69, 69)


def test_a_port_that_is_taken_is_one_sentence_and_exit_code_75() -> None:
    with PythonTuio() as client:
        port = client.destination.rpartition(":")[2]
        ended = subprocess.run(
            [sys.executable, "-m", "touchd", "listen", port], capture_output=True, text=True, check=False
        )
    assert (ended.returncode, ended.stderr) == (
        75,
        f"touchd: Another program listens on port {port}; UDP clients cannot share a port; "
        "stop it or choose another port.\n",
    )
