"""The streaming recogniser: samples in, sentences out.

While only noise is heard, a cheap stage follows it (the `watch`) and the network sleeps. It wakes
with the last frames replayed into it, so that no word is lost. All decisions are made at chunks of four frames counted
from the first sample, so the size of the pushed blocks never changes a result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples
from hvcpd.recognition.activity import Segment, SegmentTracker
from hvcpd.recognition.agreement import Agreement
from hvcpd.recognition.coherent import CoherentListener
from hvcpd.recognition.confidence import sentence_features, word_features
from hvcpd.recognition.events import Event, Garbled, Recognised, Source, WordSpan
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.keyword.listener import KeywordListener
from hvcpd.recognition.network import Network
from hvcpd.recognition.paths import GREETING, Coherent
from hvcpd.recognition.settings import RecogniserSettings
from hvcpd.recognition.spotter import PATIENCE_FRAMES, QUIET_FRAMES, Sentence, Spotter
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk
from hvcpd.recognition.templates import Take, TemplateBank
from hvcpd.recognition.watch import RECENT_FRAMES, Watch

UNHEARD_LEAD_FRAMES = 28
"""A sentence this soon (0.28 s) after lost sound may be the end of a longer one."""
LATE_WAKE_FRAMES = 12
"""A sentence this soon (0.12 s) after the first frame replayed into the network may have begun before it."""


class Recogniser:
    """Listens to one microphone for the sentences of one word graph in several voices."""

    def __init__(
        self,
        graph: WordGraph,
        templates: Mapping[str, Mapping[str, Sequence[Take]]],
        settings: RecogniserSettings | None = None,
        watch: Watch | None = None,
        partial: frozenset[str] = frozenset(),
        coherent: CoherentListener | None = None,
        keyword: KeywordListener | None = None,
    ) -> None:
        """`templates[voice][word]`: one or a few takes of the word. `watch`: shared with other recognisers on the same
        microphone. `coherent` recognises sentences that noise hides from the templates. `keyword` detects one word,
        from any speaker and over any other sound.

        Raises ValueError if a voice that is not in `partial` lacks a template of a word of `graph`.
        """
        self._settings = settings or RecogniserSettings()
        bank = TemplateBank(templates)
        self._spotter = Spotter(Network(graph, bank.templates, partial), bank, self._settings.spotter)
        self._keyword = keyword or KeywordListener(None)
        self._agreement = Agreement(coherent) if coherent is not None else None
        self.watch = watch or Watch(self._settings.activity)
        self._segments = SegmentTracker(self._settings.segments)
        self._alert_age = 0
        self._calm_frames = 0
        self._heard_until = 0
        """Everything until this frame was heard."""
        self._dealt_with = 0
        """Everything until this frame was reported."""
        self._lost_until = -UNHEARD_LEAD_FRAMES
        """Sound was lost until this frame."""
        self._unheard_until = -UNHEARD_LEAD_FRAMES
        """Sound until this frame came too early for the decoder, which slept."""

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking right now, or has just ended a sentence that is still being decoded."""
        return self.watch.activity.busy or self.under_way

    @property
    def signs(self) -> bool:
        """Whether the most recent sound may be speech, however faint."""
        voiced = self._agreement is not None and self._agreement.coherent.voiced
        return self.busy or self.watch.activity.alert or voiced

    @property
    def under_way(self) -> bool:
        """Whether some path looks like a sentence in progress."""
        return self._spotter.under_way or self._coherent_follows

    @property
    def _coherent_follows(self) -> bool:
        return self._agreement is not None and self._agreement.coherent.follows is not None

    @property
    def follows(self) -> bool:
        """Whether a sentence that was in progress half a second ago has gone on ever since."""
        return self._spotter.follows or self._coherent_follows

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """Push the next samples, shape (n,), any n; `masked` while the robot itself speaks. Never raises on content."""
        return [event for (events,) in self.watch.push(samples, masked, [self]) for event in events]

    def lost(self, n_samples: int) -> list[Event]:
        """Advance time by `n_samples` that were lost before they arrived, 0 if the number is unknown.

        Speech in progress is reported as garbled. So is a sentence that seems to begin right after the gap: it may be
        the end of a longer one. Raises ValueError for a negative number.
        """
        found = [event for (events,) in self.watch.lose(n_samples, [self]) for event in events]
        self.begin_late()
        return found

    def begin_late(self) -> None:
        """Note that speech that begins now may be the end of something longer that was lost."""
        self._lost_until = self.watch.stream.next_frame + CHUNK_FRAMES

    def succeed(self, predecessor: Recogniser) -> None:
        """Continue from `predecessor`, between two sentences: take over its sample clock and its noise estimate."""
        self.watch, self._segments = predecessor.watch, predecessor._segments
        self._dealt_with, self._lost_until = predecessor._dealt_with, predecessor._lost_until
        self._unheard_until = predecessor._unheard_until
        self._keyword = predecessor._keyword

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare the coherent listener's reference sounds, while `go_on` holds. Takes seconds; another thread may call
        it."""
        if self._agreement is not None:
            self._agreement.coherent.prepare(go_on)

    def flush(self) -> list[Event]:
        """Return the events that the end of a file completes; call it once, after the last `push`."""
        silent_chunks = self._settings.segments.longer_wait_frames // CHUNK_FRAMES + 8
        found = [event for (events,) in self.watch.flush([self], silent_chunks) for event in events]
        return found + self._keyword.interrupt()

    def break_off(self, frame: int) -> list[Event]:
        """Forget all paths; speech before `frame` is reported as garbled."""
        segment = self._segments.close(frame)
        self._spotter.sleep()
        self._alert_age = 0
        garbled: list[Event] = [_garbled(segment)] if segment else []
        held = self._agreement.interrupt() if self._agreement is not None and not garbled else []
        return garbled + held + self._keyword.interrupt()

    def hear(self, chunk: Chunk) -> list[Event]:
        """Process the newest frames of the watch."""
        energies, noise = chunk.energies, self.watch.noise.estimate
        end_frame = self._heard_until = chunk.first_frame + len(energies)
        recent = self.watch.recent[-(end_frame - self._dealt_with) :]
        if self._spotter.awake:
            self._spotter.deferred.add(energies, recent)
        elif self._should_wake(len(energies)):
            if len(recent) == RECENT_FRAMES:  # else the sound before is already handled
                unheard = end_frame - RECENT_FRAMES + LATE_WAKE_FRAMES - UNHEARD_LEAD_FRAMES
                self._unheard_until = max(self._unheard_until, unheard)
            self._spotter.wake(recent, end_frame - len(recent), noise)
        self._segments.push(chunk.first_frame, energies, self.watch.activity.busy)
        events = [] if self._defers() else self._concluded(end_frame, noise)
        speech = self._spotter.awake or self.watch.activity.alert
        if self._agreement is not None:
            events = self._settled(self._agreement, chunk, events, speech)
        events += self._keyword.hear(chunk, events, self._spotter.best.node >= 0)
        self._doze(len(energies))
        return events

    def _defers(self) -> bool:
        """Whether to defer the network's decoding, since the coherent listener may understand the sentence."""
        if self._agreement is None or not self._spotter.awake or self._keyword.pending:
            return False
        if self._coherent_follows:
            return True
        speaks = self.watch.activity.quiet_frames < QUIET_FRAMES and self._agreement.coherent.listens
        return speaks and not self._spotter.heeds and self._spotter.deferred.n_frames < PATIENCE_FRAMES

    def _concluded(self, end_frame: int, noise: NDArray[np.float32]) -> list[Event]:
        """The events to report once the network has processed everything."""
        if not self._spotter.deferred:
            return self._conclude(end_frame)
        lefts = self._spotter.catch_up(noise, RECENT_FRAMES)
        return [event for left in lefts for event in self._conclude(end_frame - left)]

    def _settled(self, agreement: Agreement, chunk: Chunk, events: list[Event], speech: bool) -> list[Event]:
        """The events to report once the coherent listener has processed the chunk too."""
        heard = [
            sentence
            for sentence in agreement.coherent.push(chunk.first_frame * HOP_SAMPLES, chunk.samples, speech)
            if self._is_explained(sentence)
        ]
        self._keyword.understood(heard)
        since = (self._lost_until + UNHEARD_LEAD_FRAMES) * HOP_SAMPLES
        now = (chunk.first_frame + len(chunk.energies)) * HOP_SAMPLES
        told, dealt_with = agreement.settle(events, heard, since, now, self._described)
        if dealt_with:
            self._segments.close(dealt_with // HOP_SAMPLES)
            self._listen_on(dealt_with // HOP_SAMPLES)
        return told

    def _is_explained(self, sentence: Coherent) -> bool:
        """Whether it explains enough of the received energy. A call without a greeting is short: in quiet, where scores
        are high, a part of another sentence may resemble it, so no score replaces the share of energy that it
        explains."""
        s = self._settings
        if sentence.score >= s.surely and sentence.words[0].word == GREETING:
            return sentence.explained >= s.least_explained_surely
        speech, noise = self.watch.powers(*_frames_of(sentence))
        return sentence.explained * (speech + noise) >= s.least_explained * (speech + s.noise_share * noise)

    def _described(self, sentence: Coherent) -> Recognised:
        words = sentence.words
        spans = tuple(WordSpan(w.word, w.start, w.end, w.chance, max(1.0 - w.share, 0.0)) for w in words)
        return Recognised(
            tuple(word.word for word in words),
            sentence.voice,
            words[0].start,
            words[-1].end,
            float(np.prod([word.chance for word in words])),
            self._snr_db(*_frames_of(sentence)),
            spans,
            Source.WAVEFORM,
        )

    def _should_wake(self, n_frames: int) -> bool:
        """Whether the first sign of speech was long enough ago."""
        if self._alert_age == 0 and not self.watch.activity.alert:
            return False
        self._alert_age += n_frames
        if self._alert_age < self._settings.wake_frames:
            return False
        self._alert_age = 0
        return True

    def _doze(self, n_frames: int) -> None:
        self._calm_frames = 0 if self.watch.activity.alert else self._calm_frames + n_frames
        if self._spotter.awake and self._calm_frames >= self._settings.sleep_frames and not self.under_way:
            self._spotter.sleep()

    def _conclude(self, end_frame: int) -> list[Event]:
        """Report a sentence that has ended, or speech that has ended without one."""
        sentence = self._spotter.ended()
        if sentence is not None:
            recognised = self._judge(sentence)
            if recognised is not None:
                self._segments.close(end_frame)
                self._listen_on(sentence.steps[-1].end_frame)
                return [recognised]
            if not sentence.unfinished:
                self._spotter.forget()
        return self._conclude_garbled(end_frame)

    def _conclude_garbled(self, end_frame: int) -> list[Event]:
        segment = self._segments.ended(end_frame, self._spotter.under_way)
        if segment is None:
            return []
        self._segments.close(end_frame)
        self._listen_on(segment.end_frame)
        return [_garbled(segment)]

    def _listen_on(self, frame: int) -> None:
        """Mark speech until `frame` as handled; the next speaker may be much fainter."""
        self._spotter.sleep()
        self._alert_age = 0
        self._dealt_with = frame
        self.watch.activity.account_for(self._heard_until - frame)

    def _judge(self, sentence: Sentence) -> Recognised | None:
        s = self._settings
        if sentence.steps[0].start_frame < max(self._lost_until, self._unheard_until) + UNHEARD_LEAD_FRAMES:
            return None
        confidence = s.confidence.probability(sentence_features(sentence))
        if sentence.unfinished or confidence < s.min_confidence or sentence.cost > -s.min_gain:
            return None
        start, end = sentence.steps[0].start_frame, sentence.steps[-1].end_frame
        if sentence.pause > s.max_pause or self._spotter.lead_in(start) > s.max_lead_in:
            return None
        spans = tuple(
            WordSpan(
                self._spotter.word_of(step),
                step.start_frame * HOP_SAMPLES,
                step.end_frame * HOP_SAMPLES,
                s.confidence.probability(word_features(sentence, k)),
                deficit,
            )
            for k, (step, deficit) in enumerate(zip(sentence.steps, sentence.deficits, strict=True))
        )
        return Recognised(
            tuple(span.word for span in spans),
            sentence.voice,
            spans[0].start_sample,
            spans[-1].end_sample,
            confidence,
            self._snr_db(start, end),
            spans,
        )

    def _snr_db(self, start_frame: int, end_frame: int) -> float:
        speech, noise = self.watch.powers(start_frame, end_frame)
        return float(10.0 * np.log10(max(speech / max(noise, 1e-12), 1e-3)))


def _frames_of(sentence: Coherent) -> tuple[int, int]:
    """The first frame of its first word and the last frame of its last one."""
    return sentence.words[0].start // HOP_SAMPLES, sentence.words[-1].end // HOP_SAMPLES


def _garbled(segment: Segment) -> Garbled:
    return Garbled(segment.start_frame * HOP_SAMPLES, segment.end_frame * HOP_SAMPLES)
