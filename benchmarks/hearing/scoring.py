"""Scores the reported sentences against the spoken ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum

from benchmarks.hearing.material import Spoken
from hvcpd.evaluation.statistics import wilson
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Event, Recognised, Urgent


class Outcome(Enum):
    """The outcome of a sentence. WRONG is a substitution: another sentence was understood, with confidence."""

    RIGHT = "right"
    WRONG = "wrong"
    GARBLED = "garbled"
    MISSED = "missed"


@dataclass
class Score:
    """Counts of one stream. `made_up` are sentences reported where nobody spoke; `delays_s` from the end of the last
    word until the report; `seconds` of processor time for `heard_s` of sound; `notes` describe each sentence not
    right."""

    outcomes: list[Outcome] = field(default_factory=list)
    made_up: int = 0
    delays_s: list[float] = field(default_factory=list)
    confidences: list[float] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0
    heard_s: float = 0.0

    def count(self, outcome: Outcome) -> int:
        return self.outcomes.count(outcome)

    @property
    def sentences(self) -> int:
        return len(self.outcomes)

    @property
    def share(self) -> float:
        """Of the sentences, right ones."""
        return self.count(Outcome.RIGHT) / max(self.sentences, 1)

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.count(Outcome.RIGHT), self.sentences)

    @property
    def realtime_factor(self) -> float:
        return self.seconds / max(self.heard_s, 1e-9)

    def add(self, spoken: Spoken, outcome: Outcome, instead: str = "") -> None:
        self.outcomes.append(outcome)
        if outcome is not Outcome.RIGHT:
            at_s = spoken.start / SAMPLE_RATE_HZ
            self.notes.append(f"{at_s:7.1f} s {' '.join(spoken.words)} -> {instead or outcome.value}")


def judge_events(events: Iterable[tuple[int, Event]], spoken: Sequence[Spoken]) -> Score:
    """Compare the reported sentences (with the sample of each report) with the spoken ones.

    Of a sentence that is said several times, the first time counts at which anything was understood.
    """
    score = Score()
    reports: dict[int, list[tuple[int, Event]]] = {}
    for at, event in events:
        index = next(
            (i for i, s in enumerate(spoken) if event.start_sample < s.end and event.end_sample > s.start), None
        )
        if index is not None:
            reports.setdefault(index, []).append((at, event))
        elif isinstance(event, Recognised | Urgent):
            score.made_up += 1
            words = " ".join(event.words) if isinstance(event, Recognised) else "stop!"
            score.notes.append(f"{event.start_sample / SAMPLE_RATE_HZ:7.1f} s nothing -> {words}")
    numbers: dict[int, list[int]] = {}
    for index, s in enumerate(spoken):
        numbers.setdefault(s.number if s.number >= 0 else -1 - index, []).append(index)
    for indices in numbers.values():
        _judge_one([(spoken[i], reports.get(i, [])) for i in indices], score)
    return score


def _judge_one(times: Sequence[tuple[Spoken, Sequence[tuple[int, Event]]]], score: Score) -> None:
    noticed = False
    for spoken, reports in times:
        understood = [(at, e) for at, e in reports if isinstance(e, Recognised)]
        wrong = [" ".join(e.words) + f" ({e.confidence:.2f})" for _, e in understood if e.words != spoken.words]
        wrong += ["stop!" for _, e in reports if isinstance(e, Urgent) and "stop" not in spoken.words]
        if wrong:
            score.add(spoken, Outcome.WRONG, " + ".join(wrong))
            return
        if understood:
            score.add(spoken, Outcome.RIGHT)
            at, event = understood[0]
            score.delays_s.append((at - spoken.end) / SAMPLE_RATE_HZ)
            score.confidences.append(event.confidence)
            return
        noticed = noticed or bool(reports)
    score.add(times[0][0], Outcome.GARBLED if noticed else Outcome.MISSED)
