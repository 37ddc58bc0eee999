"""Recognition of people and synthesizers that no robot knows, compared with PocketSphinx with the same grammar.

    python -m benchmarks.people [--data DIR]
        [--rows people,neural,rooms,requests,names,enrolment,talk,digits,strangers,enrolled,stop]
        [--sentences 20] [--most 200] [--takes 15] [--voices NAME,...] [--minutes 30] [--seed 1] [--wrong]
        [--names Rob,Bot,Anna] [--tasks FILE.yaml] [--cut-hz 3800]

With DIR, of speakers and recordings that nothing was trained or fitted with: `people`, "stop" by them, in noise and
over talk, their words that are no sentence, and digits, nobody enrolled; `talk`, people who order coffee, and talk
without a pause. `neural`: sentences by Kokoro's voices; `enrolment`: by them with five sentences enrolled, theirs,
those of another of them, and flite's. `rooms`: sentences by them and by flite's from across simulated rooms (needs
pyroomacoustics); `requests`: what people ask of one robot, from there, and how often it knows at least for whom it is;
`names`: the same close by, by speakers whose names it knows, does not know, or does not hear.
`digits`: single digits by people, from three takes each, those from the sixth on are heard; each once more with the
other speakers alone enrolled. `strangers`: sentences of the phrasebook by espeak-ng and flite, nobody enrolled;
`enrolled`: the same with three takes of each word, at other rates. `stop`: "stop", "Rob stop" and "all stop" by these
voices. Speech is at 20 dB SNR in white noise where nothing else is said.
Ours is told nothing but what enters a microphone; PocketSphinx is told where each sentence is. A sentence counts only
if all its words are right ("hi, I am" may be "hi all, I am", which means the same) and nothing else was made of it.
The phone net has learned from sentences with the default tasks: --names and --tasks are for others.
--cut-hz: sentences and requests come through a microphone that gives nothing above that frequency.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import people_strangers as strangers
from benchmarks.judging import Phrases
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
from benchmarks.people_rooms import names_row, requests_row, rooms_row
from benchmarks.people_stage import NAMES, SNR_DB, Stage, found, listen, say_the_same
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.ports import Samples
from hvcpd.recognition.stages import Segment

TRAINED = 3
TEST_FROM = 5
"""Takes 0 to 4 are for training, as the recordings' page has it."""


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
    events = listen(stage.recogniser(people), sound)
    ours = theirs = 0
    for s in said:
        got = found(events, s)
        peer = stage.theirs(stage.book.people_graph, sound, s)
        right = bool(got) and all(say_the_same(words, s.words) for words in got)
        ours += right
        theirs += say_the_same(tuple(peer.split()), s.words)
        if stage.wrong and not right:
            print(f"    {' '.join(s.words)} -> {[' '.join(words) for words in got]}; PocketSphinx: {peer}")
    told(label, ours, theirs, len(said))
    return ours, theirs, len(said)


