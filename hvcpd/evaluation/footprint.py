"""A listener's cost: processor time and memory, measured in a process of its own.

`python -m hvcpd.evaluation.footprint LISTENER FILE` listens to a sound (numpy's format) and writes a line of JSON.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hvcpd.evaluation.listeners import CALLER, MAKERS, WAKE_WORDS, Listen, Said, book
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

TIMEOUT_S = 300.0
"""Of real time, for a minute of sound: the slowest listener takes a few seconds."""


@dataclass(frozen=True)
class Footprint:
    """`start_s`: processor time until it can listen; `share`: of one core, while it listens; `memory_mb`: the most
    that its process had resident, Python and numpy among it; `bare_mb`: before the listener was made."""

    start_s: float
    share: float
    memory_mb: float
    bare_mb: float


def measured(listener: str, sound: Samples, said: Sequence[Said]) -> Footprint:
    """Start a process that listens to the sound, shape (n,), float32, which contains these sentences; return its cost.

    Raises subprocess.CalledProcessError and TimeoutExpired.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heard.npz"
        np.savez(path, sound=sound, spans=[(s.start, s.end) for s in said])
        command = [sys.executable, "-m", "hvcpd.evaluation.footprint", listener, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=TIMEOUT_S)
    return Footprint(**json.loads(done.stdout.splitlines()[-1]))


def resident_mb(field: str) -> float:
    """Memory of this process: VmRSS, or VmHWM for its peak (proc(5)), MB."""
    status = Path("/proc/self/status").read_text()
    found = re.search(rf"^{field}:\s+(\d+) kB$", status, re.MULTILINE)
    return int(found[1]) * 1024 / 1e6 if found is not None else float("nan")


def measure(make: Callable[[], Listen], sound: Samples, said: Sequence[Said]) -> Footprint:
    """Return the cost, here and now, of making a listener and of having it listen to the sound, shape (n,), float32."""
    bare_mb, began_s = resident_mb("VmRSS"), time.process_time()
    listen = make()
    ready_s = time.process_time()
    listen(sound, said)
    share = (time.process_time() - ready_s) / (len(sound) / SAMPLE_RATE_HZ)
    return Footprint(round(ready_s - began_s, 3), round(share, 4), round(resident_mb("VmHWM"), 1), round(bare_mb, 1))


def main() -> None:
    """See the module."""
    listener, path = sys.argv[1:]
    with np.load(path) as heard:
        said = [Said((), int(start), int(end)) for start, end in heard["spans"]]
        found = measure(lambda: MAKERS[listener](book(*WAKE_WORDS, CALLER)), heard["sound"], said)
    sys.stdout.write(json.dumps(asdict(found)) + "\n")


if __name__ == "__main__":
    main()
