"""Checks of recordings that enrol a person: of one word each, its place, usability, and distance from others; and of
a sentence whose words are known."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hvcpd.assembly.separation import References
from hvcpd.language.graph import graph_of
from hvcpd.memory.people import MAX_FRAMES, MAX_SENTENCE_FRAMES
from hvcpd.people.enrolled import SpokenSentence, Takes, level_normalised
from hvcpd.people.phones import CtcSearch, Pronounce, far_net, net_inputs
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.frontend import (
    CONTEXT_FRAMES,
    ENERGY_FLOOR,
    HOP_SAMPLES,
    WINDOW_SAMPLES,
    Energies,
    Features,
    decibels,
    energies_of,
    features_of,
    power_ratio,
    smoothed,
)
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.templates import MASK_DB

FULL_SCALE = 0.985
"""Share of full scale from which a sample counts as clipped."""
MOST_CLIPPED = 0.002
"""Largest share of the word's samples at full scale: a few peaks do no harm, flat vowels do."""
LEAST_SNR_DB = 15.0
"""A word's loud frames over the noise around it: below, faint consonants are lost for good."""
EDGE_S = 0.1
"""Ends of a recording in which nobody speaks yet."""
EDGE_DB = 12.0
"""Level below the word's loudest frame at which an end is noise; otherwise the recording was cut at the word."""
BEGIN_DB = 6.0
"""Level above the noise at which the word begins and ends."""
RANGE_DB = 35.0
"""Largest range below the loudest frame within which the word begins and ends."""
LONGEST_GAP_S = 0.2
"""Longest closure within a word, as before a T; a longer gap separates two words."""
SHORTEST_S, LONGEST_S = 0.1, 1.6
INCONSISTENT = 3.2
"""Mean distance a frame of two takes of one word. Of people's digits (takes 0 to 4, four speakers) 95 % of the pairs of
one word and speaker are nearer; of different words of a speaker 10 %."""
CONFUSABLE = 0.9
"""Two words of a person are confusable if takes of them are nearer than this much of how far takes of one word are."""
APART = 4.5
"""First takes of two words that are so far apart leave no doubt: the others are not compared."""
MOST_LOSS = 1.9
"""Of the phone net for each phone of the words, nepers. In four of Kokoro's voices at 20 dB, 108 of 108 sentences lost
less; of 216 taken for another sentence, none did."""

OTHER_NAME = 5.0
"""Nepers a sentence by which another name fits better than the speaker's, so that it is told. Of four names in three of
our voices, and five others, the name that was said fits better than any other by 10.6 or more. Of 64
sentences in four voices of flite and Kokoro each, at 20 dB, 3 fit one of 171 other names better by more than this (7.0
to 16.8); a team has few names."""


@dataclass(frozen=True)
class Speech:
    """What was said in a recording: its frames' energies, shape (frames, N_BANDS), from `begin` to before `end`."""

    energies: Energies
    noise: Energies
    begin: int
    end: int
    gap: int
    """The longest pause in it, frames."""
    snr_db: float
    clipped: float
    """Share of its samples."""

    @property
    def fault(self) -> str:
        """Why nothing can be learned from it, whatever was said; empty if it is good enough."""
        if self.clipped > MOST_CLIPPED:
            return "it is too loud for the microphone: step back, or turn the gain down (hvcpctl calibrate)"
        if self.snr_db < LEAST_SNR_DB:
            told = f"speech is {math.floor(self.snr_db)} dB above the noise, not {LEAST_SNR_DB:.0f}"
            return f"the room is too loud, or you too far away: {told}"
        return ""


