"""The verdicts on the seal or the code of a sentence."""

from __future__ import annotations

from enum import Enum


class People(Enum):
    """Statements that people may command without a key. "Stop" is always obeyed."""

    EVERYTHING = "everything"
    QUESTIONS = "questions"
    """Questions and greetings."""
    NOTHING = "nothing"


class Trust(Enum):
    """The verdict over one sentence."""

    OPEN = "no key is set"
    FRESH = "the seal is right, and its speaker has proved to be here"
    SEALED = "the seal is right; its speaker has not been heard for a long time"
    CODE = "the one-time code is right"
    BARE = "no seal"
    WRONG = "the seal is wrong"
    AHEAD = "the seal is far ahead of what was heard"
    USED = "the seal was heard before"
    SILENCED = "too many wrong seals; ignored"
    REVOKED = "the speaker's key is revoked"

    @property
    def proves_speaker(self) -> bool:
        """Whether the speaker has a key or a code."""
        return self in (Trust.OPEN, Trust.FRESH, Trust.SEALED, Trust.CODE)

    @property
    def proves_presence(self) -> bool:
        """Whether it also cannot be a recording of a sentence that this robot never heard."""
        return self in (Trust.OPEN, Trust.FRESH, Trust.CODE)

    @property
    def checks_words(self) -> bool:
        """Whether every word is right, too: a seal is a checksum."""
        return self in (Trust.FRESH, Trust.SEALED)

    @property
    def may_be_misheard(self) -> bool:
        """Whether the same sentence, said again, may get a better verdict."""
        return self in (Trust.WRONG, Trust.AHEAD, Trust.SEALED)
