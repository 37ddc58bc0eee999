"""Is a sentence heard as it was said whatever silence is around it, or none?

    python -m benchmarks.silence [--names Rob,Bot] [--voices oak,rose,…] [--forms 12] [--beds nothing,zeros,…]
        [--leads 0,1] [--tails 0,1] [--seed 0] [--jobs 1]

Each voice says one sentence of each form of the phrasebook (of --forms of them, drawn anew for each voice) to ears that
have heard nothing before, as `hvcpctl hear` has them. What is around and beneath it, rounded to 16 bits: `nothing` and
`zeros` (beneath it is nothing in both; around it is nothing, or zeros), `lsb` (each sample one step up, down or
neither), `noise` (-75 dBFS, a quiet room), `offset` (a converter's, 1 % of full scale, with `lsb`). A sentence is right
if it and nothing else was understood, wrong if anything else was, and lost otherwise; an interval is Wilson's, 95 %.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np

from benchmarks.stop import at_level
from hvcpd.assembly import DEFAULT_TEAMS, Sound, make_phrasebook, make_recogniser, make_sound, user_cache_folder
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.evaluation.statistics import wilson
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.people.ears import AtOnce, SecondEars
from hvcpd.people.opinion import SecondOpinion
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Held, Recognised, Urgent
from hvcpd.synthesis.voices import VOICES

T = TypeVar("T")
SPEECH_DBFS = -25.0
NOISE_DBFS = -75.0
"""A quiet room."""
OFFSET = 0.01
STEP = 1.0 / 32768.0
MOTIONS = (m.MoveBy, m.TurnBy, m.ComeBack, m.Order)
BEDS: dict[str, Callable[[int, np.random.Generator], Samples]] = {
    "zeros": lambda n, rng: np.zeros(n, np.float32),
    "lsb": lambda n, rng: np.asarray(rng.integers(-1, 2, n) * STEP, np.float32),
    "noise": lambda n, rng: np.asarray(rng.standard_normal(n) * 10.0 ** (NOISE_DBFS / 20.0), np.float32),
    "offset": lambda n, rng: np.asarray(OFFSET + rng.integers(-1, 2, n) * STEP, np.float32),
}


class FormByForm:
    """Chooses the form of that number, and all else by chance."""

    def __init__(self, number: int, chooser: random.Random) -> None:
        self._number: int | None = number
        self._chooser = chooser
        self.forms = 0

    def choice(self, seq: Sequence[T], /) -> T:
        if self._number is None:
            return self._chooser.choice(seq)
        number, self._number, self.forms = self._number, None, len(seq)
        return seq[number % len(seq)]


@dataclass(frozen=True)
class Case:
    """A sentence, and the silence around it."""

    voice: str
    form: int
    bed: str
    lead_s: float
    tail_s: float
    names: tuple[str, ...]
    seed: int


@cache
def team(names: tuple[str, ...], voice: str) -> tuple[Phrasebook, Sound]:
    """A team whose first robot has that voice and whose others have those after it."""
    at = [v.name for v in VOICES].index(voice)
    voices = {name.lower(): VOICES[(at + i) % len(VOICES)] for i, name in enumerate(names)}
    plain = make_sound(None, user_cache_folder())
    return make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path())), Sound(
        plain.lexicon, plain.cache, voices
    )


def forms_of(book: Phrasebook) -> int:
    chooser = FormByForm(0, random.Random(0))
    book.sample(chooser)
    return chooser.forms


def utterance_of(case: Case, book: Phrasebook) -> m.Utterance:
    chooser = random.Random(f"{case.seed} {case.voice} {case.form}")
    while True:
        said = book.sample(FormByForm(case.form, chooser))
        if said.speaker in (None, case.names[0]):
            return said


def sound_of(case: Case, said: m.Utterance, book: Phrasebook, sound: Sound) -> Samples:
    """What a file has of it."""
    speech = at_level(sound.speaker_of(case.names[0]).render(book.phrases(said)), SPEECH_DBFS)
    pads = round(case.lead_s * SAMPLE_RATE_HZ), round(case.tail_s * SAMPLE_RATE_HZ)
    speech = np.pad(speech, pads)
    speech = speech + BEDS[case.bed](len(speech), np.random.default_rng([case.seed, case.form]))
    return np.asarray(np.round(np.clip(speech, -1.0, 1.0) / STEP) * STEP, np.float32)


def heard_in(sound: Samples, book: Phrasebook, names: Sequence[str], voices: Sound) -> list[Event]:
    """All events of a file, as `hvcpctl hear` has them."""
    ears = make_recogniser(book, names, voices)
    second = SecondEars(ears, SecondOpinion(book.people_graph, voices.lexicon, {}, True), AtOnce())
    return second.push(sound) + second.take(ears.flush())


def verdict(case: Case) -> tuple[Case, str, str]:
    book, voices = team(case.names, case.voice)
    said = utterance_of(case, book)
    events = heard_in(sound_of(case, said, book, voices), book, case.names, voices)
    found = [book.parse(event.words) for event in events if isinstance(event, Recognised)]
    told = "; ".join(
        f"{e.confidence:.2f} {e.voice}: {book.write(book.parse(e.words))}" for e in events if isinstance(e, Recognised)
    )
    if any(isinstance(event, Urgent | Held) for event in events) and not isinstance(said.statement, m.Stop):
        told += " + stop"
        return case, "wrong", f"{book.write(said)!r} was taken for {told!r}"
    if found == [said]:
        return case, "right", ""
    moves = any(isinstance(each.statement, MOTIONS) for each in found) and not isinstance(said.statement, MOTIONS)
    if all(each == said for each in found):
        return case, "lost", f"{book.write(said)!r} was lost"
    return case, "moves" if moves else "wrong", f"{book.write(said)!r} was taken for {told!r}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--names", default="Rob,Bot")
    parser.add_argument("--voices", default=",".join(v.name for v in VOICES))
    parser.add_argument("--forms", type=int, default=0)
    parser.add_argument("--beds", default=",".join(BEDS))
    parser.add_argument("--leads", default="0,1")
    parser.add_argument("--tails", default="0,1")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    o = parser.parse_args()
    names = tuple(o.names.split(","))
    cases = []
    for voice in o.voices.split(","):
        n = forms_of(team(names, voice)[0])
        forms = range(n) if not o.forms else random.Random(f"{o.seed} {voice}").sample(range(n), o.forms)
        cases += [
            Case(voice, form, bed, float(lead), float(tail), names, o.seed)
            for form in forms
            for bed in o.beds.split(",")
            for lead in o.leads.split(",")
            for tail in o.tails.split(",")
        ]
    counts: dict[tuple[str, float, float], Counter[str]] = {}
    with ProcessPoolExecutor(o.jobs) as pool:
        for case, result, told in pool.map(verdict, cases, chunksize=8):
            counts.setdefault((case.bed, case.lead_s, case.tail_s), Counter())[result] += 1
            if told:
                print(f"  {case.bed} {case.lead_s:g} {case.tail_s:g} {case.voice} {case.form}: {told}", flush=True)
    for key, c in sorted(counts.items()):
        print(key, dict(c), wilson(c["right"], c.total()))


if __name__ == "__main__":
    main()
