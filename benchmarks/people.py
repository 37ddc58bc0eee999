"""How well people and other synthesizers are understood, beside PocketSphinx alone with the same grammar.

    python -m benchmarks.people [--data DIR] [--rows digits,strangers,enrolled,stop,false] [--sentences 20]
        [--takes 15] [--voices NAME,...] [--minutes 30] [--seed 1] [--wrong]

`digits`: single digits by people (DIR/digits), from three takes each, those from the sixth on are heard; each once more
with the other speakers alone enrolled. `strangers`: sentences of the phrasebook by voices that no robot has, nobody
enrolled; `enrolled`: the same with three takes of each word enrolled, at other rates. `stop`: "stop", "Rob stop" and
"all stop" by these voices. `false`: talk that addresses nobody (DIR/negatives). Speech is at 20 dB SNR in white noise.
Ours is told nothing but what enters a microphone; PocketSphinx is told where each sentence is. A sentence counts only
if all its words are right and nothing else was made of it.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.people_material import (
    CALLS,
    DIGITS,
    FIRST_WORDS,
    ONE_DIGIT,
    Foreigner,
    Said,
    alone,
    digits,
    enrol,
    foreigners,
    sentences,
    stream,
    words_of,
)
from hvcpd.assembly.make import DEFAULT_TEAMS, make_phrasebook, make_recogniser, make_sound, user_cache_folder
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.evaluation.sphinx import WIDE_BEAMS, heard, make_decoder
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.graph import WordGraph
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised, Urgent
from hvcpd.recognition.second_look import AtOnce, Piece, SecondEars

NAMES = ("Rob", "Bot", "Anna")
SNR_DB = 20.0
BLOCK = 400
PAD_S = 0.5
TRAINED = 3
TEST_FROM = 5
"""Takes 0 to 4 are for training, as the recordings' page has it."""


