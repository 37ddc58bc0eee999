"""Sound as 16-bit PCM."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import Samples


def pcm_16(sound: Samples) -> bytes:
    """Return sound, shape (n,), 1.0 = full scale, as 16-bit little-endian samples, clipped."""
    return bytes(np.clip(np.rint(sound * 32767.0), -32768, 32767).astype("<i2").tobytes())
