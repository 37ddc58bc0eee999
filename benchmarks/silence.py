"""Checks that the silence around a sentence, or its absence, does not change what is heard.

    python -m benchmarks.silence [--names Rob,Bot] [--voices oak,rose,…] [--forms 12] [--beds zeros,lsb,noise,offset]
        [--leads 0,1] [--tails 0,1] [--seed 0] [--jobs 1]

Each voice says one sentence of each form of the phrasebook (of --forms of them, drawn anew for each voice) to ears that
have heard nothing before, as `hvcpctl hear` has them. --leads and --tails are seconds before and after it; with 0 the
file is the sentence. --beds, what is in and around it, rounded to 16 bits: `zeros`, `lsb` (each sample one step up,
down or neither), `noise` (-75 dBFS, a quiet room), `offset` (a converter's, 1 % of full scale, with `lsb`). A sentence
is right if it and nothing else was understood; wrong if anything else was, or "stop" over it; and lost otherwise.
`motions`: of the wrong ones those that would move a robot otherwise than was asked. Intervals are Wilson's, 95 %.
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
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.plan import HearingPlan
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.evaluation.statistics import wilson
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised, Urgent
from hvcpd.recognition.stages import SynchronousWorker
from hvcpd.synthesis.voices import VOICES

T = TypeVar("T")
SPEECH_DBFS = -25.0
NOISE_DBFS = -75.0
"""A quiet room."""
OFFSET = 0.01
STEP = 1.0 / 32768.0
MOTIONS = (m.MoveBy, m.TurnBy, m.ComeBack, m.Order)
BEDS: dict[str, Callable[[int, np.random.Generator], Samples]] = {
    "zeros": lambda n, _: np.zeros(n, np.float32),
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
    recogniser = make_speech_recogniser(
        book, names, voices, HearingPlan(channel=SynchronousWorker(), second=SynchronousWorker())
    )
    return recogniser.push(sound) + recogniser.flush()


def verdict(case: Case) -> tuple[Case, str, str]:
    """Right, lost, wrong or a motion; and what was heard instead."""
    book, voices = team(case.names, case.voice)
    said = utterance_of(case, book)
    events = heard_in(sound_of(case, said, book, voices), book, case.names, voices)
    found = [book.parse(event.words) for event in events if isinstance(event, Recognised)]
    stopped = any(isinstance(event, Urgent) for event in events) and not isinstance(said.statement, m.Stop)
    if found == [said] and not stopped:
        return case, "right", ""
    told = f"{book.write(said)!r} was heard as {[book.write(each) for each in found]}" + " and stop" * stopped
    if not found and not stopped:
        return case, "lost", told
    moved = any(isinstance(each.statement, MOTIONS) and each.statement != said.statement for each in found)
    return case, "motions" if moved else "wrong", told


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
    print(f"{'bed':7} {'lead':>5} {'tail':>5} {'right':>12} {'95 %':>15} {'wrong':>6} {'motions':>8} {'lost':>5}")
    for (bed, lead_s, tail_s), c in counts.items():
        low, high = wilson(c["right"], c.total())
        print(
            f"{bed:7} {lead_s:5g} {tail_s:5g} {c['right']:5d} of {c.total():3d} {low:7.1%} to {high:4.0%} "
            f"{c['wrong'] + c['motions']:6d} {c['motions']:8d} {c['lost']:5d}"
        )


if __name__ == "__main__":
    main()
