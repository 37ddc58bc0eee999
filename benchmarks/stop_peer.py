"""PocketSphinx's keyword mode, the peer of `benchmarks.stop`."""

from __future__ import annotations

import numpy as np

from hvcpd.ports import Samples
from hvcpd.recognition.events import Event, Urgent

PEER_THRESHOLD = 1e-20
"""At which it hears 20 of 20 people's and robots' calls in quiet, and 5 in 3.5 minutes of robots' talk; at 1e-15 19, 20
and 4, at 1e-30 all and 14."""


class Peer:
    """PocketSphinx's keyword mode, as a recogniser that tells nothing but the word."""

    def __init__(self) -> None:
        from pocketsphinx import Config, Decoder

        self._decoder = Decoder(Config(keyphrase="stop", kws_threshold=PEER_THRESHOLD, lm=None, loglevel="FATAL"))
        self._decoder.start_utt()

    def push(self, samples: Samples) -> list[Event]:
        """As `SpeechRecogniser.push`."""
        self._decoder.process_raw((np.clip(samples, -1.0, 1.0) * 32767.0).astype("<i2").tobytes(), False, False)
        if self._decoder.hyp() is None:
            return []
        self._decoder.end_utt()
        self._decoder.start_utt()
        return [Urgent(0, 0)]
