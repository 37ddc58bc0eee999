"""Listens for the urgent word beside the recogniser, and tells when to stand still, to go on and to stay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS
from hvcpd.recognition.hold import Hold, HoldSettings, Verdict
from hvcpd.recognition.lookalike import Lookalike
from hvcpd.recognition.paths import Coherent
from hvcpd.recognition.remainder import Remainder
from hvcpd.recognition.stream import Chunk
from hvcpd.recognition.templates import TemplateBank
from hvcpd.recognition.urgent import Spotted, UrgentSpotter


class Halting:
    """Joins the spotter of the word with the decision about it; without a spotter it hears nothing."""

    def __init__(self, bank: TemplateBank, spotter: UrgentSpotter | None, hold: HoldSettings | None = None) -> None:
        """`bank`: of the voices whose sentences the recogniser understands."""
        self._spotter = spotter
        texts = spotter.texts if spotter is not None else frozenset[str]()
        self._lookalike = Lookalike(bank, spotter) if spotter is not None else None
        self._remainder = Remainder(spotter) if spotter is not None else None
        self._hold = Hold(texts, self._alone, hold, self._subtracted)
        self._noise = np.zeros(N_BANDS, np.float32)
        self._span = (0, 0)
        self._quiet_since = 0
        self._fed = False

    @property
    def pending(self) -> bool:
        """Whether the word was heard, and what is told of it depends on the sentence around it."""
        return self._spotter is not None and self._spotter.pending

    def hear(
        self, chunk: Chunk, noise: NDArray[np.float32], events: Sequence[Event], speech: bool, sentence_ends: bool
    ) -> list[Event]:
        """Take a chunk, and the `events` that the recogniser found with it.

        `noise`: its energies, shape (N_BANDS,); `speech`: somebody may be speaking; `sentence_ends`: the recogniser
        may soon report a sentence that ended just now.
        """
        told: list[Event] = []
        for event in events:
            told += self._found(event)
        if self._spotter is None:
            return told
        now = chunk.first_frame + len(chunk.energies)
        if speech or self._spotter.pending:
            if self._remainder is not None:
                self._remainder.hear(chunk)
            self._quiet_since = now
            self._fed = True
            self._spotter.feed(chunk.first_frame, chunk.energies, noise)
            self._noise = noise
            told += self._look(self._spotter, now, sentence_ends)
        elif self._fed:
            self._fed = False
            self._spotter.reset()
        return told + self._tell(self._hold.at(now * HOP_SAMPLES, self._quiet_since * HOP_SAMPLES))

    def understood(self, sentences: Sequence[Coherent]) -> None:
        """These were understood by their waveform, and may be among the next events."""
        if self._remainder is not None:
            self._remainder.understood(sentences)

    def interrupt(self) -> list[Event]:
        """What was being said is lost; a word that is not told yet counts as said."""
        word = self._spotter.take() if self._spotter is not None else None
        verdicts = [self._heard(self._spotter, word, 0)] if self._spotter is not None and word is not None else []
        verdicts.append(self._hold.unclear())
        return self._tell(Verdict.SAID if Verdict.SAID in verdicts else verdicts[0])

    def _found(self, event: Event) -> list[Event]:
        if not isinstance(event, Recognised):
            return self._tell(self._hold.unclear())
        if self._spotter is not None and self._hold.accounts(event):
            self._spotter.accounted(event.words)
        return self._tell(self._hold.sentence(event))

    def _look(self, spotter: UrgentSpotter, frame: int, sentence_ends: bool) -> list[Event]:
        word = spotter.ended(frame, sentence_ends)
        return self._tell(self._heard(spotter, word, frame)) if word is not None else []

    def _heard(self, spotter: UrgentSpotter, word: Spotted, frame: int) -> Verdict:
        end = word.end_frame
        self._span = ((end - spotter.length) * HOP_SAMPLES, end * HOP_SAMPLES)
        if self._remainder is not None:
            self._remainder.keep(*self._span, self._noise)
        return self._hold.word(*self._span, word.score, max(frame, end) * HOP_SAMPLES, word.excuse)

    def _alone(self, sentence: Recognised, start: int, end: int) -> float:
        """How much of the word the sentence shows by itself."""
        return self._lookalike.share(sentence, start, end) if self._lookalike is not None else 0.0

    def _subtracted(self, sentence: Recognised, start: int, end: int) -> bool:
        return self._remainder is not None and self._remainder.explains(sentence, start, end)

    def _tell(self, verdict: Verdict) -> list[Event]:
        """The verdict as an event, with where the word was heard last."""
        match verdict:
            case Verdict.HELD:
                return [Held(*self._span)]
            case Verdict.RELEASED:
                return [Released(*self._span)]
            case Verdict.SAID:
                return [Urgent(*self._span)]
            case Verdict.UNCHANGED:
                return []
