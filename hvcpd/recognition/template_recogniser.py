"""The first pass, a streaming recogniser: samples in, sentences of the template decoder out.

While only noise is heard, the decoder sleeps, and the front end alone runs (`shared_front_end`). When the decoder
wakes, the last frames are replayed into it, so that no word is lost. All decisions are made at chunks of four frames
counted from the first sample, so the size of the pushed blocks changes no result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples
from hvcpd.recognition.decoder_session import (
    LONGEST_PAUSE_FRAMES,
    UNDER_WAY,
    DecoderSession,
    Sentence,
    confidence_features,
)
from hvcpd.recognition.events import Event, Garbled, Recognised, Source
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.network import Beam, Network
from hvcpd.recognition.noise import STEP_FRAMES
from hvcpd.recognition.shared_front_end import LONGER_WAIT_FRAMES, RECENT_FRAMES, Segmenter, SharedFrontEnd
from hvcpd.recognition.stream import CHUNK_FRAMES, Chunk
from hvcpd.recognition.templates import Take, TemplateBank

UNHEARD_LEAD_FRAMES = 28
"""Time (0.28 s) after lost sound within which a sentence that begins may be the end of a longer one: after 0.2 s "stop"
was still the end of "hi Bot, stop"."""
LATE_WAKE_FRAMES = 12
"""Time (0.12 s) after the first replayed frame within which a sentence that begins may have begun before it."""
WAKE_FRAMES = 24
"""Delay (240 ms) from the first sign of speech until the decoder wakes: long enough for the level of a vowel."""


@dataclass(frozen=True)
class RecogniserSettings:
    """Thresholds of the recogniser; the defaults are measured with `python -m benchmarks.hearing`."""

    min_confidence: float = 0.8
    """Confidence below which a sentence counts as garbled: of 1,102 right ones, most of them in noise, 49; of 253 wrong
    ones all but 17 (`benchmarks/confidence.py`)."""
    max_lead_in: float = 0.4
    """Largest `DecoderSession.lead_in`: a sentence must follow silence, so that none begins at a comma."""
    max_pause: float = 10.0
    """Most speech that a pause may skip, in frames: right sentences have 7 at most in noise and rooms, and a
    name left out ("hi rex, I am Ted" as "hi, I am Ted") has 15 and more."""
    min_gain: float = UNDER_WAY
    """Least gain of a sentence over the filler."""
    beam: Beam = field(default_factory=Beam)


class TemplateRecogniser:
    """Recognises the sentences of one word graph in several voices, by templates, and spelled names.

    A robot that spells its name is unknown, and so is its voice: a second recogniser for all voices does that.
    """

    def __init__(
        self,
        graph: WordGraph,
        templates: Mapping[str, Mapping[str, Sequence[Take]]],
        settings: RecogniserSettings | None = None,
        front_end: SharedFrontEnd | None = None,
        make_spelling_recogniser: Callable[[SharedFrontEnd], TemplateRecogniser] | None = None,
        source: Source = Source.TEMPLATES,
    ) -> None:
        """`templates[voice][word]`: one or a few takes of the word. `front_end`: shared with another recogniser on the
        same microphone. `make_spelling_recogniser` makes the one for spelled names, in `prepare`, whose `source` is
        SPELLED: it reports no garbled speech.

        Raises ValueError if a voice lacks a template of a word of `graph`.
        """
        self._settings = settings or RecogniserSettings()
        self._source = source
        bank = TemplateBank(templates)
        self.session = DecoderSession(Network(graph, bank.templates), bank, self._settings.beam)
        self.front_end = front_end or SharedFrontEnd()
        self.history = self.front_end.history
        self.chunks: list[Chunk] = []
        """The frames of the last push."""
        self._make_spelling = make_spelling_recogniser
        self._spelling: TemplateRecogniser | None = None
        self._segments = Segmenter()
        self._speech_age = 0
        self._calm_frames = 0
        self._reported_until = 0
        """The frame up to which everything has been reported."""
        self._whole_from = 0
        """The frame from which on a sentence may begin: sound before it was lost, or came while the decoder slept."""

    @property
    def busy(self) -> bool:
        """Whether somebody else is speaking right now, or has just ended a sentence that is still being decoded."""
        return self.front_end.activity.busy or self.session.under_way

    @property
    def speaking(self) -> bool:
        """Whether somebody else is speaking right now, or paused a moment ago."""
        return self.front_end.activity.busy

    @property
    def possible_speech(self) -> bool:
        """Whether the most recent sound may be speech, however faint."""
        return self.busy or self.front_end.activity.possible_speech

    @property
    def _all(self) -> list[TemplateRecogniser]:
        """Spelled names come first: the stages around drop what else was made of the same sound."""
        return [self] if self._spelling is None else [self._spelling, self]

    def push(self, samples: Samples, masked: bool = False) -> list[Event]:
        """Push the next samples, shape (n,), any n; `masked` while the robot itself speaks. Never raises on content."""
        return self._take(self.front_end.push(samples, masked))

    def lost(self, n_samples: int) -> list[Event]:
        """Advance time by `n_samples` that were lost before they arrived, 0 if the number is unknown.

        Speech in progress is reported as garbled. So is a sentence that seems to begin right after the gap: it may be
        the end of a longer one. Raises ValueError for a negative number.
        """
        chunks = self.front_end.lose(n_samples)
        found = self._break_off_all(self.front_end.stream.next_frame) + self._take(chunks)
        for recogniser in self._all:
            recogniser.note_lost_sound()
        return found

    def note_lost_sound(self) -> None:
        """Note that speech that begins now may be the end of something longer that was lost."""
        whole_from = self.front_end.stream.next_frame + CHUNK_FRAMES + UNHEARD_LEAD_FRAMES
        self._whole_from = max(self._whole_from, whole_from)

    def adopt(self, others: TemplateRecogniser) -> None:
        """As `SpeechRecogniser.adopt`."""
        self.session = others.session

    def prepare(self, go_on: Callable[[], bool]) -> None:
        """Prepare what takes long, while `go_on` holds; from then on spelled names are recognised, too."""
        if self._spelling is None and self._make_spelling is not None and go_on():
            spelled = self._make_spelling(self.front_end)
            spelled.note_lost_sound()
            self._spelling = spelled

    def flush(self) -> list[Event]:
        """Return the events that the end of a file completes; call it once, after the last `push`."""
        rest = self.front_end.stream.rest()
        events = self._take([rest] if len(rest.energies) else [])
        silence = self.front_end.silence(rest.first_frame + len(rest.energies), LONGER_WAIT_FRAMES // CHUNK_FRAMES + 8)
        return events + [event for chunk in silence for event in self._analyse(chunk)]

    def _take(self, chunks: Iterable[Chunk]) -> list[Event]:
        """The events of the next chunks, by all recognisers on this microphone."""
        events: list[Event] = []
        self.chunks = []
        for chunk in chunks:
            if chunk.masked:  # the robot's own voice covers everything
                events += self._break_off_all(chunk.first_frame)
                continue
            self.front_end.noise.push(chunk.energies)
            if self.front_end.noise.follow_step():  # speech before the step is lost
                events += self._break_off_all(chunk.first_frame - STEP_FRAMES)
            events += self._analyse(chunk)
        return events

    def _break_off_all(self, frame: int) -> list[Event]:
        events = [event for each in self._all for event in each.break_off(frame)]
        self.front_end.reset()
        return events

    def _analyse(self, chunk: Chunk) -> list[Event]:
        events: list[Event] = []
        for one in self.front_end.analysed(chunk):
            self.chunks.append(one)
            events += [event for each in self._all for event in each.consume(one)]
        return events

    def break_off(self, frame: int) -> list[Event]:
        """Forget all paths; speech before `frame` is reported as garbled."""
        speech = self._segments.close(frame)
        self.session.sleep()
        self._speech_age = 0
        return self._as_events(speech)

    def consume(self, chunk: Chunk) -> list[Event]:
        """Process the newest chunk of the front end."""
        energies, noise = chunk.energies, self.front_end.noise.estimate
        end_frame = chunk.first_frame + len(energies)
        recent = self.front_end.recent[-(end_frame - self._reported_until) :]
        if self.session.awake:
            self.session.feed(energies, recent, noise)
        elif self._should_wake(len(energies)):
            if len(recent) == RECENT_FRAMES:  # else the sound before is already handled
                self._whole_from = max(self._whole_from, end_frame - RECENT_FRAMES + LATE_WAKE_FRAMES)
            self._speech_age = 0
            self.session.wake(recent, end_frame - len(recent), noise)
        self._segments.push(chunk.first_frame, energies, self.front_end.activity.busy)
        events = self._report(end_frame)
        self._calm_frames = 0 if self.front_end.activity.possible_speech else self._calm_frames + len(energies)
        if self._calm_frames >= LONGEST_PAUSE_FRAMES and not self.session.under_way:
            self.session.sleep()
        return events

    def _should_wake(self, n_frames: int) -> bool:
        """Whether the first sign of speech was long enough ago."""
        if self._speech_age > 0 or self.front_end.activity.possible_speech:
            self._speech_age += n_frames
        return self._speech_age >= WAKE_FRAMES

    def _report(self, end_frame: int) -> list[Event]:
        """Report a sentence that has ended, or speech that has ended without one."""
        sentence = self.session.ended()
        if sentence is not None:
            recognised = self._accepted(sentence)
            if recognised is not None:
                self._segments.close(end_frame)
                self._continue_after(sentence.words[-1].step.end_frame, end_frame)
                return [recognised]
            self.session.forget()
        speech = self._segments.ended(end_frame, self.session.under_way)
        if speech is not None:
            self._continue_after(speech.end_sample // HOP_SAMPLES, end_frame)
        return self._as_events(speech)

    def _as_events(self, speech: Garbled | None) -> list[Event]:
        return [speech] if speech is not None and self._source is Source.TEMPLATES else []

    def _continue_after(self, frame: int, now: int) -> None:
        """Mark speech until `frame` as handled, `now` a later one; the next speaker may be much fainter."""
        self.session.sleep()
        self._speech_age = 0
        self._reported_until = frame
        self.front_end.activity.account_for(now - frame)

    def _accepted(self, sentence: Sentence) -> Recognised | None:
        s, start_frame = self._settings, sentence.words[0].step.start_frame
        if start_frame < self._whole_from:
            return None
        confidence = confidence_features(sentence).probability
        if confidence < s.min_confidence or sentence.cost > -s.min_gain:
            return None
        if sentence.pause > s.max_pause or self.session.lead_in(start_frame) > s.max_lead_in:
            return None
        spans = [w.step.span(w.text, confidence_features(sentence, w).probability) for w in sentence.words]
        found = Recognised.of(spans, sentence.voice, confidence, self._source)
        return replace(found, snr_db=self.front_end.snr_db(found.start_sample, found.end_sample))
