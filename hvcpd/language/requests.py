"""Requests to one robot."""

from __future__ import annotations

from collections.abc import Sequence

from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook

HARMLESS = m.Order | m.Motion | m.WhatDoing | m.WhatLeft | m.ReportWanted | m.SayAgain
"""What a robot reads back, to do it once that is confirmed, or merely answers."""


def is_harmless_request(book: Phrasebook, name: str, words: Sequence[str]) -> bool:
    """Whether somebody else asks this robot by name for something HARMLESS: if that was misheard, the answer shows it,
    and nothing has happened yet."""
    try:
        utterance = book.parse(words)
    except PhraseError:
        return False
    is_own = (utterance.speaker or "").lower() == name.lower()
    return utterance.addressee == m.ToRobot(name) and not is_own and isinstance(utterance.statement, HARMLESS)
