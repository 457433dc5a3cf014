"""Findings about where touches go: who listens there, and who else sends there."""

import socket
import sys
from collections.abc import Iterator
from ipaddress import IPv4Address, IPv6Address, ip_address

from touchd.doctor.computer import Computer
from touchd.doctor.finding import Finding, Level
from touchd.doctor.survey import Survey
from touchd.outputs.udp import parse_destination

_CLAIM = "@touchd sends to "  # as /proc/net/unix writes what touchd.claims binds
_FAMILY = {4: int(socket.AF_INET), 6: int(socket.AF_INET6)}


def outputs(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say of each TUIO destination whether somebody listens there, and whether another touchd sends there."""
    destinations = [to for output in found.config.outputs if output.tuio is not None for to in output.tuio.to]
    if not destinations and found.config_problem is None:
        yield Finding("ports", Level.NOTE, "the config has no TUIO output", "add outputs: [{tuio: {}}]")
    listening = _listening_ports(computer)
    claims = _claims(computer)
    for destination in destinations:
        yield _listener(destination, listening)
        yield from _rival(found, destination, claims)


def _listener(destination: str, listening: set[tuple[int, int]] | None) -> Finding:
    where = parse_destination(destination)
    family = _loopback_family(where.host)
    if family is None:
        text = f"{destination} is not on this computer's loopback: whether somebody listens there cannot be seen"
        return Finding("ports", Level.OK, text)
    if listening is None:
        return Finding("ports", Level.NOTE, f"{destination}: /proc/net/udp cannot be read")
    if (family, where.port) in listening:
        return Finding("ports", Level.OK, f"a program listens at {destination}")
    remedy = f"start the TUIO program, or see the touches with touchd listen; it must listen on port {where.port}"
    return Finding("ports", Level.NOTE, f"nobody listens at {destination}", remedy)


def _rival(found: Survey, destination: str, claims: dict[str, str]) -> Iterator[Finding]:
    inode = claims.get(destination)
    if inode is None:
        return
    holders = found.open_files.holders(f"socket:[{inode}]")
    if found.status is not None and (not holders or any(process.pid == found.status.pid for process in holders)):
        return  # the daemon's own claim, as far as can be seen
    who = ", ".join(map(str, holders)) or "a touchd of another user"
    text = f"{who} sends to {destination} already, and most clients cannot tell two senders apart"
    level = Level.NOTE if found.status is None else Level.PROBLEM
    yield Finding("ports", level, text, "give each touchd a port of its own")


def _loopback_family(host: str) -> int | None:
    """Return the address family of a host on the loopback; None for another one, or a name that must be looked up."""
    if host == "localhost":
        return _FAMILY[4]  # as touchd.outputs.names resolves it
    try:
        address = ip_address(host)
    except ValueError:
        return None
    return _FAMILY[address.version] if address.is_loopback else None


def _listening_ports(computer: Computer) -> set[tuple[int, int]] | None:
    """Return the address families and ports of all UDP sockets that the loopback reaches; see proc(5)."""
    tables = [computer.read("/proc/net/udp"), computer.read("/proc/net/udp6")]
    if tables[0] is None:
        return None
    found = set()
    for line in (line for table in tables if table for line in table.splitlines()[1:]):
        address, port = _local_address(line)
        if address.is_loopback or address.is_unspecified:
            found.add((_FAMILY[address.version], port))
        if address == IPv6Address("::"):
            found.add((_FAMILY[4], port))  # it takes IPv4, too, unless it is told not to
    return found


def _local_address(line: str) -> tuple[IPv4Address | IPv6Address, int]:
    """Return the local address and port in a line of /proc/net/udp: hexadecimal words in the machine's byte order."""
    words, _, port = line.split()[1].partition(":")
    packed = b"".join(int(words[at : at + 8], 16).to_bytes(4, sys.byteorder) for at in range(0, len(words), 8))
    return ip_address(packed), int(port, 16)


def _claims(computer: Computer) -> dict[str, str]:
    """Return the destinations that touchds have claimed, and the inodes of their sockets."""
    found = {}
    for line in (computer.read("/proc/net/unix") or "").splitlines():
        columns, mark, destination = line.partition(_CLAIM)
        if mark:
            found[destination] = columns.split()[-1]
    return found
