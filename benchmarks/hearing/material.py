"""The spoken material: random sentences of a team's phrasebook, each in its speaker's voice, in one stream of sound."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from benchmarks.manner import USUAL, Manner
from hvcpd.assembly.make import Books, make_speech_recogniser, make_waveform_books, word_bank
from hvcpd.assembly.sound import Sound, make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository, default_tasks_path
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.synthesis.leveling import audible
from hvcpd.synthesis.lexicon import common_words
from hvcpd.synthesis.speaker import Speaker

GAP_S = (1.2, 2.5)
"""Silence between two sentences, shortest and longest."""
LEAD_S = 2.0
"""Noise before the first sentence."""
BLOCK = 400
"""Samples pushed at once, as on the bench."""


@dataclass(frozen=True)
class Spoken:
    """A sentence in the stream: samples `start` up to `end`, where its last word is no longer audible.

    Sentences of the same `number` are one sentence, said again.
    """

    words: tuple[str, ...]
    start: int
    end: int
    number: int = -1


@dataclass(frozen=True)
class Team:
    """Robots that know each other's names, and their phrasebook."""

    names: tuple[str, ...]
    book: Phrasebook
    sound: Sound
    manner: Manner = USUAL

    def speakers(self, rate: float = 1.0) -> dict[str, Speaker]:
        """Their voices; `rate` above 1 is faster than the templates."""
        voices = {name: self.sound.voice_of(name) for name in self.names}
        return {
            name: self.manner.speaker(replace(voice, rate=rate * voice.rate), self.sound)
            for name, voice in voices.items()
        }

    @cached_property
    def bank(self) -> dict[str, dict[str, list[Samples]]]:
        """All words in all their voices."""
        voices = {voice.name: voice for voice in map(self.sound.voice_of, self.names)}
        return {name: dict(word_bank(self.book, self.sound.speaker_in(voice))) for name, voice in voices.items()}

    @cached_property
    def books(self) -> Books:
        """Their sentences, prepared as in a robot that has started."""
        books = make_waveform_books(self.book, self.names, self.sound)
        for book in books:
            book.prepare(lambda: True)
        return books

    def recogniser(self) -> SpeechRecogniser:
        """Fresh ears, as in every robot, but for people's second pass."""
        return make_speech_recogniser(self.book, self.names, self.sound, books=self.books)


def make_team(names: Sequence[str], tasks: TaskRepository | None = None, manner: Manner = USUAL) -> Team:
    """A team with the paper's five plants to water, or other tasks, that speaks in this manner."""
    book = make_phrasebook(names, DEFAULT_TEAMS, tasks or load_tasks(default_tasks_path()))
    return Team(tuple(names), book, manner.sound(), manner)


def more_tasks(n_words: int) -> TaskRepository | None:
    """Tasks that nobody can do, enough for a phrasebook of `n_words` words; None for the paper's five plants."""
    if n_words == 0:
        return None
    plain = load_tasks(default_tasks_path())
    team = make_team(("Rob", "Bot"))
    have = set(team.book.graph.words)
    spare = sorted(w for w in common_words() if w.isalpha() and 4 <= len(w) <= 12 and w not in have)
    random.Random(1).shuffle(spare)
    wanted = max(n_words - len(have), 0)
    return replace(plain, other_tasks=(*plain.other_tasks, *(f"water the {word} rose" for word in spare[:wanted])))


def make_stream(
    book: Phrasebook, speakers: Mapping[str, Speaker], n: int, seed: int, times: int = 1
) -> tuple[Samples, list[Spoken]]:
    """A stream of `n` random sentences without noise, at about -20 dBFS, and the place of each.

    Each is said `times` times in a row.
    """
    chooser = random.Random(seed)
    pieces: list[Samples] = [np.zeros(round(LEAD_S * SAMPLE_RATE_HZ), np.float32)]
    at = len(pieces[0])
    spoken = []
    names = list(speakers)
    for number in range(n):
        utterance = book.sample(chooser)
        phrases = book.phrases(utterance)
        voice = utterance.speaker or chooser.choice(names)
        sound = speakers[voice].render(phrases)
        words = tuple(w for phrase in phrases for w in phrase)
        for _ in range(times):
            spoken.append(Spoken(words, at, at + audible(sound)[1], number))
            gap = np.zeros(round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ), np.float32)
            pieces += [sound, gap]
            at += len(sound) + len(gap)
    return np.concatenate(pieces), spoken