class Stage:
    """A team of two robots that knows Anna, and PocketSphinx with the same grammar."""

    def __init__(self, wrong: bool) -> None:
        self.wrong = wrong
        self.sound = make_sound(None, user_cache_folder())
        self.book = make_phrasebook(NAMES, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        self._peers: dict[int, Any] = {}

    def ears(self, people: Sequence[Person] = ()) -> SecondEars:
        """As a robot has them that has heard nothing."""
        opinion = self.opinion(self.book.people_graph, people)
        return SecondEars(make_recogniser(self.book, NAMES[:2], self.sound), opinion, AtOnce())

    def opinion(self, graph: WordGraph, people: Sequence[Person]) -> SecondPassRecogniser:
        """Of whoever is enrolled, and of strangers."""
        known = {person.name.lower(): person for person in people}
        return SecondPassRecogniser(graph, self.sound.lexicon, known, True)

    def peer(self, graph: WordGraph) -> Any:
        """PocketSphinx as it comes, with beams that favour it."""
        if id(graph) not in self._peers:
            with tempfile.TemporaryDirectory() as folder:
                self._peers[id(graph)] = make_decoder(graph, Path(folder), self.sound.lexicon, **WIDE_BEAMS)
        return self._peers[id(graph)]

    def theirs(self, graph: WordGraph, sound: Samples, said: Said) -> str:
        """What PocketSphinx makes of one sentence with PAD_S around it."""
        pad = round(PAD_S * SAMPLE_RATE_HZ)
        return heard(self.peer(graph), sound[max(said.start - pad, 0) : said.end + pad])


def listen(ears: SecondEars, sound: Samples) -> list[Event]:
    """All that the ears tell."""
    quiet = np.tile(sound[:SAMPLE_RATE_HZ], 3)
    sound = np.concatenate([sound, quiet])
    return [e for at in range(0, len(sound), BLOCK) for e in ears.push(sound[at : at + BLOCK])]


def found(events: Sequence[Event], said: Said) -> list[tuple[str, ...]]:
    """The sentences that were heard where one was said."""
    return [
        e.words if isinstance(e, Recognised) else ("stop",)
        for e in events
        if isinstance(e, Recognised | Urgent) and e.start_sample < said.end and e.end_sample > said.start
    ]


def told(label: str, ours: int, theirs: int, total: int) -> None:
    print(
        f"{label:44} ours {ours:4d} of {total:4d} = {ours / total:6.1%}   "
        f"PocketSphinx {theirs:4d} = {theirs / total:6.1%}",
        flush=True,
    )


def hear_voice(
    stage: Stage, label: str, spoken: Sequence[tuple[tuple[str, ...], Samples]], people: Sequence[Person], seed: int
) -> tuple[int, int, int]:
    """Sentences of one voice: right by ours, by PocketSphinx, and all."""
    sound, said = stream(spoken, SNR_DB, "white", seed)
    events = listen(stage.ears(people), sound)
    ours = theirs = 0
    for s in said:
        got = found(events, s)
        peer = stage.theirs(stage.book.people_graph, sound, s)
        stops = s.words[-1] == "stop"
        right = bool(got) and all(words[-1] == "stop" if stops else words == s.words for words in got)
        ours += right
        theirs += peer.split()[-1:] == ["stop"] if stops else peer == " ".join(s.words)
        if stage.wrong and not right:
            print(f"    {' '.join(s.words)} -> {[' '.join(words) for words in got]}; PocketSphinx: {peer}")
    told(label, ours, theirs, len(said))
    return ours, theirs, len(said)


def voices_row(stage: Stage, row: str, voices: Sequence[Foreigner], n: int, seed: int) -> None:
    total = np.zeros(3, int)
    for number, voice in enumerate(voices):
        if row == "stop":
            phrases = [[c.split()] for c in CALLS] * max(n // len(CALLS), 1)
        else:
            phrases = sentences(stage.book, n, seed + number)
            phrases += [[c.split()] for c in FIRST_WORDS] if row == "strangers" else []
        spoken = [(tuple(w for p in ps for w in p), voice.say(ps)) for ps in phrases]
        people = []
        if row == "enrolled":
            people = [enrol("Anna", words_of(voice, stage.book.people_graph.words))]
        total += hear_voice(stage, f"{row}: {voice.name}", spoken, people, seed + number)
    if total[2]:
        told(f"{row}: all voices", int(total[0]), int(total[1]), int(total[2]))


def digit_pieces(
    takes: Mapping[tuple[str, int], list[Samples]], snr_db: float | None, most: int, seed: int
) -> Iterator[tuple[str, int, Piece]]:
    """Each take that is heard, alone in noise."""
    for key, (who, digit) in enumerate(sorted(takes)):
        for number, take in enumerate(takes[who, digit][TEST_FROM : TEST_FROM + most]):
            yield who, digit, alone(take, snr_db, "pink", seed + 100 * key + number)


def digits_row(stage: Stage, folder: Path, most: int, seed: int) -> None:
    takes = digits(folder)
    if not takes:
        print(f"digits: skipped, there are no recordings in {folder}")
        return
    speakers = sorted({who for who, _ in takes})
    people = [
        enrol(who, {DIGITS[d]: takes[who, d][:TRAINED] for d in range(len(DIGITS)) if (who, d) in takes})
        for who in speakers
    ]
    all_ears = stage.opinion(ONE_DIGIT, people)
    others = {p.name: stage.opinion(ONE_DIGIT, [o for o in people if o is not p]) for p in people}
    for label, snr_db in (("clean", None), ("pink 10 dB", 10.0)):
        known = unknown = theirs = total = 0
        for who, digit, piece in digit_pieces(takes, snr_db, most, seed):
            total += 1
            known += _is(all_ears, piece, digit)
            unknown += _is(others[who], piece, digit)
            said = Said((DIGITS[digit],), piece.start, piece.end)
            theirs += stage.theirs(ONE_DIGIT, piece.sound, said) == DIGITS[digit]
        told(f"digits, {label}, three takes enrolled", known, theirs, total)
        told(f"digits, {label}, speaker not enrolled", unknown, theirs, total)


def _is(ears: SecondPassRecogniser, piece: Piece, digit: int) -> bool:
    sentence = ears.likeliest(piece)
    return sentence is not None and sentence.words == (DIGITS[digit],)


def false_row(stage: Stage, folder: Path, minutes: float) -> None:
    """Commands and stops made of talk that addresses nobody."""
    ears, n, stops, commands, peer = stage.ears(), 0, 0, [], 0
    for path in sorted(folder.rglob("*.wav")):
        talk = np.asarray(read_wav(path), np.float32)
        for at in range(0, len(talk), BLOCK):
            for event in ears.push(talk[at : at + BLOCK]):
                is_stop = isinstance(event, Urgent) or (isinstance(event, Recognised) and "stop" in event.words)
                stops += is_stop
                if isinstance(event, Recognised):
                    commands.append(f"{' '.join(event.words)} ({event.confidence:.2f}, {event.voice})")
        peer += "stop" in stage.theirs(stage.book.people_graph, talk, Said((), 0, len(talk))).split()
        n += len(talk)
        if n > minutes * 60 * SAMPLE_RATE_HZ:
            break
    hours = n / SAMPLE_RATE_HZ / 3600.0
    if not n:
        print(f"false: skipped, there are no recordings in {folder}")
        return
    print(
        f"false: in {60 * hours:.1f} min of talk {stops} stops ({stops / hours:.1f} an hour), "
        f"{len(commands)} sentences made up; "
        f"PocketSphinx alone {peer} stops ({peer / hours:.0f} an hour)"
    )
    for command in commands:
        print("   ", command)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder with digits/ and negatives/")
    parser.add_argument("--rows", default="digits,strangers,enrolled,stop,false")
    parser.add_argument("--sentences", type=int, default=20, help="of each voice")
    parser.add_argument("--takes", type=int, default=15, help="of each digit and speaker, at most")
    parser.add_argument("--voices", help="those of the synthesizers' voices whose names hold one of these")
    parser.add_argument("--minutes", type=float, default=30.0, help="of talk, at most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wrong", action="store_true", help="print every sentence that was not right")
    o = parser.parse_args()
    stage = Stage(o.wrong)
    rows = o.rows.split(",")
    if o.data is not None and "digits" in rows:
        digits_row(stage, o.data / "digits", o.takes, o.seed)
    if {"strangers", "enrolled", "stop"} & set(rows):
        wanted = o.voices.split(",") if o.voices else [""]
        voices = [v for v in foreigners() if any(part in v.name for part in wanted)]
        for row in ("strangers", "enrolled", "stop"):
            if row in rows:
                voices_row(stage, row, voices, o.sentences, o.seed)
    if o.data is not None and "false" in rows:
        false_row(stage, o.data / "negatives", o.minutes)


if __name__ == "__main__":
    main()
