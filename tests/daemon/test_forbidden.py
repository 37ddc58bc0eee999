"""The daemon under what its units forbid: nothing that it needs is among it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.daemon.forbidden import STORED_GROUPS, SYSTEMD, allowed, groups, library

needs_libseccomp = pytest.mark.skipif(library() is None, reason="libseccomp is not installed: apt install libseccomp2")

FORBIDS = """
import os, sys
from pathlib import Path
from tests.daemon.forbidden import forbid
forbid(Path(sys.argv[1]))
import mmap, socket
from hvcpd.security.keyring import keep_out_of_dumps
keep_out_of_dumps()
def refused(action):
    try:
        action()
    except OSError as error:
        return error.errno
print(
    refused(lambda: os.setpriority(os.PRIO_PROCESS, 0, 5)),
    refused(lambda: mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)),
    refused(lambda: socket.socket(socket.AF_INET)),
    refused(lambda: socket.socketpair()),
)
"""


def test_the_unit_allows_what_its_lists_say() -> None:
    calls = allowed(SYSTEMD / "hvcpd.service", groups())
    assert {"read", "futex", "ioctl", "socket", "prlimit64"} <= calls
    assert not {"setpriority", "sched_setscheduler", "setrlimit", "chown", "reboot", "ptrace", "mount"} & calls


def test_the_stored_groups_have_what_the_unit_names() -> None:
    stored = STORED_GROUPS.read_text().splitlines()
    assert {"@default", "@system-service", "@privileged", "@resources"} <= set(stored)


@needs_libseccomp
def test_what_it_forbids_is_refused() -> None:
    command = [sys.executable, "-c", FORBIDS, SYSTEMD / "hvcpd.service"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.stdout.split() == ["1", "1", "97", "None"], result.stderr


READS = """
import sys
from pathlib import Path
from tests.daemon.forbidden import forbid
forbid(Path(sys.argv[1]))
from hvcpd.hardware.soundfile import read_wav
print(len(read_wav(Path(sys.argv[2]))) > 0)
"""


@needs_libseccomp
def test_recordings_are_read_under_it() -> None:
    """libsndfile needs executable memory if it is handed a Python file."""
    command = [sys.executable, "-c", READS, SYSTEMD / "hvcpd.service", SYSTEMD.parent / "docs/voice/01.wav"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.stdout == "True\n", result.stderr


@needs_libseccomp
@pytest.mark.slow
def test_a_daemon_lives_and_hears_strangers_under_it(tmp_path: Path, units: Path) -> None:
    """`hvcpd@.service` differs by its name alone: `test_unit.py`."""
    (tmp_path / "units").symlink_to(units)
    command = [sys.executable, "-m", "tests.daemon.under_the_unit", SYSTEMD / "hvcpd.service", tmp_path]
    result = subprocess.run(command, capture_output=True, text=True, timeout=240)
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert lines[-1:] == [{"event": "lived"}], result.stderr[-2000:]
    heard = [(line["text"], line["voice"]) for line in lines if line["event"] == "heard"]
    # The keyword is heard before the sentence that it ends, which may be told as well.
    texts = [text for text, _ in heard if text not in ("Stop", "Rob stop")]
    assert texts == ["Rob, what is left", "Rob, turn left"]
    assert any(text in ("Stop", "Rob stop") for text, _ in heard)
    assert [line for line in lines if line.get("level") in ("warning", "error")] == []
