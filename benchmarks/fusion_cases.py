"""The data to which the confidence of a sentence is fitted: speech, to robots or not, and the listeners' results.

Speakers, voices, rooms and noises that tests hear are never drawn (`benchmarks.phones.recorded`, `...phones.voices`),
but for takes of digits by those whom tests enrol, too.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.hearing.noises import steady
from benchmarks.judging import Phrases, program
from benchmarks.people_material import (
    CALLS,
    DIGITS,
    FIRST_WORDS,
    LEAD_S,
    ONE_DIGIT,
    QUIET_RMS,
    SPEECH_RMS,
    alone,
    digits,
    enrol,
    levelled,
    sentences,
)
from benchmarks.people_stage import SNR_DB, Stage
from benchmarks.phones.recorded import bare_words, half_in, lines_of_games, noises, string_of
from benchmarks.phones.rooms import Rooms
from benchmarks.phones.texts import Texts, common_words
from benchmarks.phones.voices import KOKORO_CALIBRATION, calibrators, kokoro, neural, piper
from hvcpd.errors import PhraseError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.people.fusion import Hypotheses
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.stages import Segment
from hvcpd.synthesis.voices import VOICES

Talk = Callable[[Phrases], Samples]

SHORT = tuple(
    "stop,rob stop,all stop,bot stop,team a stop,team plant stop,turn around,move forward,report,resume,who is here,"
    "what is left,hi rob,hi all,come back,turn left,turn right,rob resume,say again,bot report,hi bot".split(",")
)
SNRS_DB = (None, 30.0, 20.0, 10.0, 5.0, 0.0)
"""None: a quiet room."""
IN_ROOMS = 0.5
KEPT = ((0,), (0, 1, 2))
"""Takes of digits that are enrolled."""
HEARD = (3, 4)
"""Takes of digits that are heard."""
DIGITS_COUNT = 0.25
"""In the fit of how sure a sentence is: a digit is none."""
ENROLLED = 2
"""Of the voices, whose words are enrolled, too."""
AGAIN = 0.25
"""Weight of talk that is judged again, with a person enrolled."""
FAINT = 0.01
"""Full scale = 1: a part in which nothing is louder is none."""
MOST_LINES = 500
"""Of games."""
PARTS_S = (0.5, 3.0)
"""How long the parts of talk and sounds are that are judged beside the whole."""


@dataclass(frozen=True, eq=False)
class Case:
    """What was said, empty if nothing to the robots, and what the listeners make of it.

    `counts`: its weight in the fit, where digits should not be most of all.
    """

    kind: str
    words: tuple[str, ...]
    hypotheses: Hypotheses
    counts: float = 1.0


class Place:
    """Where it is said: rooms and noises of the part that nets are trained with, and none without recordings; and
    simulated rooms (needs pyroomacoustics)."""

    def __init__(self, data: Path | None, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        measured = Rooms(data / "rooms" if data is not None else None, self._rng)
        self._rooms = measured, Rooms(None, self._rng, boxes=True)
        n = 30 * SAMPLE_RATE_HZ
        self._noises: list[NDArray[np.floating]] = [steady("white", n, seed), steady("pink", n, seed)]
        self._noises += noises(data, "train") if data is not None else []

    def heard(self, sound: Samples) -> Segment:
        """The sound somewhere, in some noise."""
        rng = self._rng
        response = self._rooms[rng.integers(2)].draw() if rng.random() < IN_ROOMS else None
        if response is not None:
            size = 1 << (len(sound) + len(response)).bit_length()
            whole = np.fft.irfft(np.fft.rfft(sound, size) * np.fft.rfft(response, size), size)
            sound = np.asarray(whole[: len(sound) + 2000], np.float32)
        lead, tail = round(LEAD_S * SAMPLE_RATE_HZ), SAMPLE_RATE_HZ
        clean = np.pad(levelled(sound), (lead, tail))
        snr_db = SNRS_DB[rng.integers(len(SNRS_DB))]
        rms = QUIET_RMS if snr_db is None else SPEECH_RMS * 10.0 ** (-snr_db / 20.0)
        noise = self._noises[rng.integers(len(self._noises))]
        noise = np.resize(np.roll(noise, -int(rng.integers(len(noise)))), len(clean))
        noise = noise * (rms / max(float(np.sqrt(np.mean(noise.astype(np.float64) ** 2))), 1e-9))
        return Segment(np.asarray(clean + noise, np.float32), lead, lead, lead + len(sound))


def talkers(seed: int) -> dict[str, Talk]:
    """The voices kept for calibration, flite's narrow one, and the neural ones of training; others are for tests."""
    chooser = random.Random(seed)

    def flite(phrases: Phrases) -> Samples:
        stretch = f"duration_stretch={chooser.uniform(0.85, 1.2):.2f}"
        return program(("flite", "-voice", "kal", "--setf", stretch, "-t", "{text}", "-o", "{wav}"))(phrases)

    def drawn(talker: Callable[[Phrases, random.Random], Samples]) -> Talk:
        return lambda phrases: talker(phrases, chooser)

    names = ("espeak-ng en-us", "espeak-ng en-gb-x-rp", "espeak-ng en-029", "festival kal")
    kept = {name: drawn(t) for name, t in zip(names, calibrators(), strict=True)}
    kept |= {name: drawn(talker) for name, talker in kokoro().items() if name in KOKORO_CALIBRATION}
    return {**kept, "flite kal": flite, "hibari": drawn(neural()), "piper joe": drawn(piper())}


