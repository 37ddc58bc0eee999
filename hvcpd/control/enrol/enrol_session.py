"""Leads a person through sentences or words at the microphone: asks, listens, shows the level, and asks again."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TextIO

import numpy as np

from hvcpd.control.enrol.recordings import check_take
from hvcpd.hardware.acoustics import SILENCE_DBFS, level_dbfs
from hvcpd.hardware.audio_exchange import SoundStream
from hvcpd.people.enrolled import SpokenSentence
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.frontend import Energies
from hvcpd.reporting.text import plural

SETTLE_S = 0.5
"""Sound cards click and adapt when they are opened."""
NOISE_S = 1.0
"""Time of quiet before the first word or sentence, to measure the noise."""
BEFORE_S = 0.3
"""Sound kept before speech."""
AFTER_S, AFTER_SENTENCE_S = 0.5, 1.0
"""Quiet that ends a word, and a sentence, in which people pause."""
WAIT_S = 6.0
"""Time for somebody to begin, before the word or sentence is asked for again."""
LONGEST_S, LONGEST_SENTENCE_S = 3.0, 15.0
ONSET_DB = 12.0
"""Least level of a word above the noise."""
LEAST_NOISE_DBFS = -100.0
"""Noise of a microphone that gives digital silence between words."""
TRIES = 4
"""Attempts at one word or sentence; then it is left out."""
Words = tuple[str, ...]
CheckOfSentence = Callable[[Samples, Words], tuple[SpokenSentence | None, str]]
"""What a recording, shape (n,), of a sentence with known words holds, or None and the reason why it cannot be used."""

_BARS = " ▁▂▃▄▅▆▇█"
_BAR_DB = 7.0
"""One step of the meter, from -70 dBFS on."""


@dataclass(frozen=True)
class _Asked:
    """What a person is asked to say, how it is written; `take` keeps a good recording, or returns what is wrong with
    it; `left_out` is written if none was good."""

    text: str
    take: Callable[[Samples], str]
    left_out: str


def record_takes(words: Sequence[str], takes: int, stream: SoundStream, out: TextIO) -> dict[str, list[Energies]]:
    """`takes` takes of each word. Raises DeviceError. What was said until an interrupt is kept."""
    found: dict[str, list[Energies]] = {}

    def take(word: str, sound: Samples) -> str:
        good, fault = check_take(sound)
        if good is not None:
            found.setdefault(word, []).append(good)
        return fault

    left_out = "'{0}' is left out; enrol it later with --words {0}"
    once = [_Asked(word.upper(), partial(take, word), left_out.format(word)) for word in words]
    asked = once * takes  # all words once, then again: repeated at once, they are sung
    _Session(stream, out).lead(f"{plural(len(words), 'word')}, {plural(takes, 'time')} each", asked)
    return found


def record_sentences(
    sentences: Mapping[str, Words], check: CheckOfSentence, stream: SoundStream, out: TextIO
) -> list[SpokenSentence]:
    """What `check` makes of each sentence. Raises DeviceError. What was said until an interrupt is kept."""
    found: list[SpokenSentence] = []

    def take(words: Words, sound: Samples) -> str:
        good, fault = check(sound, words)
        found.extend([good] if good is not None else [])
        return fault

    left_out = "this sentence is left out; four are nearly as good as five"
    asked = [_Asked(text, partial(take, words), left_out) for text, words in sentences.items()]
    _Session(stream, out, AFTER_SENTENCE_S, LONGEST_SENTENCE_S).lead(plural(len(sentences), "sentence"), asked)
    return found


class _Session:
    def __init__(
        self, stream: SoundStream, out: TextIO, after_s: float = AFTER_S, longest_s: float = LONGEST_S
    ) -> None:
        self._stream = stream
        self._out = out
        self._after_s, self._longest_s = after_s, longest_s
        self._noise_dbfs = SILENCE_DBFS

    def lead(self, what: str, asked: Sequence[_Asked]) -> None:
        """Ask for one after the other until an interrupt; each is kept as soon as it is good."""
        try:
            asyncio.run(self._lead(what, asked))
        except KeyboardInterrupt:
            self._out.write("\ninterrupted; what was said is kept\n")

    async def _lead(self, what: str, asked: Sequence[_Asked]) -> None:
        try:
            await self._stream.open()
            await self._stream.start()
            await self._hear_noise()
            self._out.write(f"{what}. Say each one as you would to a robot.\n")
            for number, each in enumerate(asked, 1):
                await self._ask(f"[{number}/{len(asked)}] {each.text}", each)
        finally:
            await self._stream.close()

    async def _hear_noise(self) -> None:
        await self._read(SETTLE_S)
        self._out.write("Be quiet for a second.\n")
        self._out.flush()
        self._noise_dbfs = max(level_dbfs(await self._read(NOISE_S)), LEAST_NOISE_DBFS)

    async def _ask(self, prompt: str, asked: _Asked) -> None:
        """Ask until what is said is good, TRIES times at most."""
        for _ in range(TRIES):
            self._out.write(f"{prompt}  ")
            self._out.flush()
            fault = asked.take(await self._utterance())
            self._out.write(f"once more: {fault}\n" if fault else "good\n")
            if not fault:
                return
        self._out.write(f"{asked.left_out}\n")

    async def _utterance(self) -> Samples:
        """The speech from now on, until it is quiet; empty after WAIT_S of quiet."""
        blocks: list[Samples] = []
        heard = quiet = 0
        began: int | None = None
        while began is None or (
            quiet < self._after_s * SAMPLE_RATE_HZ and heard - began < self._longest_s * SAMPLE_RATE_HZ
        ):
            block = await self._block()
            blocks.append(block)
            heard += len(block)
            loud = level_dbfs(block) > self._noise_dbfs + ONSET_DB
            self._meter(block)
            quiet = 0 if loud else quiet + len(block)
            if loud and began is None:
                began = heard - len(block)
            if began is None and heard > WAIT_S * SAMPLE_RATE_HZ:
                return np.zeros(0, np.float32)
        return np.concatenate(blocks)[max(began - samples_in(BEFORE_S), 0) :]

    def _meter(self, block: Samples) -> None:
        if self._out.isatty():
            step = int((level_dbfs(block) + 70.0) / _BAR_DB)
            self._out.write(_BARS[min(max(step, 0), len(_BARS) - 1)] + "\b")
            self._out.flush()

    async def _read(self, seconds: float) -> Samples:
        blocks: list[Samples] = []
        while sum(map(len, blocks)) < seconds * SAMPLE_RATE_HZ:
            blocks.append(await self._block())
        return np.concatenate(blocks)

    async def _block(self) -> Samples:
        block = await self._stream.read()
        self._stream.write(np.zeros(len(block), np.float32))
        return block
