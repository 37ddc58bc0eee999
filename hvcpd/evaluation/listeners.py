"""The listeners: our recogniser and Porcupine must find the sentences themselves, PocketSphinx is given their times."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository, default_tasks_path
from hvcpd.evaluation.sphinx import WIDE_BEAMS, make_decoder, sphinx_installed
from hvcpd.evaluation.sphinx import heard as heard_by_sphinx
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import SpeechRecogniser

OURS, PEER, PORCUPINE = "hvcpd", "PocketSphinx", "Porcupine"
"""Porcupine 1.9, the last wake-word engine of the paper's vendor that needs no key, hears its built-in words alone."""
CALLED, CALLER = "Ted", "Mia"
"""Mia speaks, Ted listens. Not the paper's Rob and Bot, which rhyme: PocketSphinx takes "hi rob" for "hi bot" in a hall
at 1.2 m even without noise (2 of 8), and so would fail for another reason than distance. Thresholds were fitted with
neither voice."""
WAKE_WORDS = ("Jarvis", "Bumblebee", "Terminator", "Computer")
"""Built-in words of Porcupine that can be a robot's name."""
LATE_S = 0.5
"""Longest delay from the end of a word to Porcupine's report."""
BLOCK = 400
"""Samples pushed at once, as on the bench."""
PAD_S = 0.5
"""Margin around a sentence, for PocketSphinx: a sharply cut sentence gives worse results."""


@dataclass(frozen=True)
class Said:
    """A sentence in a stream: samples `start` up to `end`."""

    words: tuple[str, ...]
    start: int
    end: int


Listen = Callable[[Samples, Sequence[Said]], list[str]]
"""Returns the result for each of the sentences in a sound, shape (n,), float32: its words, or "" for nothing."""


@cache
def sound() -> Sound:
    """The built-in pronunciations, with the units that this user has rendered before."""
    return make_sound(None, user_cache_folder())


@cache
def tasks() -> TaskRepository:
    """The paper's five plants."""
    return load_tasks(default_tasks_path())


@cache
def book(*names: str) -> Phrasebook:
    """All that these robots can say about the paper's five plants."""
    return make_phrasebook(names, DEFAULT_TEAMS, tasks())


def spoken(text: str, book: Phrasebook) -> tuple[tuple[str, ...], Samples]:
    """Return a sentence in the caller's voice: its words, and its sound, shape (n,), float32. Raises PhraseError."""
    phrases = book.phrases(book.parse_text(text))
    return tuple(word for phrase in phrases for word in phrase), sound().speaker_of(CALLER).render(phrases)


def sentences(recogniser: SpeechRecogniser, heard: Samples) -> list[Recognised]:
    """Return the sentences that a recogniser finds in a whole sound, shape (n,), float32."""
    events = [e for at in range(0, len(heard), BLOCK) for e in recogniser.push(heard[at : at + BLOCK])]
    return [e for e in (*events, *recogniser.flush()) if isinstance(e, Recognised)]


def _ours(book: Phrasebook) -> Listen:
    """A robot that has just been started, for one sound."""
    recogniser = make_speech_recogniser(book, (CALLER,), sound())

    def listen(heard: Samples, said: Sequence[Said]) -> list[str]:
        understood = sentences(recogniser, heard)
        return [
            " + ".join(" ".join(e.words) for e in understood if e.start_sample < s.end and e.end_sample > s.start)
            for s in said
        ]

    return listen


@cache
def _peer(book: Phrasebook) -> Listen:
    """PocketSphinx with the same grammar."""
    with tempfile.TemporaryDirectory() as folder:
        decoder = make_decoder(book.graph, Path(folder), sound().lexicon, **WIDE_BEAMS)
    pad = samples_in(PAD_S)
    return lambda heard, said: [heard_by_sphinx(decoder, heard[max(s.start - pad, 0) : s.end + pad]) for s in said]


@cache
def _porcupine(_book: Phrasebook) -> Listen:
    import pvporcupine

    engine = pvporcupine.create(keywords=[name.lower() for name in WAKE_WORDS])

    def listen(heard: Samples, said: Sequence[Said]) -> list[str]:
        samples, found = (np.clip(heard, -1, 1) * 32767).astype("<i2"), []
        for at in range(0, len(samples) - engine.frame_length + 1, engine.frame_length):
            index = engine.process(samples[at : at + engine.frame_length].tolist())
            if index >= 0:
                found.append((at + engine.frame_length, WAKE_WORDS[index]))
        return called(found, said)

    return listen


def called(reports: Iterable[tuple[int, str]], said: Sequence[Said]) -> list[str]:
    """The robots called in each sentence, by reports of a name at a sample: those that came while it was said."""
    late, reports = samples_in(LATE_S), list(reports)
    return [" ".join(name.lower() for at, name in reports if s.start < at <= s.end + late) for s in said]


def _porcupine_installed() -> bool:
    """Whether there is a version that needs no key."""
    if importlib.util.find_spec("pvporcupine") is None:
        return False
    return int(importlib.metadata.version("pvporcupine").split(".")[0]) < 2


MAKERS: dict[str, Callable[[Phrasebook], Listen]] = {OURS: _ours, PEER: _peer, PORCUPINE: _porcupine}
"""What makes each listener for a phrasebook; it listens to one sound. Raises ImportError where it is not installed."""
_INSTALLED = {OURS: lambda: True, PEER: sphinx_installed, PORCUPINE: _porcupine_installed}


def available(*listeners: str) -> list[str]:
    """Those of the listeners that this machine has."""
    return [name for name in listeners if _INSTALLED[name]()]
