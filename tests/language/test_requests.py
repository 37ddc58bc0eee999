"""Requests to one robot, of which some are safe even if they are misheard."""

from __future__ import annotations

import pytest

from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.requests import is_harmless_request

BOOK = Phrasebook(Vocabulary(("Rob", "Bot", "Anna"), ("plant",), ("water the red rose",), (1, 2)))


@pytest.mark.parametrize(
    "text",
    [
        "hi rob i am anna water the red rose",
        "rob turn left",
        "hi rob i am anna what is left",
        "hi rob i am anna say again",
    ],
)
def test_what_is_read_back_or_only_answered_is_harmless(text: str) -> None:
    assert is_harmless_request(BOOK, "Rob", text.split())
    assert not is_harmless_request(BOOK, "Bot", text.split()), "it is for another robot"


@pytest.mark.parametrize(
    "text",
    [
        "hi rob i am anna confirmed",
        "hi rob i am anna negative",
        "rob resume",
        "rob stop",
        "hi rob i am anna",
        "hi all i am anna what is left",
        "turn left",
        "hi rob i am rob turn left",
        "hi rob",
        "banana rob",
        "",
    ],
)
def test_what_counts_at_once_or_is_for_others_is_not(text: str) -> None:
    assert not is_harmless_request(BOOK, "Rob", text.split())
