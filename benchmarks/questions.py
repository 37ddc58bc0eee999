"""How much a mission's sentences tell people about it: a fixed bank of 20 questions, answered from the sentences alone.

In each mission one robot fails at a task and says why, and a person stops all and has them go on. Answers are read from
the words of the transcript, without the phrasebook; the mission itself tells which are right.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from benchmarks.routes import random_routes_plan
from hil_fakes.word_mission import WordMission
from hvcpd.coordination.states import State
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.words import number_words

REASON = "the tank is empty"
ROSES = "green violet indigo orange yellow white purple silver".split()
RESUMES_S = (20.0, 45.0, 70.0)
"""After the stop: a word lost under other speech is repeated."""
LATE_S = 30.0
"""A task that was done no longer ago may not have been reported: a report waits for its turn."""
_NUMBERS = {" ".join(number_words(n)): n for n in range(1, 20)}
_TASKS = rf"({'|'.join(_NUMBERS)})(?: and ({'|'.join(_NUMBERS)}))?"
_OPENING = re.compile(r"^Hi (.+?), I am (\w+)(?:, (.*))?$")
_CLAIM = re.compile(rf"I will complete task {_TASKS}\b")
_DONE = re.compile(rf"(?<!confirmed )task {_TASKS} complete")
_FAILED = re.compile(rf"task {_TASKS} failed(?:, (.*))?$")


@dataclass(frozen=True)
class Line:
    """A line of the transcript: its time, its speaker, and the words after the opening."""

    at_s: float
    speaker: str
    text: str


class Transcript:
    """Answers to questions, from the lines up to a time."""

    def __init__(self, written: Iterable[tuple[float, str]]) -> None:
        found = [(at_s, text, _OPENING.match(text)) for at_s, text in written]
        self.lines = [Line(at_s, f.group(2), f.group(3) or "") for at_s, _, f in found if f is not None]
        self.calls = [(at_s, text.lower()) for at_s, text, f in found if f is None]

    def _named(self, pattern: re.Pattern[str], until_s: float) -> list[tuple[float, str, int]]:
        """When and by whom which task was named so."""
        hits = [(line, f) for line in self.lines if line.at_s <= until_s for f in pattern.finditer(line.text)]
        return [(li.at_s, li.speaker, _NUMBERS[word]) for li, f in hits for word in f.group(1, 2) if word]

    def doers(self, until_s: float) -> dict[int, tuple[str, float]]:
        """The robot that did each task, and when that was first said."""
        return {n: (who, at_s) for at_s, who, n in reversed(self._named(_DONE, until_s))}

    def owner(self, number: int, at_s: float) -> str | None:
        """The robot that has an unfinished task: the last that claimed it, and has not given it up since."""
        claims = [who for _, who, n in self._named(_CLAIM, at_s) if n == number]
        gave_up = {who for _, who, n in self._named(_FAILED, at_s) if n == number}
        last = claims[-1] if claims and number not in self.doers(at_s) else None
        return last if last not in gave_up else None

    def failures(self) -> list[tuple[str, int, str]]:
        hits = [(line, f) for line in self.lines if (f := _FAILED.search(line.text))]
        return list(dict.fromkeys((line.speaker, _NUMBERS[f.group(1)], f.group(3) or "") for line, f in hits))

    def stopped(self) -> set[str]:
        return {line.speaker for line in self.lines if line.text == "I have stopped"}


class Truth(WordMission):
    """A mission that notes the owner of each task at a time, and the stopped robots."""

    asked_s = 0.0
    busy: dict[str, tuple[int, ...]]
    halted: set[str]

    def note(self, at_s: float) -> None:
        self.asked_s = at_s
        self.at(at_s, self._note_owners)

    def _note_owners(self) -> None:
        self.busy = {
            name: each.knowledge.my_tasks() if each.state in (State.GOING, State.ACTING) else ()
            for name, each in self.robots.items()
        }

    def note_stopped(self, at_s: float) -> None:
        self.at(at_s, lambda: setattr(self, "halted", {n for n, r in self.robots.items() if r.state is State.STOPPED}))


def fly(seed: int) -> tuple[Truth, Transcript]:
    """One mission in which a task fails for one robot, and all are stopped for a while."""
    rng = random.Random(seed)
    plan = random_routes_plan(seed, "nearest")
    failing = rng.choice(plan.tasks).number
    tasks = tuple(replace(t, name=f"water the {rose} rose") for t, rose in zip(plan.tasks, ROSES, strict=False))
    plan = replace(plan, tasks=tasks, reason=REASON, fails=_Once(failing))
    mission = Truth(plan, keep=True)
    stop_s = rng.uniform(25.0, 60.0)
    mission.tell(stop_s, "Anna", m.Utterance(None, None, None, m.Stop()))
    mission.note_stopped(stop_s + 10.0)
    for resume_s in RESUMES_S:
        mission.tell(stop_s + resume_s, "Anna", m.Utterance(None, None, None, m.Resume()))
    mission.note(stop_s + rng.uniform(30.0, 60.0))
    mission.run()
    numbers = tuple(task.number for task in plan.tasks)
    book = Phrasebook(
        Vocabulary(plan.names, ("plant",), tuple(t.name for t in plan.tasks), numbers, failures=(REASON,))
    )
    return mission, Transcript((at_s, book.write(u)) for at_s, _, u in mission.said)


class _Once:
    """The first robot that tries the task fails."""

    def __init__(self, number: int) -> None:
        self.number, self.who = number, ""

    def __call__(self, robot: str, task: int, _now: float) -> bool:
        fails = task == self.number and not self.who
        self.who = robot if fails else self.who
        return fails


def ask(seed: int) -> list[tuple[str, bool]]:
    """The questions of the bank about one mission, and whether each was answered rightly."""
    truth, told = fly(seed)
    rng = random.Random(-seed)
    a, b = (rng.choice(truth.plan.tasks).number for _ in range(2))
    who, at_s, end_s = rng.choice(truth.plan.names), truth.asked_s, truth.air.now
    by, doers = truth.by, told.doers(end_s)
    said_by = {n: name for n, (name, _) in doers.items()}
    times = {n: at for at, n, _ in truth.done}
    once = truth.plan.fails
    failed = [(once.who, once.number, REASON)] if isinstance(once, _Once) and once.who else []
    done_then = {n for n, at in times.items() if at <= at_s}
    surely_then = {n for n, at in times.items() if at <= at_s - LATE_S}
    told_then = set(told.doers(at_s))
    count, said_count = Counter(by.values()), Counter(said_by.values())
    most = {n for n, k in count.items() if k == max(count.values())}
    order = sorted(doers, key=lambda n: doers[n][1])

    def soon(n: int) -> bool:
        return abs(doers[n][1] - times[n]) <= LATE_S if n in doers and n in times else n not in doers and n not in times

    busy = {n for name, tasks in truth.busy.items() for n in tasks}
    owner_of = {n: name for name, tasks in truth.busy.items() for n in tasks}
    now_at = next(iter(truth.busy[who]), None)
    bank: dict[str, Callable[[], bool]] = {
        "Who did task A?": lambda: said_by.get(a) == by.get(a),
        "Who did task B?": lambda: said_by.get(b) == by.get(b),
        "Which tasks did R do?": lambda: {n for n in by if by[n] == who} == {n for n in said_by if said_by[n] == who},
        "How many tasks did R do?": lambda: count[who] == said_count[who],
        "How many did each do?": lambda: count == said_count,
        "Who did most?": lambda: {n for n, k in said_count.items() if k == max(said_count.values())} == most,
        "Which tasks are done in the end?": lambda: set(by) == set(said_by),
        "Are any left in the end?": lambda: (len(by) < len(truth.plan.tasks)) == (len(doers) < len(truth.plan.tasks)),
        "Which tasks are left at T?": lambda: surely_then <= told_then <= done_then,
        "How many are done at T?": lambda: len(surely_then) <= len(told_then) <= len(done_then),
        "Which was done first?": lambda: bool(order) and times[order[0]] <= min(times.values()) + LATE_S,
        "Which was done last?": lambda: bool(order) and times[order[-1]] >= max(times.values()) - LATE_S,
        "When was task A done?": lambda: soon(a),
        "Who is at work on task N at T?": lambda: all(told.owner(n, at_s) == owner_of[n] for n in sorted(busy)[:1]),
        "What is R doing at T?": lambda: now_at is None or now_at in told_then or told.owner(now_at, at_s) == who,
        "Who was stopped?": lambda: told.stopped() == truth.halted,
        "Did they go on?": lambda: any("resume" in text for _, text in told.calls),
        "Which task failed?": lambda: {n for _, n, _ in told.failures()} == {n for _, n, _ in failed},
        "Who failed, and why?": lambda: told.failures() == failed,
        "Who did it instead?": lambda: all(said_by.get(n) == by.get(n) for _, n, _ in failed),
    }
    return [(question, right()) for question, right in bank.items()]


def answered(seeds: Iterable[int]) -> None:
    """Print how many of the questions were answered rightly, and which were not."""
    answers = [each for seed in seeds for each in ask(seed)]
    wrong = Counter(question for question, right in answers if not right)
    right = len(answers) - wrong.total()
    print(f"{right} of {len(answers)} questions answered, {right / len(answers):.1%}")
    for question, n in wrong.most_common():
        print(f"{n:6} wrong: {question}")
