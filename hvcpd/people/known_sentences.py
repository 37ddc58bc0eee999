"""Sentences of a person whose words are certain, by which the phone net learns the voice (`speaker_adaptation`).

Either the person was asked to say them, or a robot read back what it had understood, and the same person confirmed it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvcpd.language.graph import graph_of
from hvcpd.language.messages import Confirmed, ToRobot, Utterance
from hvcpd.people.bands import logs_of_segment
from hvcpd.people.enrolled import MAX_SENTENCE_FRAMES, SpokenSentence
from hvcpd.people.phones import CtcSearch, Pronounce, centred, phones_of
from hvcpd.people.takes import NOTHING, speech_in
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import HOP_SAMPLES
from hvcpd.recognition.second_pass import Segment

MOST_LOSS = 1.9
"""Of the phone net for each phone of the words, nepers. In four of Kokoro's voices at 20 dB, 108 of 108 sentences lost
less; of 216 taken for another sentence, none did."""
CONFIRMED_S = 20.0
"""Time after the sentence in which a confirmation refers to it: the robot has read it back by then."""


def spoken(segment: Segment, words: tuple[str, ...]) -> SpokenSentence:
    """A segment of sound in which these words were said, as the phone net hears it."""
    return SpokenSentence(words, centred(logs_of_segment(segment)))


def check_sentence(sound: Samples, words: tuple[str, ...], pronounce: Pronounce) -> tuple[SpokenSentence | None, str]:
    """The sentence in a recording, shape (n,), 16 kHz, of a person who was asked to say these words; or what is wrong
    with it."""
    speech = speech_in(sound)
    if speech is None or speech.fault:
        return None, speech.fault if speech is not None else NOTHING
    start, end = speech.begin * HOP_SAMPLES, min(speech.end * HOP_SAMPLES, len(sound))
    if end - start > MAX_SENTENCE_FRAMES * HOP_SAMPLES // 2:
        return None, "it takes too long; say the sentence without long pauses"
    sentence = spoken(Segment(np.asarray(sound, np.float32), start, start, end, 0), words)
    search = CtcSearch(graph_of(words), pronounce)
    fit = search.best(phones_of(sentence.logs).log_posteriors)
    if fit is None or fit.loss > MOST_LOSS * sum(map(search.n_phones, words)):
        return None, "that was not the sentence, or it was hardly to be understood"
    return sentence, ""


@dataclass
class _Candidate:
    speaker: str
    at_s: float
    segment: Segment
    words: tuple[str, ...]
    read_back: bool = False


class ConfirmedSentences:
    """Takes what the robot says, second-pass results and recognised sentences, in order; returns what is confirmed."""

    def __init__(self, own_name: str) -> None:
        self._own_name = own_name.lower()
        self._found: tuple[Segment, Recognised] | None = None
        self._candidate: _Candidate | None = None

    def said(self, utterance: Utterance) -> None:
        """Take a sentence that the robot says: one to the speaker reads the speaker's sentence back."""
        to = utterance.addressee.name.lower() if isinstance(utterance.addressee, ToRobot) else ""
        if self._candidate is not None and to == self._candidate.speaker:
            self._candidate.read_back = True

    def found(self, segment: Segment, sentence: Recognised) -> None:
        """Take a second-pass result for a segment of sound."""
        self._found = (segment, sentence)

    def heard(self, utterance: Utterance, start_s: float, now: float) -> tuple[str, SpokenSentence] | None:
        """Take a recognised sentence that began at `start_s`; return the speaker's name and earlier sentence if it
        confirms one."""
        speaker = (utterance.speaker or "").lower()
        found, self._found = self._found, None
        candidate = self._candidate
        if not speaker or speaker == self._own_name:
            return None
        if candidate is not None and speaker == candidate.speaker:
            self._candidate = None
        if isinstance(utterance.statement, Confirmed):
            if candidate is None or candidate.speaker != speaker or not candidate.read_back:
                return None
            if now - candidate.at_s > CONFIRMED_S:
                return None
            return utterance.speaker or "", spoken(candidate.segment, candidate.words)
        if found is not None and not found[0].within_talk:
            segment, sentence = found
            if abs(sentence.start_sample / SAMPLE_RATE_HZ - start_s) < 0.001:
                self._candidate = _Candidate(speaker, now, segment, sentence.words)
        return None
