"""Sealed speech: forgeries accepted, true sentences refused, and the cost in time.

    python -m benchmarks.security words|audio|honest|airtime|guess [--encrypted] [--n N] [--seed SEED]

words    attacks at the level of words, by kind: tried and believed
audio    the same with sound, against a whole robot
honest   sealed sentences of all kinds, each robot in its own voice, in noise at 0 dB: how many are heard with a seal
         that fits, at the first saying
airtime  how much longer a sealed, or encrypted, sentence takes than the plain one at the usual rate, s
guess    seals of fewer bits: guesses believed, beside the chance computed

With --encrypted the honest robots hide what they say, and the attacks are on their messages.
"""

from __future__ import annotations

import argparse
import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.hearing.material import BLOCK, GAP_S, LEAD_S, Spoken
from benchmarks.hearing.mixing import add_noise
from hil_fakes.audio_attacks import AudioAttacks
from hil_fakes.word_attacks import WordAttacks
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language import messages as m
from hvcpd.language.marks import is_sealed
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.robot.sealing import Sealing
from hvcpd.robot.speech_output import spoken
from hvcpd.security.guard import NEAR, Guard
from hvcpd.security.keys import KEY_BYTES, KeyRing, TeamKey
from hvcpd.security.seal import Sentence
from hvcpd.security.silence import Patience
from hvcpd.synthesis.leveling import audible

NAMES = ("Mia", "Ted", "Gus", "Rex")
SPEECH_DBFS = -35.0
CALM = Patience(free=float("inf"))


def show(tried: Mapping[str, int], believed: Mapping[str, int]) -> None:
    for kind, n in tried.items():
        print(f"{kind:45} {n:6} tried {believed.get(kind, 0):4} believed")
    print(f"{'all':45} {sum(tried.values()):6} tried {sum(believed.values()):4} believed")


def words(n: int, seed: int, _sound: Sound, encrypts: bool) -> None:
    attacks = WordAttacks(seed, load_tasks(default_tasks_path()).tasks, encrypts=encrypts)
    tally = attacks.run(n)
    show(tally.tried, tally.believed)
    print(f"honest sentences: {tally.honest_believed} of {tally.honest} believed")


def audio(n: int, seed: int, sound: Sound, encrypts: bool) -> None:
    attacks = AudioAttacks(seed, sound, encrypts)
    attacks.run(n)
    show(attacks.tried, attacks.believed)
    print("honest orders, said again when asked: {} of {} believed".format(*attacks.honest))


def book_of_team(encrypts: bool) -> Phrasebook:
    return make_phrasebook(NAMES, DEFAULT_TEAMS, load_tasks(default_tasks_path()), True, encrypts)


def sealed_sentences(book: Phrasebook, n: int, seed: int, encrypts: bool) -> list[m.Utterance]:
    """Random ones of those that have a seal, sealed or encrypted by their speakers."""
    rng = random.Random(seed)
    ring = KeyRing(TeamKey(bytes(KEY_BYTES)))
    sealings = {name: Sealing(Guard(name, ring), encrypts) for name in NAMES}
    found: list[m.Utterance] = []
    while len(found) < n:
        drawn = book.sample(rng)
        if is_sealed(drawn.statement) and drawn.speaker is not None:
            found.append(sealings[drawn.speaker].marked(replace(drawn, mark=None), book, 0.0))
    return found


def honest(n: int, seed: int, sound: Sound, encrypts: bool) -> None:
    book = book_of_team(encrypts)
    rng = random.Random(seed)
    for colour in ("white", "pink"):
        utterances = sealed_sentences(book, n, seed, encrypts)
        pieces = [np.zeros(round(LEAD_S * SAMPLE_RATE_HZ), np.float32)]
        at, places = len(pieces[0]), []
        for utterance in utterances:
            said = spoken(sound.speaker_of(utterance.speaker or ""), utterance, book)
            places.append(Spoken(book.render(utterance), at, at + audible(said)[1]))
            pieces += [said, np.zeros(round(rng.uniform(*GAP_S) * SAMPLE_RATE_HZ), np.float32)]
            at += len(pieces[-2]) + len(pieces[-1])
        heard = add_noise(np.concatenate(pieces), places, 0.0, colour, SPEECH_DBFS, seed)
        print(f"{colour} noise, 0 dB: {_accepted(book, heard, sound)} of {n} accepted")


def _accepted(book: Phrasebook, heard: Samples, sound: Sound) -> int:
    """How many sentences come with a seal that fits, as a robot judges them that is none of the four."""
    sealing = Sealing(Guard("Bot", KeyRing(TeamKey(bytes(KEY_BYTES))), patience=CALM))
    recogniser = make_speech_recogniser(book, NAMES, sound)
    n = 0
    events = [event for start in range(0, len(heard), BLOCK) for event in recogniser.push(heard[start : start + BLOCK])]
    for event in [*events, *recogniser.flush()]:
        if isinstance(event, Recognised):
            _, verdict = sealing.judge(book.parse(event.words), book, event.end_sample / SAMPLE_RATE_HZ)
            n += verdict.trust.proves_speaker
    return n


def airtime(n: int, seed: int, sound: Sound, encrypts: bool) -> None:
    book = book_of_team(encrypts)
    longer, whole = [], []
    for utterance in sealed_sentences(book, n, seed, encrypts):
        speaker = sound.speaker_of(utterance.speaker or "")
        marked, plain = (audible(spoken(speaker, u, book))[1] for u in (utterance, replace(utterance, mark=None)))
        longer.append((marked - plain) / SAMPLE_RATE_HZ)
        whole.append(marked / SAMPLE_RATE_HZ)
    print(
        f"{'encryption' if encrypts else 'a seal'} takes {np.mean(longer):.2f} s on average of {n} sentences, "
        f"{np.quantile(longer, 0.95):.2f} s in 95 %, {max(longer):.2f} s at most; the sentence then takes "
        f"{np.mean(whole):.2f} s on average"
    )


def guess(n: int, seed: int, _sound: Sound, _encrypts: bool) -> None:
    rng = random.Random(seed)
    sentence = Sentence("Rob", "Bot", ("hi", "bot"))
    for bits in (6, 8):
        hits: Counter[bool] = Counter()
        for _ in range(n):
            ring = KeyRing(TeamKey(rng.randbytes(KEY_BYTES)))  # the seals that fit one sentence are always the same
            bot = Guard("Bot", ring, bits=bits, patience=CALM)
            hits[bot.judge(sentence, rng.getrandbits(bits), None, 0.0).trust.proves_speaker] += 1
        computed = 1.0 - (1.0 - 2.0**-bits) ** NEAR
        print(f"{bits} bits: {hits[True]} of {n} guesses believed, {hits[True] / n:.3%}; computed {computed:.3%}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    modes = {"words": words, "audio": audio, "honest": honest, "airtime": airtime, "guess": guess}
    usual = {"words": 10_000, "audio": 200, "honest": 100, "airtime": 300, "guess": 3000}
    parser.add_argument("mode", choices=modes)
    parser.add_argument("--n", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--encrypted", action="store_true")
    options = parser.parse_args()
    sound = make_sound(None, user_cache_folder())
    modes[options.mode](options.n or usual[options.mode], options.seed, sound, options.encrypted)


if __name__ == "__main__":
    main()
