"""What a process could reach others by, read from /proc (proc(5))."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

UNIX = "unix"
_INODE = {"unix": 6, "netlink": 9, "packet": 8}
"""The column with a socket's number in /proc/PID/net/NAME; in the Internet protocols' tables the tenth."""
_INTERNET = ("tcp", "tcp6", "udp", "udp6", "udplite", "udplite6", "raw", "raw6", "icmp", "icmp6")
_INTERNET_INODE = 9


def socket_kinds(pid: int) -> set[str]:
    """The kinds of the sockets that the process keeps open; "unknown" for one in no table."""
    before = _open_sockets(pid)
    tables = {name: _inodes(str(pid), name) for name in (*_INODE, *_INTERNET)}
    tables[UNIX] |= _inodes(
        "self", UNIX
    )  # an accepted connection is in the table of who connected (unix_stream_connect)
    kept = before & _open_sockets(pid)  # others came or went while the tables were read
    return {next((name for name, inodes in tables.items() if number in inodes), "unknown") for number in kept}


def _open_sockets(pid: int) -> set[str]:
    numbers = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed since the folder was read
            target = str(link.readlink())
            if target.startswith("socket:["):
                numbers.add(target.removeprefix("socket:[").removesuffix("]"))
    return numbers


def interfaces(pid: int) -> dict[str, int]:
    """The network interfaces that the process could use: name to bytes that have passed."""
    lines = Path(f"/proc/{pid}/net/dev").read_text().splitlines()[2:]
    parts = {name.strip(): counts.split() for name, counts in (line.split(":", 1) for line in lines)}
    return {name: int(counts[0]) + int(counts[8]) for name, counts in parts.items()}


def routes(pid: int) -> str:
    """The addresses that the process could send to by the Internet Protocol, its own among them; empty if none."""
    return Path(f"/proc/{pid}/net/fib_trie").read_text()


def _inodes(pid: str, table: str) -> set[str]:
    path = Path(f"/proc/{pid}/net/{table}")
    rows = [line.split() for line in path.read_text().splitlines()[1:]] if path.exists() else []
    column = _INODE.get(table, _INTERNET_INODE)
    return {row[column] for row in rows if len(row) > column}
