"""Recognition of names that unknown voices spell in the radio alphabet, and its cost.

Random names in all eight voices in turn, at unknown times in one stream; then ordinary sentences of a team, none of
which is to be taken for a name.

    python -m benchmarks.spelling [--names 40] [--snr 30,10,0] [--noise white]
"""

from __future__ import annotations

import argparse
import random

import numpy as np

from benchmarks.hearing.listeners import listen
from benchmarks.hearing.material import LEAD_S, Spoken, Team, make_stream, make_team
from benchmarks.hearing.mixing import add_noise
from hvcpd.assembly.make import make_spelling_recogniser
from hvcpd.language import messages as m
from hvcpd.language.spelling import WORD_OF
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import SpeechRecogniser
from hvcpd.synthesis.voices import VOICES

NAMES = ("Rob", "Bot")
GAP_S = 1.5


def spelled_stream(team: Team, n: int, seed: int) -> tuple[Samples, list[Spoken]]:
    """Names of two to seven letters and digits."""
    rng = random.Random(seed)
    signs = tuple(WORD_OF)
    pieces, spoken = [np.zeros(round(LEAD_S * SAMPLE_RATE_HZ), np.float32)], []
    at = len(pieces[0])
    gap = np.zeros(round(GAP_S * SAMPLE_RATE_HZ), np.float32)
    for number in range(n):
        letters = rng.choice(signs[:26]) + "".join(rng.choice(signs) for _ in range(rng.randint(1, 6)))
        name = m.Utterance(letters.capitalize(), m.ToAll(), None, m.Spelled(letters))
        phrases = team.book.phrases(name)
        speech = team.sound.speaker_in(VOICES[number % len(VOICES)]).render(phrases)
        spoken.append(Spoken(tuple(word for phrase in phrases for word in phrase), at, at + len(speech)))
        pieces += [speech, gap]
        at += len(speech) + len(gap)
    return np.concatenate(pieces), spoken


def hear(team: Team, stream: Samples) -> tuple[list[Recognised], float]:
    """What is heard, and the processor time as a share of real time."""
    events, spent_s = listen(SpeechRecogniser(make_spelling_recogniser(team.book, team.sound)), stream)
    return [e for _, e in events if isinstance(e, Recognised)], spent_s * SAMPLE_RATE_HZ / len(stream)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--names", type=int, default=40)
    parser.add_argument("--snr", default="30,10,0")
    parser.add_argument("--noise", default="white")
    parser.add_argument("--level", type=float, default=-35.0, help="of the speech, dBFS")
    parser.add_argument("--seed", type=int, default=1)
    o = parser.parse_args()
    team = make_team(NAMES)
    for title, (clean, spoken) in (
        ("names", spelled_stream(team, o.names, o.seed)),
        ("other sentences", make_stream(team.book, team.speakers(), o.names, o.seed)),
    ):
        for snr_db in (float(x) for x in o.snr.split(",")):
            noisy = add_noise(clean, spoken, snr_db, o.noise, o.level, o.seed)
            heard, share = hear(team, noisy)
            right = sum(any(e.words == s.words and e.start_sample < s.end for e in heard) for s in spoken)
            least = min((e.confidence for e in heard), default=0.0)
            print(
                f"{o.noise} {snr_db:4.0f} dB  {len(spoken)} {title}: {right} heard rightly, "
                f"{len(heard) - right} made up, least confidence {least:.3f}, {share:.3f} of real time",
                flush=True,
            )


if __name__ == "__main__":
    main()