def flat(phrases: Phrases) -> tuple[str, ...]:
    """The words of phrases."""
    return tuple(word for phrase in phrases for word in phrase)


def is_sentence(stage: Stage, words: Sequence[str]) -> bool:
    """Whether they mean something to a robot."""
    try:
        stage.book.parse(words)
    except PhraseError:
        return False
    return True


def by_voices(stage: Stage, place: Place, n: int, seed: int) -> Iterator[Case]:
    """Sentences, calls and prose by synthetic voices; parts of sentences, and sentences within longer ones; the words
    of the first ENROLLED voices are enrolled, too."""
    nobody, chooser = stage.opinion(stage.book.people_graph, ()), random.Random(seed)
    texts = Texts(common_words(), seed)
    for number, (name, talk) in enumerate(talkers(seed).items()):
        spoken: list[Phrases] = [*sentences(stage.book, n, seed + number), *([c.split()] for c in FIRST_WORDS)]
        for phrases in spoken:
            yield Case("sentences", flat(phrases), nobody.hypotheses(place.heard(talk(phrases))))
        for text in SHORT:
            kind = "calls" if text.endswith("stop") else "short sentences"
            yield Case(kind, tuple(text.split()), nobody.hypotheses(place.heard(talk([text.split()]))))
        for _ in range(n):
            for kind, phrases in not_said(stage, texts, chooser):
                yield Case(kind, (), nobody.hypotheses(place.heard(talk(phrases))))
        if number < ENROLLED:
            known = enrolled_by(stage, talk)
            for phrases in [*sentences(stage.book, n // 2, seed + 50 + number), *([c.split()] for c in CALLS)]:
                segment = alone(talk(phrases), SNR_DB, "white", seed + number)
                yield Case("enrolled", flat(phrases), known.hypotheses(segment))
            for _ in range(n):
                for kind, phrases in not_said(stage, texts, chooser):
                    segment = place.heard(talk(phrases))
                    yield Case(f"{kind}, enrolled", (), known.hypotheses(segment), counts=AGAIN)
        print(f"{name} has spoken", flush=True)


def not_said(stage: Stage, texts: Texts, chooser: random.Random) -> Iterator[tuple[str, Phrases]]:
    """Of each kind one text that is no sentence."""
    prose = texts.prose().phrases
    yield "prose", prose
    yield "words", [[chooser.choice(flat(prose))]]
    sentence = chooser.choice([*([text.split()] for text in SHORT), *sentences(stage.book, 1, chooser.randrange(9999))])
    before, after = chooser.choice(flat(texts.prose().phrases)), chooser.choice(flat(prose))
    yield "within longer", [[before, *flat(sentence), after]]
    whole = list(flat(sentence))
    part = tuple(whole[: chooser.randint(1, max(len(whole) - 1, 1))])
    if not is_sentence(stage, part):
        yield "parts", [part]


def enrolled_by(stage: Stage, talk: Talk) -> SecondPassRecogniser:
    """From a recogniser that knows a voice by two takes of each word."""
    words = {w: [levelled(talk([[w]])) for _ in range(2)] for w in stage.book.people_graph.words}
    return stage.opinion(stage.book.people_graph, [enrol("Anna", words)])


def by_robots(stage: Stage, place: Place, n: int, seed: int) -> Iterator[Case]:
    """Sentences in the robots' own voices, as the robots' listener may have rejected them."""
    nobody = stage.opinion(stage.book.people_graph, ())
    for number, phrases in enumerate(sentences(stage.book, n, seed + 7)):
        speaker = stage.sound.speaker_in(VOICES[number % len(VOICES)])
        yield Case("robots", flat(phrases), nobody.hypotheses(place.heard(speaker.render(phrases))))


def by_people(stage: Stage, place: Place, data: Path, seed: int) -> Iterator[Case]:
    """Words of people kept for calibration: only "stop" is a sentence; strings of them, talk, lines of games, and
    sounds."""
    nobody, chooser = stage.opinion(stage.book.people_graph, ()), random.Random(seed)
    rng = np.random.default_rng(seed)
    words = bare_words(data, "calibration", DIGITS)
    for utterance in words:
        said = utterance.words if is_sentence(stage, utterance.words) else ()
        kind = "people's calls" if said else "people's words"
        for _ in range(4 if said else 1):
            yield Case(kind, said, nobody.hypotheses(place.heard(utterance.sound)))
    for _ in range(len(words) // 2):
        string = string_of(words, chooser)
        if not is_sentence(stage, string.words):
            yield Case("people's words in a row", (), nobody.hypotheses(place.heard(string.sound)))
    lines = [line for line in lines_of_games(data, "calibration") if not is_sentence(stage, line.words)]
    for utterance in chooser.sample(lines, min(len(lines), MOST_LINES)):
        yield Case("actors' lines", (), nobody.hypotheses(place.heard(utterance.sound)))
    for folder, kind in (("negatives", "people's talk"), ("sounds", "sounds")):
        for path in half_in(data / folder, "train"):
            sound = np.asarray(read_wav(path), np.float32)
            parts = [sound, *(_part(sound, rng) for _ in range(3))]
            for part in (each for each in parts if np.abs(each).max() > FAINT):
                yield Case(kind, (), nobody.hypotheses(place.heard(part)))


def _part(sound: Samples, rng: np.random.Generator) -> Samples:
    n = min(round(rng.uniform(*PARTS_S) * SAMPLE_RATE_HZ), len(sound) - 1)
    at = int(rng.integers(len(sound) - n))
    return sound[at : at + n]


def by_digits(stage: Stage, folder: Path) -> Iterator[Case]:
    """Some takes enrolled, others heard; and with the other speakers alone enrolled."""
    takes = digits(folder)
    speakers = sorted({who for who, _ in takes})
    enrolled = {}
    for kept in KEPT:
        people = {w: enrol(w, {DIGITS[d]: [takes[w, d][k] for k in kept] for d in range(10)}) for w in speakers}
        others = {w: stage.opinion(ONE_DIGIT, [p for o, p in people.items() if o != w]) for w in speakers}
        enrolled[kept] = stage.opinion(ONE_DIGIT, list(people.values())), others
    nobody = stage.opinion(ONE_DIGIT, ())
    for key, (who, digit) in enumerate(sorted(takes)):
        for n, (label, snr_db) in itertools.product(HEARD, (("clean", None), ("10 dB", 10.0))):
            segment = alone(takes[who, digit][n], snr_db, "pink", 100 * key + n)
            by_nobody = nobody.hypotheses(segment)
            for kept in KEPT:
                everybody, others = enrolled[kept]
                for kind, recogniser in (("enrolled", everybody), ("not enrolled", others[who])):
                    hypotheses = replace(by_nobody, by_takes=recogniser.hypotheses(segment).by_takes)
                    name = f"digits, {len(kept)} takes, {kind}, {label}"
                    yield Case(name, (DIGITS[digit],), hypotheses, DIGITS_COUNT)


def all_cases(stage: Stage, data: Path | None, n: int, seed: int) -> Sequence[Case]:
    """`n` sentences of each voice and everything else, as far as there are recordings."""
    place = Place(data, seed)
    cases = [*by_voices(stage, place, n, seed), *by_robots(stage, place, 4 * n, seed)]
    if data is not None:
        cases += by_people(stage, place, data, seed)
        cases += by_digits(stage, data / "digits")
    return [case for case in cases if case.hypotheses.sentences]
