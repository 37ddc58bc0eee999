"""Conversion between utterances and their seals: outgoing ones are sealed or encrypted, incoming ones are judged.

Where no key is set there is no such object, and nothing is sealed, judged or derived.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from hvcpd.language import messages as m
from hvcpd.language.marks import CIPHER_TAG_BYTES, hidden, is_sealed, with_statement, without_mark
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.robot.records import DoubtRecord, Record, SaveCounter
from hvcpd.security.cipher import Message
from hvcpd.security.guard import Guard, Verdict
from hvcpd.security.seal import Sentence
from hvcpd.security.trust import Trust


def sentence_of(utterance: m.Utterance, book: Phrasebook) -> Sentence:
    """The sealed words of an utterance: its canonical form, whichever variant was said ("hello" is "hi").

    Of an encrypted one they are the words that everybody hears, and the meaning of the statements' numbers.
    """
    to = str(utterance.addressee) if utterance.addressee is not None else ""
    words = book.render(without_mark(hidden(utterance)))
    meaning = (book.codebook.digest.hex(),) if isinstance(utterance.mark, m.Cipher) else ()
    return Sentence(utterance.speaker or "", to, (*words, *meaning))


def written(utterance: m.Utterance, book: Phrasebook) -> str:
    """An utterance as it is shown and kept: without a person's code, which others may still take; an encrypted one is
    decrypted, if its meaning is known."""
    return book.write(without_mark(utterance) if isinstance(utterance.mark, m.Code | m.Cipher) else utterance)


def seal_shown(utterance: m.Utterance, trust: Trust | None = None) -> str:
    """The text that people see about an utterance's seal: "sealed", "encrypted", "code" or, if it was heard with a
    `trust` that proves nothing, "not trusted"; empty without a seal."""
    match utterance.mark:
        case None:
            return ""
        case _ if trust is not None and not trust.proves_speaker:
            return "not trusted"
        case m.Cipher():
            return "encrypted"
        case m.Seal():
            return "sealed"
        case m.Code():
            return "code"


@dataclass(frozen=True)
class Judged:
    """A sentence with its decrypted content, its trust, and the counters to remember."""

    utterance: m.Utterance
    trust: Trust
    records: tuple[Record, ...]


class Sealing:
    """One robot's. Where it `encrypts`, it hides its sentences to listeners with the key from all others: to groups,
    and to the robots of the `roster`, if there is one; people are answered plainly."""

    def __init__(self, guard: Guard, encrypts: bool = False, roster: Iterable[str] = ()) -> None:
        self.guard = guard
        self._encrypts = encrypts
        self._roster = frozenset(name.casefold() for name in roster)

    def said(self, utterance: m.Utterance, book: Phrasebook, now: float) -> tuple[m.Utterance, list[Record]]:
        """The sentence that the robot says instead, and the record of it."""
        return self.marked(utterance, book, now), self._saves()

    def heard(self, utterance: m.Utterance, book: Phrasebook, now: float) -> Judged:
        """The robot's verdict on an utterance."""
        opened, verdict = self.judge(utterance, book, now)
        records = self._saves()
        if utterance.mark is not None and not verdict.trust.proves_speaker:
            text = written(opened, book)
            records.append(DoubtRecord(now, utterance.speaker, text, verdict.trust.value, verdict.silence_s))
        return Judged(opened, verdict.trust, tuple(records))

    def _saves(self) -> list[Record]:
        return [SaveCounter(name, value) for name, value in self.guard.saves().items()]

    def marked(self, utterance: m.Utterance, book: Phrasebook, now: float) -> m.Utterance:
        """The sentence to say instead: encrypted, or else with its seal, if it is of a kind that has one."""
        number = (
            book.codebook.number_of(m.own_words(utterance.statement)) if self._hides_from_others(utterance) else None
        )
        asks = isinstance(utterance.statement, m.SayAgain)
        if number is not None:
            said = replace(utterance, mark=m.Cipher(0, book.cipher_words))
            plain = number.to_bytes(book.codebook.n_bytes, "big")
            packet = self.guard.encrypt(sentence_of(said, book), plain, now, asks)
            return replace(utterance, mark=m.Cipher(packet, book.cipher_words))
        if not is_sealed(utterance.statement):
            return utterance
        return replace(utterance, mark=m.Seal(self.guard.seal(sentence_of(utterance, book), now, asks)))

    def _hides_from_others(self, utterance: m.Utterance) -> bool:
        to = utterance.addressee
        name = to.name.casefold() if isinstance(to, m.ToRobot) else None
        to_person = name == m.FRIEND or (name is not None and bool(self._roster) and name not in self._roster)
        return self._encrypts and utterance.speaker is not None and not to_person

    def judge(self, utterance: m.Utterance, book: Phrasebook, now: float) -> tuple[m.Utterance, Verdict]:
        """The utterance with its decrypted content, if the key fits, and its trust. An utterance of a kind that is
        never sealed is no worse without a seal."""
        mark = utterance.mark
        if mark is None:
            return utterance, Verdict(Trust.BARE)
        if isinstance(mark, m.Cipher):
            return self._opened(hidden(utterance), mark, book, now)
        seal = mark.value if isinstance(mark, m.Seal) else None
        code = mark.digits if isinstance(mark, m.Code) else None
        asks = isinstance(utterance.statement, m.SayAgain)
        return utterance, self.guard.judge(sentence_of(utterance, book), seal, code, now, asks)

    def _opened(
        self, utterance: m.Utterance, mark: m.Cipher, book: Phrasebook, now: float
    ) -> tuple[m.Utterance, Verdict]:
        sentence = sentence_of(utterance, book)
        message = Message(sentence, mark.value, book.codebook.n_bytes + CIPHER_TAG_BYTES)
        verdict = self.guard.judge_message(message, now)
        number = int.from_bytes(verdict.plain, "big") if verdict.plain is not None else None
        statement = book.codebook.statement_of(number) if number is not None else None
        if statement is None:
            return utterance, verdict
        opened = with_statement(utterance, statement)
        if isinstance(opened.statement, m.SayAgain):
            self.guard.challenged(sentence, mark.value, verdict, now)
        return opened, verdict


def judged_by(sealing: Sealing | None, utterance: m.Utterance, book: Phrasebook, now: float) -> Judged:
    """The statement, and how far to trust it; without a key everybody is believed."""
    return sealing.heard(utterance, book, now) if sealing is not None else Judged(utterance, Trust.OPEN, ())
