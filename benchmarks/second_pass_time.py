"""Times the second look, with nobody enrolled and with up to four people.

    python -m benchmarks.second_pass_time [--people 0,1,4] [--sentences 8] [--seed 1]

Each person is one of our own synthesizer's voices with three takes of every word of the phrasebook, at other rates; all
say sentences of the phrasebook, alone at 20 dB SNR in white noise. Prints the median and the longest time of a look on
one core that does nothing else, for the enrolled alone and for strangers too, and how long the speech is. A look that
takes longer than `hvcpd.recognition.stream.MAX_WAIT` is given up.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

from benchmarks.people_material import alone, enrol, levelled, sentences
from benchmarks.people_stage import SNR_DB, Stage
from hvcpd.people.enrolled import Person
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.frontend import Energies
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.stream import MAX_WAIT
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

NAMES = ("Anna", "Berta", "Cora", "Dora")
RATES = (0.87, 1.0, 1.15)


def person(name: str, speaker: Speaker, words: Sequence[str]) -> Person:
    """A person who has said all words, slowly, normally and fast."""
    once = enrol(name, {word: [levelled(speaker.render([[word]]))] for word in words})
    return Person(
        name, {w: [stretched(take, rate) for take in takes for rate in RATES] for w, takes in once.takes.items()}
    )


def stretched(energies: Energies, factor: float) -> Energies:
    """A take with its number of frames multiplied."""
    frames = np.linspace(0, len(energies) - 1, round(len(energies) * factor)).round().astype(int)
    return np.asarray(energies[frames], np.float32)


def told(label: str, opinion: SecondPassRecogniser, segments: Sequence[Segment]) -> None:
    opinion.search(segments[0])  # loads what it needs
    took = []
    for each in segments:
        begin = time.thread_time()
        opinion.search(each)
        took.append(time.thread_time() - begin)
    print(f"{label:40} median {np.median(took):5.2f} s, longest {max(took):5.2f} s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", default="0,1,4", help="numbers of people enrolled, up to four")
    parser.add_argument("--sentences", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    o = parser.parse_args()
    stage = Stage(False)
    speakers = [stage.sound.speaker_in(voice) for voice in VOICES[: len(NAMES)]]
    spoken = sentences(stage.book, o.sentences, o.seed)
    sounds = [speakers[n % len(speakers)].render(phrases) for n, phrases in enumerate(spoken)]
    segments = [alone(sound, SNR_DB, "white", o.seed + n) for n, sound in enumerate(sounds)]
    lengths = [(each.end - each.start) / SAMPLE_RATE_HZ for each in segments]
    print(
        f"{len(segments)} sentences of {min(lengths):.1f} to {max(lengths):.1f} s; "
        f"given up after {MAX_WAIT / SAMPLE_RATE_HZ:.0f} s"
    )
    graph = stage.book.people_graph
    everybody = [person(name, speaker, graph.words) for name, speaker in zip(NAMES, speakers, strict=True)]
    for number in map(int, o.people.split(",")):
        known = {each.name.lower(): each for each in everybody[:number]}
        for strangers in (False, True):
            if known or strangers:
                label = f"{number} enrolled{', and strangers' if strangers else ''}"
                told(label, SecondPassRecogniser(graph, stage.sound.lexicon, known, strangers), segments)


if __name__ == "__main__":
    main()
