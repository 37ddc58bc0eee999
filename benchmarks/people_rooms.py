"""Strangers who speak from across a room: rows of `benchmarks.people`."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial

import numpy as np
from scipy.signal import fftconvolve

from benchmarks.hearing.worlds.rooms import Box, Place, response
from benchmarks.judging import Phrases
from benchmarks.people_material import Foreigner, foreigners, sentences
from benchmarks.people_stage import Stage
from benchmarks.people_strangers import heard, test_voices
from benchmarks.phones.voices import Talker
from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.addressees import FRIEND
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples

ROOMS: tuple[tuple[str, Box | None, float], ...] = (
    ("close to the robot", None, 0.0),
    ("RT60 0.4 s, 1.5 m", Box((5.0, 4.0, 2.6), 0.4), 1.5),
    ("RT60 0.6 s, 2.5 m", Box((8.0, 6.0, 3.0), 0.6), 2.5),
    ("RT60 0.9 s, 3 m", Box((10.0, 7.0, 3.2), 0.9), 3.0),
)
PLACES = 6
"""Of speaker and robot in each room."""
NOISES = ((20.0, "white"), (10.0, "pink"))

UNKNOWN = tuple(
    """sarah peter maria kevin julia david emma lucas laura hannah oscar clara felix mia leo alice george priya yuki
    olga""".split()
)
"""Names that no robot of these rows knows."""

Spoken = Sequence[tuple[tuple[str, ...], Samples]]


def rooms_row(stage: Stage, n: int, seed: int) -> None:
    """Sentences by strangers from across a room, by Kokoro's test voices and flite's, with noise at 20 and 10 dB."""
    spoken = _spoken(lambda number: sentences(stage.book, n, seed + number), seed)
    for label, played in rooms(seed):
        there = played(spoken)
        for snr_db, colour in NOISES:
            count = heard(stage, there, snr_db, colour, seed)
            count.told(f"strangers' sentences, {label}, {colour} noise at {snr_db:.0f} dB")


def requests_row(stage: Stage, n: int, seed: int) -> None:
    """Requests to the robot that hears, and as many to the other one, from across a room: understood, or at least for
    whom they are."""
    chooser, [me, other, person] = random.Random(seed), stage.names[:3]
    mine = _spoken(lambda _: requests(stage.book, me, person, n, chooser), seed)
    others = _spoken(lambda _: requests(stage.book, other, person, n, chooser), seed)
    for label, played in rooms(seed):
        to_each = {me: played(mine), other: played(others)}
        for snr_db, colour in NOISES:
            for whose, there in to_each.items():
                count = heard(stage, there, snr_db, colour, seed)
                count.told(f"requests to {whose}, {label}, {colour} noise at {snr_db:.0f} dB")
                print(f"    of the rest {count.addressed} were noticed to be for {me}", flush=True)


def names_row(stage: Stage, n: int, seed: int) -> None:
    """Orders and answers by the same voices, close to the robot, which give a name that it knows, one that it does not
    know, or none."""
    chooser, [me, _, person] = random.Random(seed), stage.names[:3]
    kinds: dict[str, tuple[str | None, tuple[str, ...]]] = {
        "a name that it knows": (person, (person.lower(),)),
        "a name that it does not know": (FRIEND, UNKNOWN),
        "no name": (None, ()),
    }
    for label, (speaker, names) in kinds.items():
        texts = partial(_requests_by, stage.book, me, speaker, names, n, chooser)
        said = _spoken(texts, seed)
        meant = [(tuple(FRIEND if word in UNKNOWN else word for word in words), sound) for words, sound in said]
        for snr_db, colour in NOISES:
            count = heard(stage, meant, snr_db, colour, seed)
            count.told(f"requests with {label}, {colour} noise at {snr_db:.0f} dB")


def _requests_by(
    book: Phrasebook,
    name: str,
    speaker: str | None,
    names: Sequence[str],
    n: int,
    chooser: random.Random,
    _voice: int,
) -> list[Phrases]:
    texts = requests(book, name, speaker, n, chooser, named=True)
    return [_by(phrases, chooser, names) for phrases in texts]


def _by(phrases: Phrases, chooser: random.Random, names: Sequence[str]) -> Phrases:
    """The same by a speaker with one of these names, if there are any."""
    words = [list(part) for part in phrases]
    for part in words:
        if names and "am" in part[:-1]:
            part[part.index("am") + 1] = chooser.choice(names)
    return words


def requests(
    book: Phrasebook, name: str, person: str | None, n: int, chooser: random.Random, named: bool = False
) -> list[Phrases]:
    """Requests to this robot, of which half say who speaks, or all that are `named`."""
    orders: list[m.Statement] = [
        *(m.Order(m.TaskByName(task)) for task in book.vocabulary.tasks),
        m.Order(m.TaskByNumber(3)),
    ]
    motions: list[m.Statement] = [
        m.ComeBack(),
        m.MoveBy(1.0, back=False),
        m.MoveBy(0.5, back=True),
        m.TurnBy(90.0),
        m.TurnBy(180.0),
    ]
    others: list[m.Statement] = [
        m.WhatDoing(),
        m.WhatLeft(),
        m.ReportWanted(),
        m.Confirmed(),
        m.Negative(),
        m.SayAgain(),
    ]
    found: list[Phrases] = []
    while len(found) < n:
        statement = chooser.choice(chooser.choice([orders, motions, others]))
        speaker = person if named else chooser.choice([person, None])
        if speaker is None and not named and isinstance(statement, m.Order | m.Confirmed | m.Negative):
            continue  # the row's sentences are those of when they needed a name
        with suppress(PhraseError):  # "say again" without a name, for example
            found.append(book.phrases(m.Utterance(speaker, m.ToRobot(name), None, statement)))
    return found


def _spoken(texts: Callable[[int], Sequence[Phrases]], seed: int) -> Spoken:
    """Sentences by each of the voices, whose number `texts` gets."""
    return spoken_by({**test_voices(), **flite_voices()}, texts, seed)


def flite_voices() -> dict[str, Talker]:
    """Those of flite's that are installed, at their usual pace."""
    return {f.name: _in_one_manner(f) for f in foreigners() if f.name.startswith("flite")}


def spoken_by(voices: Mapping[str, Talker], texts: Callable[[int], Sequence[Phrases]], seed: int) -> Spoken:
    """Sentences by each of these voices, whose number `texts` gets."""
    chooser = random.Random(seed)
    return [
        (tuple(w for p in ps for w in p), say(ps, chooser))
        for number, say in enumerate(voices.values())
        for ps in texts(number)
    ]


def rooms(seed: int) -> Iterator[tuple[str, Callable[[Spoken], Spoken]]]:
    """Each room's name, and sentences as they sound in it, one after the other from one of PLACES places."""
    for label, box, distance_m in ROOMS:
        try:
            places = [response(Place(box, distance_m, seed + k)) for k in range(PLACES)] if box else None
        except ImportError:
            print("rooms: skipped, pip install pyroomacoustics")
            return
        yield label, partial(_from, places)


def _from(places: Sequence[Samples] | None, spoken: Spoken) -> Spoken:
    """The sentences from these places in turn; None: close to the robot."""
    if places is None:
        return spoken
    return [
        (words, np.asarray(fftconvolve(sound, places[k % len(places)]), np.float32))
        for k, (words, sound) in enumerate(spoken)
    ]


def _in_one_manner(foreigner: Foreigner) -> Talker:
    return lambda phrases, _chooser: foreigner.say(phrases)
