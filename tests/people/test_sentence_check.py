"""The phone net objects to a sentence that was not said, and hardly to any in loud noise."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.people.phone_checks import loss_of_sentence
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.recogniser import MOST_LOSS
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, voice_named

LEXICON = Lexicon.load()
SAID = "hi rob i am bot i will water the red rose"
OTHERS = ("what is left", "hi all i am tom", "team plant come back", "turn around")


def loss(words: str, sound: Samples, noise_rms: float) -> float:
    noise = noise_rms * np.random.default_rng(3).standard_normal(SAMPLE_RATE_HZ + len(sound)).astype(np.float32)
    heard = noise[SAMPLE_RATE_HZ:] + sound
    return loss_of_sentence(LEXICON.sounds, words.split(), heard, noise[:SAMPLE_RATE_HZ])


def said(text: str, voice: str) -> Samples:
    sound = Speaker(voice_named(voice), LEXICON).render([text.split()])
    return np.asarray(0.05 * sound / np.sqrt(np.mean(sound**2)), np.float32)


@pytest.mark.parametrize("voice", [voice.name for voice in VOICES])
def test_what_a_robot_says_costs_little(voice: str) -> None:
    sound = said(SAID, voice)
    assert loss(SAID, sound, 0.001) < 0.5
    assert loss(SAID, sound, 0.015) < 1.0


@pytest.mark.parametrize("words", OTHERS)
def test_what_nobody_said_costs_much(words: str) -> None:
    assert loss(words, said("one large coffee with milk and two of the small cakes please", "oak"), 0.001) > MOST_LOSS


@pytest.mark.parametrize("words", OTHERS)
def test_in_noise_much_louder_than_speech_the_net_has_little_say(words: str) -> None:
    assert loss(words, said("one large coffee with milk please", "oak"), 0.5) < 1.5


@pytest.mark.parametrize("n", [0, 10, 500])
def test_of_hardly_any_sound_it_says_nothing(n: int) -> None:
    assert loss("stop", np.zeros(n, np.float32), 0.0) == 0.0
