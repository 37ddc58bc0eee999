"""Which sentences of others a robot measures their distance by."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.tasks import TaskRepository
from hvcpd.language import messages as m
from hvcpd.language.range_messages import measured
from hvcpd.ports import Samples
from hvcpd.recognition.events import Recognised
from hvcpd.robot.measures import Measures
from hvcpd.robot.records import RangeRecord
from tests.ranging.test_arrival import LENGTH, VOICE
from tests.ranging.test_measurement import Asker, interval


class Mouth:
    """Says everything in the same sound."""

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples:
        return VOICE


@pytest.mark.parametrize(
    ("greeting", "confidence", "counts"), [("hi", 0.96, True), ("hi", 0.94, False), ("hello", 0.96, False)]
)
def test_a_distance_follows_from_what_was_surely_said_as_robots_say_it(
    greeting: str, confidence: float, counts: bool
) -> None:
    """A misheard digit would be another distance, and nobody knows the samples of a person's "hello"."""
    book = make_phrasebook(("Rob", "Bot"), ("plant",), TaskRepository(()))
    rob = Asker()
    measures, records = Measures(rob.ranging, lambda _: Mouth()), list[RangeRecord]()
    rob.asks()
    for statement in (m.Measuring(), measured(interval(3.0))):
        said, start = m.Utterance("Bot", m.ToRobot("Rob"), None, statement), rob.hear(VOICE)
        words = (greeting, *book.render(said)[1:])
        event = Recognised(words, "oak", start, start + LENGTH, confidence, 20.0, ())
        records += measures.understood(book.parse(words), event, book, 1.0)
    assert [record.peer for record in records] == (["Bot"] if counts else [])
    assert [*measures.distances] == (["bot"] if counts else [])
