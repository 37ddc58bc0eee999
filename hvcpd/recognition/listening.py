"""Two recognisers on one microphone: one for the sentences of those who are known, one for names that are spelled.

Who spells its name is not known, and neither is its voice: the second one listens for it in every voice there is. It
has few words, so that it costs less than the first.
"""

from __future__ import annotations

from hvcpd.ports import Samples
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.recognition.urgent import UrgentSpotter

MIN_SPELLED_CONFIDENCE = 0.95
"""A wrong letter makes a name that nobody has. Spelled names have 0.98 and more down to 0 dB; of 80 other sentences one
was taken for a name, at 0.77 (`benchmarks/spelling.py`)."""
KEPT_SAMPLES = 16_000
"""What was understood is remembered for 1 s: the other recogniser has come to its end by then."""


class Listening:
    """Events of both, each stretch of sound accounted for once."""

    def __init__(self, sentences: Recogniser, spelled: Recogniser | None) -> None:
        self._sentences = sentences
        self._spelled = spelled
        self._understood: list[Recognised] = []

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking right now."""
        return self._sentences.busy

    @property
    def urgent(self) -> UrgentSpotter | None:
        """What hears the urgent word."""
        return self._sentences.urgent

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `Recogniser.push`."""
        spelled = self._spelled.push(samples, masked) if self._spelled is not None else []
        return self._once(self._sentences.push(samples, masked), spelled)

    def lost(self, n_samples: int) -> list[Event]:
        """As `Recogniser.lost`."""
        spelled = self._spelled.lost(n_samples) if self._spelled is not None else []
        return self._once(self._sentences.lost(n_samples), spelled)

    def succeed(self, predecessor: Listening) -> None:
        """Go on where `predecessor` is: with its sample clock and what it knows of the noise."""
        self._sentences.succeed(predecessor._sentences)
        self._spelled = predecessor._spelled
        self._understood = predecessor._understood

    def _once(self, sentences: list[Event], spelled: list[Event]) -> list[Event]:
        if not sentences and not spelled:
            return []
        names = [event for event in spelled if isinstance(event, Recognised)]
        out: list[Event] = []
        for event in (*names, *sentences):
            if isinstance(event, Recognised | Garbled) and self._accounted(event):
                continue
            out.append(event)
            if isinstance(event, Recognised):
                self._understood = [*self._understood[-3:], event]
        return out

    def _accounted(self, event: Recognised | Garbled) -> bool:
        """Whether the sound of this event was understood already."""
        return any(
            event.start_sample < known.end_sample and event.end_sample > known.start_sample
            for known in self._understood
            if event.end_sample - known.end_sample < KEPT_SAMPLES
        )
