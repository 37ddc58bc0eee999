"""Between a robot's conversation and its measurements of distance: renders what peers said, and tells the results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from hvcpd.coordination.commands import SURE
from hvcpd.coordination.coordination import Coordination
from hvcpd.language.messages import Utterance
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples
from hvcpd.ranging.ranging import Ranging
from hvcpd.recognition.events import Recognised
from hvcpd.robot.records import RangeRecord
from hvcpd.robot.speech_output import Mouth, spoken


@dataclass(frozen=True)
class Measures:
    """`mouth_of` has the synthesizer of the robot named, which makes the very samples that it says."""

    ranging: Ranging
    mouth_of: Callable[[str], Mouth]
    distances: dict[str, RangeRecord] = field(default_factory=dict)
    """The last distance of each robot, by its name in lower case."""

    def said(self, latency_s: float, coordination: Coordination, now: float) -> None:
        """The robot's own sentence was just heard, `latency_s` after it was played."""
        timed = self.ranging.said(latency_s)
        if timed is not None:
            coordination.timed(timed.asker, timed.ticks, now)

    def understood(
        self, utterance: Utterance, event: Recognised, book: Phrasebook, now: float
    ) -> tuple[RangeRecord, ...]:
        """Another robot's sentence was understood; returns the distance that follows from it, if one does. One that is
        less than SURE does not count: a misheard digit would be another distance."""

        def render(said: Utterance) -> Samples | None:
            if said.speaker is None or book.render(said) != event.words:
                return None  # in other words, or with others than a robot says
            return spoken(self.mouth_of(said.speaker), said, book)

        sure = event.confidence >= SURE
        found = self.ranging.understood(utterance, event.start_sample, render) if sure else None
        if found is None or utterance.speaker is None:
            return ()
        record = RangeRecord(now, utterance.speaker, found.distance_m, found.deviation_m, found.sure)
        self.distances[record.peer.lower()] = record
        return (record,)
