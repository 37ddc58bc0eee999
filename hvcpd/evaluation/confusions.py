"""The paper's Table II: the objective that is understood when another was said, at the paper's 354 cm."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.assembly.vocabulary import check
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.errors import PhraseError
from hvcpd.evaluation import listeners
from hvcpd.evaluation.calls import hear, who
from hvcpd.evaluation.listeners import CALLED, CALLER, OURS
from hvcpd.evaluation.scene import Bench
from hvcpd.evaluation.statistics import wilson
from hvcpd.evaluation.trials import Comparison, Experiment, Findings, Row, Scale, Table, Trial
from hvcpd.language.messages import Order, TaskByName, TaskByNumber
from hvcpd.language.phrasebook import Phrasebook

DISTANCE_M = 3.54
"""To which the paper's alternatives brought its translation (section IV-B2)."""
OBJECTIVES = ("green", "violet", "indigo", "orange", "yellow")
PAPER_TABLE = {
    "indigo": {"in the go": 3, "him to go": 4, "do it again": 3, "you to know": 1},
    "yellow": {"you know": 2},
    "orange": {"a range": 1},
}
"""The paper's Table II: what was understood instead, and how often; of how many trials is not given."""
PLAIN, LEARNED = "plain", "with alternatives"
NOTHING, OTHER = "nothing", "another sentence"


@cache
def _book(variant: str) -> Phrasebook:
    """As listeners.book; with alternatives also the paper's phrases, those that no sentence of ours holds."""
    tasks = listeners.tasks()
    for word, phrases in PAPER_TABLE.items() if variant == LEARNED else ():
        for phrase in phrases:
            more = replace(tasks, alternatives=(*tasks.alternatives, (word, phrase)))
            try:
                make_phrasebook((CALLED, CALLER), DEFAULT_TEAMS, more)
            except PhraseError:
                continue
            tasks = more
    return make_phrasebook((CALLED, CALLER), DEFAULT_TEAMS, tasks)


