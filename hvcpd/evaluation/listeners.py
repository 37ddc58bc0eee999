"""The listeners: our recogniser, which must find the sentences itself, and PocketSphinx, which is given their times."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskRepository, default_tasks_path
from hvcpd.evaluation.sphinx import WIDE_BEAMS, make_decoder
from hvcpd.evaluation.sphinx import heard as heard_by_sphinx
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples, samples_in
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import SpeechRecogniser

OURS, PEER = "hvcpd", "PocketSphinx"
CALLED, CALLER = "Ted", "Mia"
"""Mia speaks, Ted listens. Not the paper's Rob and Bot, which rhyme: PocketSphinx takes "hi rob" for "hi bot" in a hall
at 1.2 m even without noise (2 of 8), and so would fail for another reason than distance. Thresholds were fitted with
neither voice."""
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


@cache
def sound() -> Sound:
    """The built-in pronunciations, with the units that this user has rendered before."""
    return make_sound(None, user_cache_folder())


@cache
def tasks() -> TaskRepository:
    """The paper's five plants."""
    return load_tasks(default_tasks_path())


@cache
def book() -> Phrasebook:
    """All that the two robots can say about the paper's five plants."""
    return make_phrasebook((CALLED, CALLER), DEFAULT_TEAMS, tasks())


def spoken(text: str, book: Phrasebook) -> tuple[tuple[str, ...], Samples]:
    """Return a sentence in the caller's voice: its words, and its sound, shape (n,), float32. Raises PhraseError."""
    phrases = book.phrases(book.parse_text(text))
    return tuple(word for phrase in phrases for word in phrase), sound().speaker_of(CALLER).render(phrases)


def sentences(recogniser: SpeechRecogniser, heard: Samples) -> list[Recognised]:
    """Return the sentences that a recogniser finds in a whole sound, shape (n,), float32."""
    events = [e for at in range(0, len(heard), BLOCK) for e in recogniser.push(heard[at : at + BLOCK])]
    return [e for e in (*events, *recogniser.flush()) if isinstance(e, Recognised)]


def ours(heard: Samples, said: Sequence[Said], book: Phrasebook) -> list[str]:
    """Return the result of a freshly started robot for each sentence in the sound, shape (n,), float32: its words, or
    "" for nothing."""
    understood = sentences(make_speech_recogniser(book, (CALLER,), sound()), heard)
    return [
        " + ".join(" ".join(e.words) for e in understood if e.start_sample < s.end and e.end_sample > s.start)
        for s in said
    ]


@cache
def decoder(book: Phrasebook) -> Any:
    """PocketSphinx with that grammar. Raises ImportError."""
    with tempfile.TemporaryDirectory() as folder:
        return make_decoder(book.graph, Path(folder), sound().lexicon, **WIDE_BEAMS)


def peer(heard: Samples, said: Sequence[Said], book: Phrasebook) -> list[str]:
    """Return PocketSphinx's result, with the same grammar, for each sentence in the sound, shape (n,), float32; "" for
    nothing."""
    pad = samples_in(PAD_S)
    known = decoder(book)
    return [heard_by_sphinx(known, heard[max(s.start - pad, 0) : s.end + pad]) for s in said]
