"""One robot's part in measuring distances: it knows the samples of what was said, and looks for them in what was heard.

A: "Hi Bot, I am Rob, how far are you" · B: "Hi Rob, I am Bot, I will measure it" · B: "Hi Rob, I am Bot, I measure four
eight two three". Both measure when the first two arrive at their microphones, and the third tells A B's interval.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from hvcpd.language import messages as m
from hvcpd.ports import Samples, samples_in
from hvcpd.ranging.arrival import LATE, REACH, Arrival, arrival
from hvcpd.ranging.distance import Distance, distance, interval_ticks, is_sure
from hvcpd.recognition.stream import History

OWN_WAY_M = 0.1
"""From a robot's loudspeaker to its microphone, as on a TurtleBot3; half an error of it is in the distance."""

Render = Callable[[m.Utterance], "Samples | None"]
"""The sound of another robot's sentence, shape (n,), float32; None if it is not known."""


@dataclass(frozen=True)
class Timed:
    """The robot named asked, and is to be told this interval; None: it was not measured well enough."""

    asker: str
    ticks: int | None


class Ranging:
    """Call `say` and `said` at the beginning and the end of each own sentence, `understood` for those of others.
    Samples are counted by the microphone."""

    def __init__(self, name: str, history: History) -> None:
        """`history`: all sound of the microphone, the robot's own voice, too."""
        self._name = name.lower()
        self._history = history
        self.lost(0)

    def lost(self, until: int) -> None:
        """Sound was lost until that sample: nothing before it can be compared with anything after it."""
        self._whole_from = until
        self._saying: tuple[m.Utterance, Samples, int] | None = None
        self._questions: dict[str, Arrival | None] = {}
        """Of others, by their names."""
        self._asked: tuple[str, Arrival | None] | None = None
        self._answers: dict[str, tuple[Arrival, Arrival]] = {}
        """The own question and the answer, by the name of the robot that answered."""

    def say(self, utterance: m.Utterance, sound: Samples, start: int) -> None:
        """The robot begins to say `sound`; its first sample is played over sample `start`."""
        timed = isinstance(utterance.statement, m.HowFarAway | m.Measuring)
        self._saying = (utterance, sound, start) if timed else None

    def said(self, latency_s: float) -> Timed | None:
        """The own sentence was heard; each sample `latency_s` after it was played. Returns what is to be told."""
        if self._saying is None:
            return None
        (utterance, sound, start), self._saying = self._saying, None
        if not isinstance(utterance.addressee, m.ToRobot):
            return None
        name, own = utterance.addressee.name, self._arrival(sound, start + samples_in(latency_s))
        if isinstance(utterance.statement, m.HowFarAway):
            self._answers.pop(name.lower(), None)  # what follows belongs to the new question
            self._asked = (name.lower(), own)
            return None
        question = self._questions.pop(name.lower(), None)
        if own is None or question is None or not (is_sure(own) and is_sure(question)):
            return Timed(name, None)
        return Timed(name, interval_ticks(question, own, OWN_WAY_M))

    def understood(self, utterance: m.Utterance, start: int, render: Render) -> Distance | None:
        """Another robot's sentence, which began near sample `start`, was understood. Returns its distance if it
        completes a measurement."""
        to, name = utterance.addressee, (utterance.speaker or "").lower()
        if not isinstance(to, m.ToRobot) or to.name.lower() != self._name:
            return None
        match utterance.statement:
            case m.HowFarAway():
                self._questions[name] = self._rendered(utterance, start, render)
            case m.Measuring() if self._asked is not None and self._asked[0] == name:
                own, answer = self._asked[1], self._rendered(utterance, start, render)
                self._asked = None
                if own is not None and answer is not None:
                    self._answers[name] = own, answer
            case m.CannotMeasure():
                self._answers.pop(name, None)
            case m.Measured() as measured if name in self._answers:
                return distance(*self._answers.pop(name), measured.ticks, OWN_WAY_M)
        return None

    def _rendered(self, utterance: m.Utterance, start: int, render: Render) -> Arrival | None:
        sound = render(utterance)
        return self._arrival(sound, start) if sound is not None else None

    def _arrival(self, sound: Samples, near: int) -> Arrival | None:
        """By the microphone's count; None if it was not heard."""
        first = near - REACH
        heard = self._history.between(first, near + len(sound) + REACH) if first >= self._whole_from else None
        if heard is None or near + len(sound) + LATE > self._history.end + REACH:
            return None
        found = arrival(heard, sound, REACH)
        return found.later(first) if found is not None else None