def _trials(scale: Scale) -> Sequence[Trial]:
    noise = Bench().robot_noise_db_spl
    rounds = max(scale.trials // 5, 1) if scale.quick else scale.trials
    settings = {"distance_m": DISTANCE_M, "robot_noise_db_spl": noise}
    listening = {PLAIN: who(), LEARNED: [OURS]}  # the peer's grammar has no alternatives
    return [
        Trial("confusions", scale.seed, {**settings, "variant": variant, "listeners": names, "round": k})
        for variant, names in listening.items()
        for k in range(rounds)
    ]


def _run(trial: Trial) -> Row:
    """Every objective once, in any order: each listener's result for it."""
    s, rng = trial.settings, trial.generator()
    bench, book = Bench(robot_noise_db_spl=s["robot_noise_db_spl"]), _book(s["variant"])
    order = [OBJECTIVES[k] for k in rng.permutation(len(OBJECTIVES))]
    texts = [f"Hi {CALLED}, I am {CALLER}, water the {objective} rose" for objective in order]
    spoken = [listeners.spoken(text, book) for text in texts]
    heard = hear(spoken, s["distance_m"], bench, rng, s["listeners"], book)
    taken = {name: [_objective(text, book) for text in got] for name, got in heard.items()}
    return {**s, "said": order, "taken": taken}


def _objective(text: str, book: Phrasebook) -> str:
    """The plant that a sentence orders a robot to water; or a note that it is another sentence, or none."""
    if not text:
        return NOTHING
    try:
        statement = book.parse(text.split()).statement
    except PhraseError:  # two sentences where one was said
        return OTHER
    if not isinstance(statement, Order):
        return OTHER
    task = statement.task
    number = listeners.tasks().by_number(task.number) if isinstance(task, TaskByNumber) else None
    name = task.name if isinstance(task, TaskByName) else number.name if number is not None else ""
    return next((objective for objective in OBJECTIVES if objective in name), OTHER)


def _summarise(rows: Sequence[Row]) -> Findings:
    counts: Counter[tuple[str, str, str, str]] = Counter()
    for row in rows:
        for name, taken in row["taken"].items():
            counts.update((row["variant"], name, said, got) for said, got in zip(row["said"], taken, strict=True))
    columns = (*OBJECTIVES, OTHER, NOTHING)
    groups = list(dict.fromkeys((variant, name) for variant, name, _, _ in sorted(counts, key=lambda k: k[0] != PLAIN)))
    table = tuple(
        (variant, name, said, *(counts[variant, name, said, got] for got in columns))
        for variant, name in groups
        for said in OBJECTIVES
    )
    return Findings(
        "What is taken for what (the paper's Table II)",
        (_paper_paragraph(), *(_paragraph(counts, variant, name) for variant, name in groups), _vocabulary_paragraph()),
        Table(("vocabulary", "listener", "said", *columns), table),
        lambda figure: _draw(figure, groups, table, columns),
        Bench().assumptions(),
        (2.2 + 2.4 * len(groups), 4.4),
        beside=(
            Comparison(
                f"objectives taken for something else at {DISTANCE_M * 100:.0f} cm",
                f"{sum(n for phrases in PAPER_TABLE.values() for n in phrases.values())}, of how many is not told",
                "; ".join(_beside(counts, *group) for group in groups),
            ),
        ),
    )


def _paper_paragraph() -> str:
    shown = "; ".join(
        f"{word}: " + ", ".join(f"“{phrase}” {n}" for phrase, n in phrases.items())
        for word, phrases in PAPER_TABLE.items()
    )
    return f"The paper's robots took at {DISTANCE_M * 100:.0f} cm (times, of a number not told) {shown}."


def _paragraph(counts: Counter[tuple[str, str, str, str]], variant: str, name: str) -> str:
    wrong, missed, total = _outcome(counts, variant, name)
    low, high = (100 * end for end in wilson(wrong, total))
    return (
        f"{name}, {variant}: of {total} orders {wrong} were taken for something else ({low:.1f} to {high:.1f} %), "
        f"{missed} were not understood at all."
    )


def _outcome(counts: Counter[tuple[str, str, str, str]], variant: str, name: str) -> tuple[int, int, int]:
    """Numbers of orders: those that were misunderstood, those that were not understood at all, and all."""
    mine = {(said, got): n for (v, who_, said, got), n in counts.items() if (v, who_) == (variant, name)}
    wrong = sum(n for (said, got), n in mine.items() if got not in (said, NOTHING))
    return wrong, sum(n for (_, got), n in mine.items() if got == NOTHING), sum(mine.values())


def _beside(counts: Counter[tuple[str, str, str, str]], variant: str, name: str) -> str:
    wrong, missed, total = _outcome(counts, variant, name)
    return f"{variant} {name}: {wrong} of {total}, {missed} not understood"


def _vocabulary_paragraph() -> str:
    found = check(_book(PLAIN), (CALLED, CALLER), listeners.sound())
    offenders = [c for c in found if c.confusable and not c.fixed]
    if offenders:
        pairs = ", ".join(f"“{c.first}” and “{c.second}”" for c in offenders)
        return f"The vocabulary check of {OURS} refuses {pairs}: a robot does not start with these words."
    return (
        f"The vocabulary check of {OURS} finds no words of this team that would be taken for one another, "
        "so there is none to replace."
    )


def _draw(
    figure: Any, groups: Sequence[tuple[str, str]], table: Sequence[tuple[Any, ...]], columns: Sequence[str]
) -> None:
    for axes, group in zip(figure.subplots(1, len(groups), squeeze=False)[0], groups, strict=True):
        cells = [row[3:] for row in table if row[:2] == group]
        shares = [[n / max(sum(row), 1) for n in row] for row in cells]
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        for y, row in enumerate(cells):
            for x, n in enumerate(row):
                if n:
                    axes.text(x, y, str(n), ha="center", va="center", color="white" if shares[y][x] > 0.5 else "black")
        axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right")
        axes.set_yticks(range(len(OBJECTIVES)), OBJECTIVES)
        axes.set(title=f"{group[1]}, {group[0]}", xlabel="heard", ylabel="said")


EXPERIMENT = Experiment("confusions", _trials, _run, _summarise, ("pyroomacoustics",))
