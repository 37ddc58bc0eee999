"""Two recognisers on one microphone: one for the sentences of known robots, one for spelled names.

A robot that spells its name is unknown, and so is its voice: the second recogniser listens for it in all voices. Its
vocabulary is small, so it costs less than the first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import chain

from hvcpd.ports import Samples
from hvcpd.recognition.around import EarsAround
from hvcpd.recognition.events import Event, Garbled, Recognised, Source
from hvcpd.recognition.recogniser import Recogniser

MIN_SPELLED_CONFIDENCE = 0.95
"""A wrong letter makes a name that nobody has. Spelled names have 0.98 and more down to 0 dB; of 80 other sentences one
was taken for a name, at 0.77 (`benchmarks/spelling.py`)."""
KEPT_SAMPLES = 16_000
"""Sentences are remembered for 1 s: by then the other recogniser has finished the same sound."""


class Listening(EarsAround):
    """Merges the events of both; each stretch of sound is reported once."""

    def __init__(
        self, sentences: Recogniser, spelled: Recogniser | None, later: Callable[[], Recogniser] | None = None
    ) -> None:
        """`later` makes `spelled` in `prepare` if it is missing. Raises ValueError if both recognisers do not share one
        watch."""
        if spelled is not None and spelled.watch is not sentences.watch:
            raise ValueError("two recognisers on one microphone share one watch")
        super().__init__(sentences)
        self._sentences = sentences
        self._spelled = spelled
        self._later = later
        self._understood: list[Recognised] = []

    @property
    def _all(self) -> list[Recogniser]:
        return [self._sentences] if self._spelled is None else [self._sentences, self._spelled]

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `Recogniser.push`."""
        out: list[Event] = []
        for sentences, *spelled in self._sentences.watch.push(samples, masked, self._all):
            out += self._once(sentences, list(chain(*spelled)))
        return out

    def lost(self, n_samples: int) -> list[Event]:
        """As `Recogniser.lost`."""
        reported: list[Event] = []
        for sentences, *spelled in self._sentences.watch.lose(n_samples, self._all):
            reported += self._once(sentences, list(chain(*spelled)))
        for recogniser in self._all:
            recogniser.begin_late()
        return reported

    def flush(self) -> list[Event]:
        """As `Recogniser.flush`."""
        out = self._sentences.flush()
        return out if self._spelled is None else self._once(out, [])

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare what takes long, while `go_on` holds; from then on spelled names are recognised, too."""
        if self._spelled is None and self._later is not None and go_on():
            spelled = self._later()
            spelled.begin_late()
            self._spelled = spelled

    def _once(self, sentences: list[Event], spelled: list[Event]) -> list[Event]:
        if not sentences and not spelled:
            return []
        names = [replace(event, source=Source.SPELLED) for event in spelled if isinstance(event, Recognised)]
        out: list[Event] = []
        for event in (*names, *sentences):
            if isinstance(event, Recognised | Garbled) and self._accounted(event):
                continue
            out.append(event)
            if isinstance(event, Recognised):
                self._understood = [*self._understood[-3:], event]
        return out

    def _accounted(self, event: Recognised | Garbled) -> bool:
        """Whether the sound of this event has already been understood."""
        return any(
            event.start_sample < known.end_sample and event.end_sample > known.start_sample
            for known in self._understood
            if event.end_sample - known.end_sample < KEPT_SAMPLES
        )
