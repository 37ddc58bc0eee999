"""`hvcpctl audit`: counts orders, refusals with their reasons, and each robot's share of the tasks."""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from hvcpd.config.tasks import TaskDefinition
from hvcpd.control.live.report import read_transcript
from hvcpd.control.output import show
from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.memory.store import TranscriptRow
from hvcpd.reporting.ends import ReportedEnds, told

REASONS: dict[type, str] = {
    m.Unable: "cannot",
    m.Unknown: "unknown task",
    m.Busy: "busy",
    m.Negative: "negative",
    m.NameTaken: "name taken",
    m.Stopped: "stopped",
}
"""The statements that refuse an order, and what they give for a reason."""

ORDERS = (m.Order, m.ComeBack, m.MoveBy, m.TurnBy)


@dataclass
class Audit:
    """Counts over a transcript. A speaker without a name counts as "somebody"."""

    sentences: Counter[str] = field(default_factory=Counter)
    """By speaker."""
    orders: Counter[str] = field(default_factory=Counter)
    """"Anna to Rob": how often."""
    taken: Counter[str] = field(default_factory=Counter)
    """Orders that were read back, as above."""
    refusals: Counter[str] = field(default_factory=Counter)
    """"Rob to Anna: busy": how often."""
    claims: Counter[str] = field(default_factory=Counter)
    done: dict[int, str] = field(default_factory=dict)
    """Each task's number and who was first to report it done."""
    deeds: Counter[str] = field(default_factory=Counter)
    """By robot; what recurs counts each time."""
    failed: Counter[str] = field(default_factory=Counter)
    stops: Counter[str] = field(default_factory=Counter)
    garbled: int = 0
    not_understood: int = 0
    """Sentences on file that today's phrasebook does not have, as after a change of names."""

    @property
    def shares(self) -> Counter[str]:
        """How many tasks each robot did, 0 for robots that only claimed."""
        shares = Counter(self.deeds)
        for name in self.claims:
            shares.setdefault(name, 0)
        return shares

    @property
    def fairness(self) -> float | None:
        """Jain's index of the shares (R. Jain et al. 1984): 1 when all did equally many, 1/n when one did all."""
        counts = list(self.shares.values())
        squares = sum(n * n for n in counts)
        return sum(counts) ** 2 / (len(counts) * squares) if squares else None


def audit(rows: Iterable[TranscriptRow], phrasebook: Phrasebook, tasks: Iterable[TaskDefinition]) -> Audit:
    """Count what was said and heard."""
    found, pending = Audit(), set[tuple[str, str]]()
    ends = ReportedEnds({task.number: task.name for task in tasks})
    for row in rows:
        if row.record.kind == "garbled":
            found.garbled += not row.record.text  # with a text it is a note, and nobody has spoken
            continue
        try:
            utterance = phrasebook.parse_text(row.record.text)
        except PhraseError:
            found.not_understood += 1
            continue
        speaker = utterance.speaker or row.record.speaker or "somebody"
        found.sentences[speaker] += 1
        for who, statement in told(utterance, speaker):
            for ended, task in ends.new(who, statement, row.wall_s or 0.0):
                if ended is m.Failed:
                    found.failed[who] += 1
                else:
                    found.deeds[who] += 1
                    found.done.setdefault(task, who)
        _count_orders(found, pending, utterance, speaker)
    return found


def _count_orders(found: Audit, pending: set[tuple[str, str]], u: m.Utterance, speaker: str) -> None:
    """Count orders, claims, stops and answers. `pending`: who is to answer an order, and whose."""
    to = str(u.addressee or m.ToAll())
    is_answer = (speaker, to) in pending
    match m.parts(u)[-1].statement:
        case order if isinstance(order, ORDERS):
            pending.add((to, speaker))
            found.orders[f"{speaker} to {to}"] += 1
        case m.Claim() | m.WillMove() if is_answer:
            found.taken[f"{to} to {speaker}"] += 1
            pending.remove((speaker, to))
        case (m.Claim() as claim) | m.Completed(claim=m.Claim() as claim):
            found.claims[speaker] += len(claim.tasks)
        case m.Stop():
            found.stops[speaker] += 1
        case no if type(no) in REASONS and (is_answer or isinstance(no, m.Unable | m.Unknown)):
            found.refusals[f"{speaker} to {to}: {REASONS[type(no)]}"] += 1
            pending.discard((speaker, to))


def run(options: argparse.Namespace, now_s: Callable[[], float] = time.time) -> None:
    """Print the counts."""
    _, rows, phrasebook, tasks = read_transcript(options, now_s())
    found = audit(rows, phrasebook, tasks)
    counts = {**vars(found), "shares": found.shares, "fairness": found.fairness}
    show(options.json, counts, *_lines(found))


def _lines(found: Audit) -> list[str]:
    parts = [
        ("Sentences, by speaker", found.sentences),
        ("Orders", found.orders),
        ("Orders that were read back", found.taken),
        ("Refusals", found.refusals),
        ("Tasks done", found.shares),
        ("Tasks failed", found.failed),
        ("Stops", found.stops),
    ]
    lines: list[str] = []
    for title, counts in parts:
        lines += [f"{title}:", *(f"  {n:5}  {what}" for what, n in sorted(counts.items())), ""] if counts else []
    fairness = "no task done" if found.fairness is None else f"{found.fairness:.2f} (1 = all equal)"
    lines += [f"Fairness of the split: {fairness}", f"Garbled: {found.garbled}"]
    if found.not_understood:
        lines.append(f"Not in today's phrasebook: {found.not_understood}; give the names of that time with --config")
    return lines
