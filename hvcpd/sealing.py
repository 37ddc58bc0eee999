"""The way between utterances and their seals: what a robot says is sealed, and what it hears is judged.

Where no key is set there is no such object, and nothing is sealed, judged or derived.
"""

from __future__ import annotations

from dataclasses import replace

from hvcpd.language import messages as m
from hvcpd.language.marks import is_sealed, without_mark
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.records import DoubtRecord, Record, SaveCounter
from hvcpd.security.guard import Guard, Verdict
from hvcpd.security.seal import Sentence
from hvcpd.security.trust import Trust


def sentence_of(utterance: m.Utterance, book: Phrasebook) -> Sentence:
    """What is sealed of an utterance: its canonical words, whatever was said for them ("hello" is "hi")."""
    match utterance.addressee:
        case m.ToRobot(name):
            to = name
        case m.ToTeam(team):
            to = f"team {team}"
        case m.ToAll():
            to = "all"
        case None:
            to = ""
    return Sentence(utterance.speaker or "", to, book.render(without_mark(utterance)))


def written(utterance: m.Utterance, book: Phrasebook) -> str:
    """An utterance as it is shown and kept: without a person's code, which others may still take."""
    return book.write(without_mark(utterance) if isinstance(utterance.mark, m.Code) else utterance)


class Sealing:
    """One robot's."""

    def __init__(self, guard: Guard) -> None:
        self.guard = guard

    def said(self, utterance: m.Utterance, book: Phrasebook, now: float) -> tuple[m.Utterance, list[Record]]:
        """What the robot says instead, and what is to be remembered of it."""
        return self.marked(utterance, book, now), self._saves()

    def heard(self, utterance: m.Utterance, book: Phrasebook, now: float) -> tuple[Trust, list[Record]]:
        """How far an utterance is to be trusted, and what is to be remembered of it."""
        verdict = self.judge(utterance, book, now)
        records = self._saves()
        if utterance.mark is not None and not verdict.trust.proves_speaker:
            text = written(utterance, book)
            records.append(DoubtRecord(now, utterance.speaker, text, verdict.trust.value, verdict.silence_s))
        return verdict.trust, records

    def _saves(self) -> list[Record]:
        return [SaveCounter(name, value) for name, value in self.guard.saves().items()]

    def marked(self, utterance: m.Utterance, book: Phrasebook, now: float) -> m.Utterance:
        """What the robot says instead: with its seal, if it is of those that have one."""
        if not is_sealed(utterance.statement):
            return utterance
        asks = isinstance(utterance.statement, m.SayAgain)
        return replace(utterance, mark=m.Seal(self.guard.seal(sentence_of(utterance, book), now, asks)))

    def judge(self, utterance: m.Utterance, book: Phrasebook, now: float) -> Verdict:
        """What to think of an utterance. One of a kind that is never sealed is no worse without."""
        mark = utterance.mark
        if mark is None:
            return Verdict(Trust.BARE)
        seal = mark.value if isinstance(mark, m.Seal) else None
        code = mark.digits if isinstance(mark, m.Code) else None
        asks = isinstance(utterance.statement, m.SayAgain)
        return self.guard.judge(sentence_of(utterance, book), seal, code, now, asks)
