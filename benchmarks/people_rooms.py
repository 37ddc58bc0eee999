"""Strangers who speak from across a room: rows of `benchmarks.people`."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np
from scipy.signal import fftconvolve

from benchmarks.hearing.worlds.rooms import Box, Place, response
from benchmarks.judging import Phrases
from benchmarks.people_material import Foreigner, foreigners, sentences, stream
from benchmarks.people_stage import Stage, found, listen, say_the_same
from benchmarks.people_strangers import TOGETHER, Count, heard, test_voices
from benchmarks.phones.voices import Talker
from hvcpd.errors import PhraseError
from hvcpd.language import messages as m
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples
from hvcpd.recognition.events import Garbled

ROOMS: tuple[tuple[str, Box | None, float], ...] = (
    ("close to the robot", None, 0.0),
    ("RT60 0.4 s, 1.5 m", Box((5.0, 4.0, 2.6), 0.4), 1.5),
    ("RT60 0.6 s, 2.5 m", Box((8.0, 6.0, 3.0), 0.6), 2.5),
    ("RT60 0.9 s, 3 m", Box((10.0, 7.0, 3.2), 0.9), 3.0),
)
PLACES = 6
"""Of speaker and robot in each room."""


NOISES = ((20.0, "white"), (10.0, "pink"))

Spoken = Sequence[tuple[tuple[str, ...], Samples]]


def rooms_row(stage: Stage, n: int, seed: int) -> None:
    """Sentences by strangers from across a room, by Kokoro's test voices and flite's, with noise at 20 and 10 dB."""
    spoken = _spoken(lambda number: sentences(stage.book, n, seed + number), seed)
    for label, there in in_rooms(spoken, seed):
        for snr_db, colour in NOISES:
            count = heard(stage, there, snr_db, colour, seed)
            count.told(f"strangers' sentences, {label}, {colour} noise at {snr_db:.0f} dB")


def requests_row(stage: Stage, n: int, seed: int) -> None:
    """Requests to the robot that hears, and as many to the other one, from across a room: understood, or at least for
    whom they are."""
    chooser, [me, other, person] = random.Random(seed), stage.names[:3]
    mine = _spoken(lambda _: requests(stage.book, me, person, n, chooser), seed)
    others = _spoken(lambda _: requests(stage.book, other, person, n, chooser), seed)
    for (label, to_me), (_, to_other) in zip(in_rooms(mine, seed), in_rooms(others, seed), strict=True):
        for snr_db, colour in NOISES:
            print(f"requests, {label}, {colour} noise at {snr_db:.0f} dB:", flush=True)
            for whose, there in ((me, to_me), (other, to_other)):
                right, wrong, addressed = _requests_heard(stage, there, snr_db, colour, seed)
                print(f"    to {whose}: {right} of {len(there)} right, {wrong} wrong, of the rest {addressed} for {me}")


def _requests_heard(stage: Stage, there: Spoken, snr_db: float, colour: str, seed: int) -> tuple[int, int, int]:
    """How many are right, wrong, and neither, but noticed to be for the robot that hears."""
    count, addressed = Count(), 0
    for at in range(0, len(there), TOGETHER):
        sound, where = stream(there[at : at + TOGETHER], snr_db, colour, seed + at)
        events = listen(stage.recogniser(), sound)
        for one in where:
            got = found(events, one)
            right = bool(got) and all(say_the_same(each, one.words) for each in got)
            count.add(Count(right, bool(got) and not right))
            if stage.wrong and got and not right:
                print(f"    {' '.join(one.words)} -> {[' '.join(each) for each in got]}")
            near = [
                e for e in events if isinstance(e, Garbled) and e.start_sample < one.end and e.end_sample > one.start
            ]
            addressed += not got and any(each.addressed for each in near)
    return count.right, count.wrong, addressed


def requests(book: Phrasebook, name: str, person: str, n: int, chooser: random.Random) -> list[Phrases]:
    """Requests to this robot, of which half say who speaks if they can be said without that."""
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
        speaker = chooser.choice([person, None])
        with suppress(PhraseError):  # an order without a name, for example
            found.append(book.phrases(m.Utterance(speaker, m.ToRobot(name), None, statement)))
    return found


def _spoken(texts: Callable[[int], Sequence[Phrases]], seed: int) -> Spoken:
    """Sentences by each of the voices, whose number `texts` gets."""
    flite = {f.name: _in_one_manner(f) for f in foreigners() if f.name.startswith("flite")}
    voices, chooser = {**test_voices(), **flite}, random.Random(seed)
    return [
        (tuple(w for p in ps for w in p), say(ps, chooser))
        for number, say in enumerate(voices.values())
        for ps in texts(number)
    ]


def in_rooms(spoken: Spoken, seed: int) -> Iterator[tuple[str, Spoken]]:
    """The sentences, one after the other at one of PLACES places in each room."""
    for label, box, distance_m in ROOMS:
        try:
            places = [response(Place(box, distance_m, seed + k)) for k in range(PLACES)] if box else None
        except ImportError:
            print("rooms: skipped, pip install pyroomacoustics")
            return
        yield (
            label,
            [
                (words, np.asarray(fftconvolve(sound, places[k % PLACES]), np.float32) if places else sound)
                for k, (words, sound) in enumerate(spoken)
            ],
        )


def _in_one_manner(foreigner: Foreigner) -> Talker:
    return lambda phrases, _chooser: foreigner.say(phrases)
