"""Online adaptation: a sentence that a person repeats on request, and then confirms, yields takes of its words.

Only then is the sentence certain: the robot has read it back, and the same person has confirmed it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hvcpd.language.messages import Confirmed, SayAgain, Utterance
from hvcpd.people.enrolled import MIN_FRAMES, Takes
from hvcpd.people.takes import check_take
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.frontend import Energies
from hvcpd.recognition.second_look import Piece

ASKED_S = 15.0
"""Time after "say again" in which a sentence counts as a repetition."""
CONFIRMED_S = 20.0
"""Time after the repetition in which a confirmation refers to it: the robot has read it back by then."""
EDGE_S = 0.02
"""Margin around a word, since its ends are not known to the frame."""


@dataclass
class _Candidate:
    speaker: str
    at_s: float
    takes: dict[str, list[Energies]]


class ConfirmedTakes:
    """Takes the robot's speech, results and recognised sentences, in order; returns takes when they are confirmed."""

    def __init__(self, own_name: str) -> None:
        self._own_name = own_name.lower()
        self._asked_s = float("-inf")
        self._found: tuple[Piece, Recognised] | None = None
        self._candidate: _Candidate | None = None

    def said(self, utterance: Utterance, now: float) -> None:
        """Take a sentence that the robot says."""
        if isinstance(utterance.statement, SayAgain):
            self._asked_s = now

    def found(self, piece: Piece, sentence: Recognised) -> None:
        """Take a second-pass result for a segment of sound."""
        self._found = (piece, sentence)

    def heard(self, utterance: Utterance, start_s: float, now: float) -> tuple[str, Takes] | None:
        """Take a recognised sentence that began at `start_s`; return the speaker's name and takes if it confirms
        some."""
        speaker = (utterance.speaker or "").lower()
        if not speaker or speaker == self._own_name:
            return None
        if isinstance(utterance.statement, Confirmed):
            candidate, self._candidate = self._candidate, None
            if candidate is None or candidate.speaker != speaker or now - candidate.at_s > CONFIRMED_S:
                return None
            return utterance.speaker or "", candidate.takes
        found, self._found = self._found, None
        self._candidate = None
        if found is None or now - self._asked_s > ASKED_S:
            return None
        piece, sentence = found
        if abs(sentence.start_sample / SAMPLE_RATE_HZ - start_s) < 0.001:
            takes = words_in(piece, sentence)
            self._candidate = _Candidate(speaker, now, takes)
        return None


def words_in(piece: Piece, sentence: Recognised) -> dict[str, list[Energies]]:
    """Each word of a sentence, cut out of its segment, with the noise before it removed."""
    edge = round(EDGE_S * SAMPLE_RATE_HZ)
    noise = piece.sound[: min(piece.lead, SAMPLE_RATE_HZ // 5)]
    found: dict[str, list[Energies]] = {}
    for span in sentence.spans:
        begin, end = span.start_sample - piece.origin - edge, span.end_sample - piece.origin + edge
        # The room's noise at both ends separates the word from its surroundings.
        sound = np.concatenate([noise, piece.sound[max(begin, 0) : end], noise])
        check = check_take(sound)
        if check.energies is not None and len(check.energies) >= MIN_FRAMES:
            found.setdefault(span.word, []).append(check.energies)
    return found