def voices_row(stage: Stage, row: str, voices: Sequence[Foreigner], n: int, seed: int) -> None:
    total = np.zeros(3, int)
    phrases: Sequence[Phrases]
    for number, voice in enumerate(voices):
        if row == "stop":
            phrases = [[c.split()] for c in CALLS] * max(n // len(CALLS), 1)
        else:
            first = [[c.split()] for c in FIRST_WORDS] if row == "strangers" else []
            phrases = [*sentences(stage.book, n, seed + number), *first]
        spoken = [(tuple(w for p in ps for w in p), voice.say(ps)) for ps in phrases]
        people = []
        if row == "enrolled":
            people = [enrol("Anna", words_of(voice, stage.book.people_graph.words))]
        total += hear_voice(stage, f"{row}: {voice.name}", spoken, people, seed + number)
    if total[2]:
        told(f"{row}: all voices", int(total[0]), int(total[1]), int(total[2]))


def digit_blocks(
    takes: Mapping[tuple[str, int], list[Samples]], snr_db: float | None, most: int, seed: int
) -> Iterator[tuple[str, int, Segment]]:
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
        for who, digit, segment in digit_blocks(takes, snr_db, most, seed):
            total += 1
            known += _is(all_ears, segment, digit)
            unknown += _is(others[who], segment, digit)
            said = Said((DIGITS[digit],), segment.start, segment.end)
            theirs += stage.theirs(ONE_DIGIT, segment.sound, said) == DIGITS[digit]
        told(f"digits, {label}, three takes enrolled", known, theirs, total)
        told(f"digits, {label}, speaker not enrolled", unknown, theirs, total)


def _is(recogniser: SecondPassRecogniser, segment: Segment, digit: int) -> bool:
    sentence = recogniser.compared(segment)[0]
    return sentence is not None and sentence.words == (DIGITS[digit],)


def unseen(stage: Stage, folder: Path, seed: int, who: str, snr_db: float | None, most: int) -> strangers.Count:
    """Digits by one speaker, nobody enrolled."""
    takes = {key: sounds for key, sounds in digits(folder).items() if key[0] == who}
    recogniser, count = stage.opinion(ONE_DIGIT, ()), strangers.Count()
    for _, digit, segment in digit_blocks(takes, snr_db, most, seed):
        said = Said((DIGITS[digit],), segment.start, segment.end)
        theirs = stage.theirs(ONE_DIGIT, segment.sound, said)
        right = _is(recogniser, segment, digit)
        count.add(strangers.Count(right, not right, theirs == DIGITS[digit], theirs not in ("", DIGITS[digit]), 1))
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of recordings of people")
    parser.add_argument("--rows", default="people,neural,talk,digits,strangers,enrolled,stop")
    parser.add_argument("--sentences", type=int, default=20, help="of each voice")
    parser.add_argument("--most", type=int, default=200, help="recordings of people in a row")
    parser.add_argument("--takes", type=int, default=15, help="of each digit and speaker, at most")
    parser.add_argument("--voices", help="those of the synthesizers' voices whose names hold one of these")
    parser.add_argument("--names", default=",".join(NAMES), help="of two robots, and of who else is known")
    parser.add_argument("--tasks", type=Path, help="a task file, for other words than those that the phone net learned")
    parser.add_argument("--cut-hz", type=float, help="the microphone's highest frequency")
    parser.add_argument("--minutes", type=float, default=30.0, help="of talk, at most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wrong", action="store_true", help="print every sentence that was not right")
    o = parser.parse_args()
    stage = Stage(o.wrong, o.names.split(","), o.tasks, o.cut_hz)
    rows = o.rows.split(",")
    if o.data is not None:
        people_rows(stage, o, rows)
    if "neural" in rows:
        strangers.neural_row(stage, o.sentences, o.seed)
    if "rooms" in rows:
        rooms_row(stage, o.sentences, o.seed)
    if "requests" in rows:
        requests_row(stage, o.sentences, o.seed)
    if "names" in rows:
        names_row(stage, o.sentences, o.seed)
    if "enrolment" in rows:
        strangers.enrolment_row(stage, o.sentences, o.seed)
    if {"strangers", "enrolled", "stop"} & set(rows):
        wanted = o.voices.split(",") if o.voices else [""]
        voices = [v for v in foreigners() if any(part in v.name for part in wanted)]
        for row in ("strangers", "enrolled", "stop"):
            if row in rows:
                voices_row(stage, row, voices, o.sentences, o.seed)


def people_rows(stage: Stage, o: argparse.Namespace, rows: Sequence[str]) -> None:
    """Rows of people's recordings."""
    if "people" in rows:
        strangers.stop_rows(stage, o.data, o.most, o.seed)
        strangers.words_row(stage, o.data, o.most, o.seed)
        strangers.digits_rows(o.data, partial(unseen, stage, o.data / "digits", o.seed), o.takes)
    if "digits" in rows:
        digits_row(stage, o.data / "digits", o.takes, o.seed)
    if "talk" in rows:
        strangers.talk_rows(stage, o.data, o.minutes)
        strangers.endless_row(stage, o.data, o.seed)


if __name__ == "__main__":
    main()
