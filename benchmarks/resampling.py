"""The cost of converting a card's rate to 16 kHz and back: processor time for each second of sound, one core.

python -m benchmarks.resampling
"""

from __future__ import annotations

import time

import numpy as np

from hvcpd.hardware.audio_resample import StreamResampler
from hvcpd.ports import SAMPLE_RATE_HZ

CARD_RATES_HZ = (16_000, 44_100, 48_000)
DURATION_S = 10
BLOCKS_A_SECOND = 40
"""Blocks of 25 ms, as the daemon has them."""


def cost_percent(from_hz: int, to_hz: int) -> float:
    """Share of one core that the stream takes, in percent."""
    sound = np.random.default_rng(1).standard_normal(from_hz * DURATION_S).astype(np.float32)
    blocks = np.array_split(sound, DURATION_S * BLOCKS_A_SECOND)
    stream = StreamResampler(from_hz, to_hz)
    stream.push(blocks[0])  # the filters are made once
    begin_s = time.process_time()
    for block in blocks:
        stream.push(block)
    return 100 * (time.process_time() - begin_s) / DURATION_S


def main() -> None:
    for rate_hz in CARD_RATES_HZ:
        heard, said = cost_percent(rate_hz, SAMPLE_RATE_HZ), cost_percent(SAMPLE_RATE_HZ, rate_hz)
        print(f"{rate_hz:5d} Hz: hearing {heard:.2f} %, speaking {said:.2f} %, both {heard + said:.2f} % of one core")


if __name__ == "__main__":
    main()
