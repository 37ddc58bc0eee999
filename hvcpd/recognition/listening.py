"""Two recognisers on one microphone: one for the sentences of known robots, one for spelled names.

A robot that spells its name is unknown, and so is its voice: the second recogniser listens for it in all voices. Its
vocabulary is small, so it costs less than the first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from hvcpd.ports import Samples
from hvcpd.recognition.around import EarsAround
from hvcpd.recognition.events import Event, Recognised, Source
from hvcpd.recognition.recogniser import Recogniser

MIN_SPELLED_CONFIDENCE = 0.95
"""A wrong letter makes a name that nobody has. Spelled names have 0.98 and more down to 0 dB; of 80 other sentences one
was taken for a name, at 0.77 (`benchmarks/spelling.py`)."""


class Listening(EarsAround):
    """Merges the events of both, names first: what else was made of the same sound is left to the ears around."""

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

    @property
    def _all(self) -> list[Recogniser]:
        return [self._sentences] if self._spelled is None else [self._sentences, self._spelled]

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """As `Recogniser.push`."""
        out: list[Event] = []
        for found in self._sentences.watch.push(samples, masked, self._all):
            out += _merged(*found)
        return out

    def lost(self, n_samples: int) -> list[Event]:
        """As `Recogniser.lost`."""
        reported: list[Event] = []
        for found in self._sentences.watch.lose(n_samples, self._all):
            reported += _merged(*found)
        for recogniser in self._all:
            recogniser.begin_late()
        return reported

    def flush(self) -> list[Event]:
        """As `Recogniser.flush`."""
        return self._sentences.flush()

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare what takes long, while `go_on` holds; from then on spelled names are recognised, too."""
        if self._spelled is None and self._later is not None and go_on():
            spelled = self._later()
            spelled.begin_late()
            self._spelled = spelled


def _merged(sentences: Sequence[Event], spelled: Sequence[Event] = ()) -> list[Event]:
    names = [replace(event, source=Source.SPELLED) for event in spelled if isinstance(event, Recognised)]
    return [*names, *sentences]
