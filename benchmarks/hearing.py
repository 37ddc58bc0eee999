"""How well robots hear robots: whole sentences right, missed, wrong and made up, by noise and level.

Random sentences of the phrasebook, each in its speaker's voice, at unknown times in one stream of sound; the
recogniser is told nothing but the names. With --peer PocketSphinx hears the same stream with the same grammar, cut into
sentences by an oracle, which ours does not get.

    python -m benchmarks.hearing [--sentences 20] [--names Rob,Bot] [--snr 30,10,0] [--noise white,pink] [--level DBFS]
        [--peer] [--wrong]
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.judging import heard, judge
from hil_fakes.room import PinkNoise
from hvcpd.assembly import DEFAULT_TEAMS, make_phrasebook, make_recogniser, make_sound, user_cache_folder
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Recognised
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import voice_for

GAP_S = (1.2, 2.5)
"""Silence between two sentences, shortest and longest."""
LEAD_S = 2.0
"""Noise before the first sentence."""
BLOCK = 400
"""Samples pushed at once, as on the bench."""


@dataclass(frozen=True)
class Spoken:
    """A sentence in the stream: samples `start` up to `end`."""

    words: tuple[str, ...]
    start: int
    end: int


@dataclass
class Score:
    """Counts of one stream; `wrong` are sentences reported in place of another, `made_up` where there was none."""

    sentences: int = 0
    right: int = 0
    wrong: int = 0
    made_up: int = 0
    garbled: int = 0
    delays_s: list[float] = field(default_factory=list)
    confidences: list[float] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def make_stream(book: Phrasebook, speakers: dict[str, Speaker], n: int, seed: int) -> tuple[Samples, list[Spoken]]:
    """A stream of `n` random sentences without noise, at about -20 dBFS, and what is where in it."""
    chooser = random.Random(seed)
    pieces: list[Samples] = [np.zeros(round(LEAD_S * SAMPLE_RATE_HZ), np.float32)]
    at = len(pieces[0])
    spoken = []
    names = list(speakers)
    for _ in range(n):
        utterance = book.sample(chooser)
        phrases = book.phrases(utterance)
        voice = utterance.speaker or chooser.choice(names)
        sound = speakers[voice].render(phrases)
        spoken.append(Spoken(tuple(w for phrase in phrases for w in phrase), at, at + len(sound)))
        gap = np.zeros(round(chooser.uniform(*GAP_S) * SAMPLE_RATE_HZ), np.float32)
        pieces += [sound, gap]
        at += len(sound) + len(gap)
    return np.concatenate(pieces), spoken


def add_noise(
    sound: Samples, spoken: Sequence[Spoken], snr_db: float, colour: str, level_dbfs: float, seed: int
) -> Samples:
    """The stream with its speech at `level_dbfs` RMS, in noise `snr_db` below it (both over 0 to 8 kHz), as 16 bits."""
    active = np.concatenate([sound[s.start : s.end] for s in spoken])
    gain = 10.0 ** (level_dbfs / 20.0) / float(np.sqrt(np.mean(active**2)))
    rms = 10.0 ** ((level_dbfs - snr_db) / 20.0)
    noise = (
        PinkNoise(rms, seed).take(len(sound))
        if colour == "pink"
        else rms * np.random.default_rng(seed).standard_normal(len(sound))
    )
    mixed = np.clip(sound * gain + noise, -1.0, 1.0)
    return np.asarray(np.round(mixed * 32767.0) / 32767.0, np.float32)


def judge_events(events: Iterable[tuple[int, Event]], spoken: Sequence[Spoken]) -> Score:
    """Compare what was reported (with the sample at which it was) to what was said."""
    score = Score(sentences=len(spoken))
    found: dict[int, list[str]] = {}
    for at, event in events:
        overlapping = (i for i, s in enumerate(spoken) if event.start_sample < s.end and event.end_sample > s.start)
        index = next(overlapping, None)
        if not isinstance(event, Recognised):
            score.garbled += 1
            if index is not None:
                found.setdefault(index, []).append("(garbled)")
            continue
        if index is None:
            score.made_up += 1
            score.notes.append(f"made up at {event.start_sample / SAMPLE_RATE_HZ:.1f} s: {' '.join(event.words)}")
        elif event.words == spoken[index].words:
            score.right += 1
            score.delays_s.append((at - spoken[index].end) / SAMPLE_RATE_HZ)
            score.confidences.append(event.confidence)
        else:
            score.wrong += 1
            found.setdefault(index, []).append(" ".join(event.words))
    for index, s in enumerate(spoken):
        if index in found:
            score.notes.append(f"{' '.join(s.words)}\n        -> {found[index]}")
    return score


def listen(book: Phrasebook, names: Sequence[str], sound: Samples) -> tuple[list[tuple[int, Event]], float]:
    """What the recogniser reports, each with the sample at which it does; and the processor time, s."""
    recogniser = make_recogniser(book, names, make_sound(None, user_cache_folder()))
    began = time.process_time()
    events = []
    for start in range(0, len(sound), BLOCK):
        events += [(start + BLOCK, event) for event in recogniser.push(sound[start : start + BLOCK])]
    events += [(len(sound), event) for event in recogniser.flush()]
    return events, time.process_time() - began


def peer(book: Phrasebook, sound: Samples, spoken: Sequence[Spoken]) -> int:
    """Sentences that PocketSphinx gets right, told where each one is."""
    lexicon = make_sound().lexicon
    pad = SAMPLE_RATE_HZ // 2
    with tempfile.TemporaryDirectory() as folder:
        decoder = judge(book.graph, Path(folder), lexicon)
    return sum(heard(decoder, sound[max(s.start - pad, 0) : s.end + pad]) == " ".join(s.words) for s in spoken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=20)
    parser.add_argument("--names", default="Rob,Bot")
    parser.add_argument("--snr", default="40,20,10,5,0,-5")
    parser.add_argument("--noise", default="white,pink")
    parser.add_argument("--level", type=float, default=-35.0, help="of the speech, dBFS")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--peer", action="store_true")
    parser.add_argument("--wrong", action="store_true")
    o = parser.parse_args()
    names = o.names.split(",")
    book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
    sound_of = make_sound(None, user_cache_folder())
    speakers = {name: Speaker(voice_for(name), sound_of.lexicon, sound_of.cache) for name in names}
    clean, spoken = make_stream(book, speakers, o.sentences, o.seed)
    print(
        f"{o.sentences} sentences, {len(clean) / SAMPLE_RATE_HZ:.0f} s, names {o.names}, speech at {o.level:.0f} dBFS"
    )
    heading = "noise   SNR    right  wrong made-up garbled   delay  confidence (least, mean)     rtf"
    print(heading + ("  peer" if o.peer else ""))
    for colour in o.noise.split(","):
        for snr in (float(x) for x in o.snr.split(",")):
            noisy = add_noise(clean, spoken, snr, colour, o.level, o.seed)
            events, spent_s = listen(book, names, noisy)
            score = judge_events(events, spoken)
            line = row(colour, snr, score, spent_s * SAMPLE_RATE_HZ / len(clean))
            print(line + (f"  {peer(book, noisy, spoken):4d}" if o.peer else ""), flush=True)
            if o.wrong:
                print("\n".join("    " + note for note in score.notes))


def row(colour: str, snr_db: float, s: Score, realtime_factor: float) -> str:
    """One line of the table."""
    delay_s, sure = (float(np.mean(values or [0.0])) for values in (s.delays_s, s.confidences))
    return (
        f"{colour:6} {snr_db:4.0f} {s.right:4d}/{s.sentences:<4d}{s.wrong:5d} {s.made_up:7d} {s.garbled:7d}"
        f"  {delay_s:4.2f} s  {min(s.confidences or [0.0]):14.2f} {sure:9.2f} {realtime_factor:7.3f}"
    )


if __name__ == "__main__":
    main()
