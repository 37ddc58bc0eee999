"""Rendered units on disk, filed under a digest of everything that made them."""

from __future__ import annotations

import hashlib
import re
import zlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from hvcpd.config.files import write_whole
from hvcpd.ports import Samples
from hvcpd.synthesis.shipped import ShippedUnits

_COMMENT = re.compile(r'(?:^|  )[ \t]*#[^\n"\']*$')


def without_prose(source: str) -> str:
    """Return a module's source without its comments, blank lines and docstrings, of which `...` stays behind.

    By its lines, as the syntax tree would take a tenth of a second and differ from one Python to the next. What they
    spare, such as a comment with a quotation mark, counts as source.
    """
    kept, in_docstring = [], False
    for line in source.split("\n"):
        text = line.strip()
        if in_docstring:
            in_docstring = not text.endswith('"""')
        elif text.startswith(('"""', 'r"""')):
            in_docstring = text.count('"""') == 1
            kept.append(line[: line.index(text)] + "...")
        elif text := _COMMENT.sub("", line) if "#" in line else text and line:
            kept.append(text)
    return "\n".join(kept)


@lru_cache(maxsize=1)
def recipe() -> str:
    """A digest of the synthesizer's own source: units that an older one rendered are not found any more.

    Comments and docstrings do not count.
    """
    sources = sorted(Path(__file__).parent.glob("*.py"))
    text = "".join(without_prose(source.read_text(encoding="utf-8")) for source in sources)
    return hashlib.sha256(text.encode()).hexdigest()


def key_of(content: object) -> str:
    """Return the name of the unit of that content, which must have a stable repr."""
    return hashlib.sha256(f"{recipe()} {content!r}".encode()).hexdigest()[:32]


DAY_S = 86_400.0
KEPT_S = 30 * DAY_S
"""A unit that no start has needed for a month is deleted: of other names and tasks, or of an older synthesizer."""


SUFFIX = ".unit"
"""A file has the CRC-32 of all that follows, then the samples, float32, both little-endian. A start reads two thousand;
an `.npy` file, whose header is Python source, takes six times as long, and does not tell of damaged samples."""
CRC_BYTES = 4
DELETED = (SUFFIX, ".part", ".npy")
"""What `tidy` may delete; `.npy`: of older versions."""
LITTLE_ENDIAN = np.dtype("<f4")


class UnitCache:
    """A folder of small files, filled from what the package ships or else by rendering.

    A file that cannot be read or written costs time, never an utterance.
    """

    def __init__(self, folder: Path, shipped: ShippedUnits | None = None) -> None:
        self.folder = folder
        self._shipped = shipped or ShippedUnits()
        self._needed: set[Path] | None = set()
        """Until `tidy`."""
        self.fault: OSError | None = None
        """Why a unit could not be kept, the last such; None if all were."""

    def tidy(self, now_s: float) -> None:
        """Delete what nobody has needed for long; `now_s`: of the clock that files are dated by.

        To be called once, when all that is usually needed was asked for: that is dated anew, once a day at most, and
        kept whatever its date, for a robot may have been switched off for months, or have no clock.
        """
        needed, self._needed = self._needed or set(), None
        self._shipped.forget()
        try:
            for path in self.folder.iterdir():
                age_s = now_s - path.stat().st_mtime
                if path in needed and age_s > DAY_S:
                    path.touch()
                elif path not in needed and age_s > KEPT_S and path.suffix in DELETED:
                    path.unlink()
        except OSError:
            pass  # read-only, or another robot of this computer has just deleted it: the next start tries again

    def get(self, content: object, make: Callable[[], Samples]) -> Samples:
        """Return the unit of that content, shape (n,), float32, from the disk or made now; `content` must have a
        stable repr."""
        key = key_of(content)
        path = self.folder / (key + SUFFIX)
        if self._needed is not None:
            self._needed.add(path)
        found = _load(path)
        if found is not None:
            return found
        unit = self._shipped.get(key)
        if unit is None:
            unit = make()
        data = unit.astype(LITTLE_ENDIAN).tobytes()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(path, _crc(data) + data)
        except OSError as error:  # a full or read-only disk must not silence the robot
            self.fault = error
        return unit


def _load(path: Path) -> Samples | None:
    """What the file holds, read-only; None without a file, or where it is not as it was written."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    samples = memoryview(data)[CRC_BYTES:]
    if data[:CRC_BYTES] != _crc(samples) or len(samples) % LITTLE_ENDIAN.itemsize:
        return None
    return np.frombuffer(samples, LITTLE_ENDIAN).astype(np.float32, copy=False)


def _crc(data: bytes | memoryview) -> bytes:
    return zlib.crc32(data).to_bytes(CRC_BYTES, "little")