def speech_in(sound: Samples) -> Speech | None:
    """What was said in a recording, shape (n,), 16 kHz; None if nothing was."""
    sound = np.asarray(sound, np.float32)
    if len(sound) < SHORTEST_S * SAMPLE_RATE_HZ or np.abs(sound).max() < 1e-4:
        return None
    pad = (WINDOW_SAMPLES - HOP_SAMPLES) // 2
    energies = energies_of(np.pad(sound - sound.mean(), (pad, pad + HOP_SAMPLES)))
    power = energies.sum(axis=1)
    noise = _noise(energies, power)
    begin, end, gap = _span(power, float(noise.sum()))
    loud = np.sort(power[begin:end])[-max((end - begin) // 4, 1) :].mean()
    snr_db = decibels(float(loud) / float(noise.sum()))
    clipped = np.mean(np.abs(sound[begin * HOP_SAMPLES : end * HOP_SAMPLES]) >= FULL_SCALE)
    return Speech(energies, noise, begin, end, gap, snr_db, float(clipped))


NOTHING = "nothing is to be heard; is the microphone on?"


def check_take(sound: Samples) -> tuple[Energies | None, str]:
    """The one word in a recording, shape (n,), 16 kHz, without the noise; or what is wrong with it."""
    speech = speech_in(sound)
    if speech is None:
        return None, NOTHING
    if fault := speech.fault or _fault_of_word(speech.end - speech.begin, speech.gap):
        return None, fault
    word = np.maximum(speech.energies[speech.begin : speech.end] - speech.noise, ENERGY_FLOOR)
    return smoothed(np.pad(word, ((1, 1), (0, 0)), mode="edge")), ""


def check_sentence(sound: Samples, words: tuple[str, ...], pronounce: Pronounce) -> tuple[SpokenSentence | None, str]:
    """The sentence in a recording, shape (n,), 16 kHz, of a person who was asked to say these words; or what is wrong
    with it."""
    speech = speech_in(sound)
    if speech is None or speech.fault:
        return None, speech.fault if speech is not None else NOTHING
    start, end = speech.begin * HOP_SAMPLES, min(speech.end * HOP_SAMPLES, len(sound))
    if end - start > MAX_SENTENCE_FRAMES * HOP_SAMPLES // 2:
        return None, "it takes too long; say the sentence without long pauses"
    sentence = SpokenSentence(words, net_inputs(Segment(np.asarray(sound, np.float32), start, start, end)))
    search = CtcSearch(graph_of(words), pronounce)
    fit = search.best(far_net().log_posteriors(sentence.logs))
    if fit is None or fit.loss > MOST_LOSS * sum(map(search.n_phones, words)):
        return None, "that was not the sentence, or it was hardly to be understood"
    return sentence, ""


def other_speaker(
    sentences: Sequence[SpokenSentence], name: str, others: Iterable[str], pronounce: Pronounce
) -> str | None:
    """The one of `others`, names, that the sentences say in place of their speaker's `name`; None if they say this."""
    heard = [(each.words, far_net().log_posteriors(each.logs)) for each in sentences]

    def loss(other: str) -> float:
        said = ((tuple(other.lower() if w == name.lower() else w for w in words), logs) for words, logs in heard)
        fits = [CtcSearch(graph_of(words), pronounce).best(logs) for words, logs in said]
        return sum(np.inf if fit is None else fit.loss for fit in fits)

    losses = {other: loss(other) for other in others if other.lower() != name.lower()}
    best = min(losses, key=lambda other: losses[other], default=None) if heard else None
    return best if best is not None and loss(name) - losses[best] > OTHER_NAME * len(heard) else None


def _noise(energies: Energies, power: np.ndarray) -> Energies:
    """Mean energies of the noise around the word, shape (N_BANDS,); next to none if the recording was cut at it."""
    n = max(round(EDGE_S * SAMPLE_RATE_HZ / HOP_SAMPLES), 1)
    ends, most = (slice(0, n), slice(len(power) - n, len(power))), power.max() * power_ratio(-EDGE_DB)
    edges = [end for end in ends if power[end].max() < most]
    if not edges:
        return np.full(energies.shape[1], ENERGY_FLOOR, np.float32)
    return np.asarray(np.concatenate([energies[end] for end in edges]).mean(axis=0), np.float32)


def _span(power: np.ndarray, noise: float) -> tuple[int, int, int]:
    """First frame of the word, the one after its last, and the longest gap in it, frames."""
    least = max(noise * power_ratio(BEGIN_DB), float(power.max()) * power_ratio(-RANGE_DB))
    above = np.flatnonzero(power >= min(least, float(power.max())))
    gap = int(np.diff(above).max(initial=1)) - 1
    return int(above[0]), int(above[-1]) + 1, gap


def _fault_of_word(n_frames: int, gap: int) -> str:
    length_s = n_frames * HOP_SAMPLES / SAMPLE_RATE_HZ
    if gap * HOP_SAMPLES > LONGEST_GAP_S * SAMPLE_RATE_HZ:
        return "there is a pause in it; say the one word, and nothing else"
    if not SHORTEST_S <= length_s <= LONGEST_S or n_frames > MAX_FRAMES:
        return f"it takes {length_s:.1f} s; say the one word, neither hurried nor drawn out"
    return ""


def features(take: Energies) -> Features:
    """A take in a quiet room at one loudness, shape (frames, N_FEATURES)."""
    level = level_normalised(take)
    mask = np.float32(power_ratio(-MASK_DB)) * level[level.sum(axis=1) >= 1.0].mean()
    padded = np.pad(level + mask, ((CONTEXT_FRAMES, CONTEXT_FRAMES), (0, 0)), mode="edge")
    return features_of(padded)


def distance(one: Features, other: Features) -> float:
    """The decoder's own distance of two takes, a frame: the mean of both directions."""
    return (_cost(one, other) + _cost(other, one)) / 2.0


def _cost(heard: Features, template: Features) -> float:
    """DTW cost of one take against the other, per frame of the first."""
    return float(References([[template[None]]]).costs(heard[None])[0, 0]) / len(heard)


def odd_takes(takes: Sequence[Energies]) -> list[int]:
    """The takes of one word that are unlike all its others."""
    sounds = [features(take) for take in takes]
    nearest = [
        min((distance(one, other) for k, other in enumerate(sounds) if k != n), default=0.0)
        for n, one in enumerate(sounds)
    ]
    return [n for n, apart in enumerate(nearest) if apart > INCONSISTENT]


def confusable(takes: Takes, pairs: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """The `pairs` of words whose takes are as close to one another as takes of one word; worst first."""
    sounds = {word: [features(take) for take in of_word] for word, of_word in takes.items()}
    found = []
    for first, second in pairs:
        if first not in sounds or second not in sounds or distance(sounds[first][0], sounds[second][0]) > APART:
            continue
        apart = min(distance(a, b) for a in sounds[first] for b in sounds[second])
        usual = (_spread(sounds[first]) + _spread(sounds[second])) / 2.0
        if apart < CONFUSABLE * usual:
            found.append((apart / usual, first, second))
    return [(first, second) for _, first, second in sorted(found)]


def _spread(sounds: Sequence[Features]) -> float:
    """Distance of takes of one word from one another, a frame; half of INCONSISTENT, as is usual, for a single take."""
    apart = [distance(a, b) for a, b in combinations(sounds, 2)]
    return min(float(np.median(apart)), INCONSISTENT) if apart else INCONSISTENT / 2.0
