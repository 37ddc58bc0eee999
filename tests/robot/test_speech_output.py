"""How a sentence leaves the robot: its level, its shape for noise, and how often it is said."""

import numpy as np
import pytest

from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.tasks import TaskRepository
from hvcpd.coordination.actions import SECOND_PAUSE_S, Say
from hvcpd.language import messages as m
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.robot.speech_output import delivered, spoken
from hvcpd.synthesis.delivery import for_noise
from hvcpd.synthesis.leveling import PEAK
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.loudness import loudness_lufs
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES

BOOK = make_phrasebook(("Rob", "Bot"), ("plant",), TaskRepository(()))
MOUTH = Speaker(VOICES[0], Lexicon.load())
WHO = m.Utterance("Rob", m.ToAll(), None, m.WhoHere())
PLAIN = spoken(MOUTH, WHO, BOOK)


def test_a_sentence_is_said_as_it_is_unless_told_otherwise() -> None:
    np.testing.assert_array_equal(delivered(MOUTH, Say(WHO), BOOK), PLAIN)


def test_a_soft_sentence_has_the_same_samples_at_its_level() -> None:
    np.testing.assert_allclose(delivered(MOUTH, Say(WHO, level_db=-20.0), BOOK), 0.1 * PLAIN, rtol=1e-5)


def test_a_sentence_for_noise_is_shaped_and_as_loud_as_its_peaks_allow() -> None:
    sound = delivered(MOUTH, Say(WHO, for_noise=True), BOOK)
    np.testing.assert_allclose(np.corrcoef(sound, for_noise(PLAIN))[0, 1], 1.0, atol=1e-6)
    assert loudness_lufs(sound) > loudness_lufs(PLAIN) + 3.0
    assert np.max(np.abs(sound)) <= PEAK * (1.0 + 1e-6)


@pytest.mark.parametrize("for_noise", [False, True])
def test_a_sentence_said_twice_pauses_in_between(for_noise: bool) -> None:
    once, twice = (delivered(MOUTH, Say(WHO, times=n, for_noise=for_noise), BOOK) for n in (1, 2))
    pause = np.zeros(round(SECOND_PAUSE_S * SAMPLE_RATE_HZ), np.float32)
    np.testing.assert_array_equal(twice, np.concatenate([once, pause, once]))
