"""Shared parts of the benchmarks with people: a team of robots, PocketSphinx, and the results of each."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hearing.worlds.microphones import Microphone, narrow
from benchmarks.people_material import Said
from hvcpd.assembly.make import make_speech_recogniser, make_waveform_books
from hvcpd.assembly.plan import HearingPlan
from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.evaluation.sphinx import WIDE_BEAMS, heard, make_decoder
from hvcpd.language.graph import WordGraph
from hvcpd.language.pattern import Words
from hvcpd.language.wordings import same_meaning
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised, Urgent
from hvcpd.recognition.stages import SpeechRecogniser, SynchronousWorker

NAMES = ("Rob", "Bot", "Anna")
SNR_DB = 20.0
BLOCK = 400
PAD_S = 0.5


class Stage:
    """A team of two robots that knows a person's name, and PocketSphinx with the same grammar."""

    def __init__(
        self, wrong: bool, names: Sequence[str] = NAMES, tasks: Path | None = None, cut_hz: float | None = None
    ) -> None:
        """`names`: of both robots, and of who else is known; `tasks`: a task file, else the default one; `cut_hz`: the
        highest frequency that the microphone gives."""
        self.wrong = wrong
        self.microphone = narrow(cut_hz) if cut_hz is not None else Microphone()
        self.names = tuple(names)
        self.sound = make_sound(None, user_cache_folder())
        self.book = make_phrasebook(self.names, DEFAULT_TEAMS, load_tasks(tasks or default_tasks_path()))
        self._books = make_waveform_books(self.book, self.names[:2], self.sound)
        self._peers: dict[int, Any] = {}

    def recogniser(self, people: Sequence[Person] = ()) -> SpeechRecogniser:
        """As the first robot has them, which knows the robots' words and has heard nothing."""
        known = {person.name.lower(): person for person in people}
        hearing = HearingPlan(people=known, channel=SynchronousWorker(), second=SynchronousWorker())
        robots = self.names[:2]
        return make_speech_recogniser(self.book, robots, self.sound, hearing, books=self._books, name=robots[0])

    def opinion(self, graph: WordGraph, people: Sequence[Person]) -> SecondPassRecogniser:
        """Of enrolled people, and of strangers."""
        known = {person.name.lower(): person for person in people}
        return SecondPassRecogniser(graph, self.sound.lexicon, known, True)

    def peer(self, graph: WordGraph) -> Any:
        """PocketSphinx as it comes, with beams that favour it."""
        if id(graph) not in self._peers:
            with tempfile.TemporaryDirectory() as folder:
                self._peers[id(graph)] = make_decoder(graph, Path(folder), self.sound.lexicon, **WIDE_BEAMS)
        return self._peers[id(graph)]

    def theirs(self, graph: WordGraph, sound: Samples, said: Said) -> str:
        """PocketSphinx's result for one sentence with PAD_S around it."""
        pad = round(PAD_S * SAMPLE_RATE_HZ)
        return heard(self.peer(graph), sound[max(said.start - pad, 0) : said.end + pad])


def listen(recogniser: SpeechRecogniser, sound: Samples) -> list[Event]:
    """All that the ears tell."""
    quiet = np.tile(sound[:SAMPLE_RATE_HZ], 3)
    sound = np.concatenate([sound, quiet])
    return [e for at in range(0, len(sound), BLOCK) for e in recogniser.push(sound[at : at + BLOCK])]


def found(events: Sequence[Event], said: Said) -> list[tuple[str, ...]]:
    """The sentences that were heard where one was said."""
    told = (e for e in near(events, said) if isinstance(e, Recognised | Urgent))
    return [e.words if isinstance(e, Recognised) else ("stop",) for e in told]


def near(events: Sequence[Event], said: Said) -> list[Event]:
    """What was told of the sound where a sentence was said."""
    return [e for e in events if e.start_sample < said.end and e.end_sample > said.start]


def say_the_same(one: Words, other: Words) -> bool:
    """Whether they mean the same: a halt is one whoever it is for, and however it was called."""
    return same_meaning(one, other) or one[-1:] == other[-1:] == ("stop",)
