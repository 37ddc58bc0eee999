"""One word is heard over another voice, where no sentence can be recognised."""

from dataclasses import replace

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Held, Recognised, Released, Urgent
from hvcpd.recognition.frontend import energies_of
from hvcpd.recognition.hold import HoldSettings
from hvcpd.recognition.lookalike import Lookalike
from hvcpd.recognition.recogniser import Recogniser
from hvcpd.recognition.settings import RecogniserSettings
from hvcpd.recognition.templates import TemplateBank
from hvcpd.recognition.urgent import UrgentSettings, UrgentSpotter, UrgentTemplates
from tests.recognition.signals import graph, in_noise, sentence, templates, word

CALL = word("stop", 170.0)


def ears(urgent: bool = True) -> Recogniser:
    spotter = UrgentSpotter(UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"})), UrgentSettings(threshold=0.38))
    return Recogniser(graph(), templates(), urgent=spotter if urgent else None)


def talk() -> Samples:
    """A robot's sentences, on and on, so that no rest follows the word."""
    return sentence("rob water green rose, bot water green rose")


def over(talk: Samples, at_s: float, call: Samples) -> Samples:
    mixed = talk.copy()
    at = round(at_s * SAMPLE_RATE_HZ)
    mixed[at : at + len(call)] += call
    return in_noise(mixed)


def hear(recogniser: Recogniser, sound: Samples, block: int = 400) -> list[tuple[float, Event]]:
    return [
        ((start + block) / SAMPLE_RATE_HZ, event)
        for start in range(0, len(sound), block)
        for event in recogniser.push(sound[start : start + block])
    ]


@pytest.mark.parametrize("at_s", [0.3, 0.7, 1.0, 1.4])
def test_stop_is_heard_over_talk_as_loud_within_half_a_second(at_s: float) -> None:
    end_s = 1.0 + at_s + len(word("stop")) / SAMPLE_RATE_HZ
    events = hear(ears(), over(talk(), at_s, CALL))
    told = [at for at, event in events if isinstance(event, Held | Urgent)]
    assert end_s - 0.1 < told[0] < end_s + 0.5
    assert sum(isinstance(event, Urgent) for _, event in events) == 1
    assert not any(isinstance(event, Released) for _, event in events)
    without = hear(ears(urgent=False), over(talk(), at_s, CALL))
    assert not any(isinstance(event, Recognised) and "stop" in event.words for _, event in without)


@pytest.mark.parametrize(("noise_db", "told"), [(-40.0, True), (0.0, False)])
def test_a_word_as_loud_as_the_noise_must_be_found_more_surely(noise_db: float, told: bool) -> None:
    """Of babble, which is noise to the noise tracker, a part always resembles the word."""
    energies = np.tile(energies_of(CALL), (2, 1))
    noise = np.full(energies.shape[1], energies.mean() * 10.0 ** (noise_db / 10.0), np.float32)
    for least, expected in ((0.1, True), (2.0, told)):
        settings = UrgentSettings(threshold=0.1, drowned_threshold=least)
        spotter = UrgentSpotter(UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"})), settings)
        spotter.feed(0, energies + noise, noise)
        assert spotter.pending is expected


def test_talk_alone_is_no_stop_and_is_still_understood() -> None:
    events = [event for _, event in hear(ears(), in_noise(sentence("hi rob, water green")))]
    assert [event.words for event in events if isinstance(event, Recognised)] == [("hi", "rob", "water", "green")]
    assert not any(isinstance(event, Held | Urgent) for event in events)


def test_talk_that_sounds_like_the_word_is_held_for_and_released() -> None:
    """The call is the talk's own second word, so that nobody can tell until the sentence is understood."""
    alike = sentence("hi rob, water green")
    spotter = UrgentSpotter(UrgentTemplates({"low": [word("rob")]}, {}, frozenset({"stop"})), UrgentSettings(0.38))
    hold = HoldSettings(certain_score=2.0, sentence_confidence=0.5)
    recogniser = Recogniser(graph(), templates(), urgent=spotter, hold=hold)
    events = [event for _, event in hear(recogniser, in_noise(alike))]
    assert [type(event) for event in events] == [Held, Recognised, Released]


def test_the_word_alone_is_told_even_in_a_voice_of_which_no_sentence_is_understood() -> None:
    strict = RecogniserSettings(min_confidence=1.1)
    spotter = UrgentSpotter(UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"})))
    recogniser = Recogniser(graph(), templates(), strict, spotter)
    events = [event for _, event in hear(recogniser, in_noise(CALL))]
    assert isinstance(events[-1], Urgent)
    assert not any(isinstance(event, Recognised | Released) for event in events)


def test_who_begins_with_a_faint_s_is_heard_at_the_level_of_the_vowel() -> None:
    faint = np.asarray(CALL * np.where(np.arange(len(CALL)) < len(CALL) // 3, 0.1, 1.0), np.float32)
    spotter = UrgentSpotter(UrgentTemplates({"low": [faint]}, {}, frozenset({"stop"})))
    sound = in_noise(faint, before_s=0.0)
    energies = energies_of(sound)
    for frame in range(0, 60, 4):
        spotter.feed(frame, energies[frame : frame + 4], energies[-40:].mean(axis=0))
    word = spotter.take()
    assert word is not None
    assert abs(word[0] - len(faint) / 160) <= 6
    assert word[1] > 0.57


def test_a_sentence_that_ends_with_the_word_is_told_once() -> None:
    events = [event for _, event in hear(ears(), in_noise(sentence("stop")))]
    assert [type(event) for event in events] == [Recognised]


def test_a_rival_that_fits_better_is_not_the_word() -> None:
    longer = np.concatenate([CALL, word("hi", 170.0)])
    energies = energies_of(in_noise(longer))
    noise = energies[:40].mean(axis=0)
    settings = UrgentSettings(threshold=0.33, hold_frames=40, rival_lead=0.0)

    def heard(rivals: dict[str, list[Samples]]) -> bool:
        spotter = UrgentSpotter(UrgentTemplates({"low": [CALL]}, rivals, frozenset({"stop"})), settings)
        told = []
        for frame in range(96, len(energies) - 4, 4):  # amid talk, not after a silence
            spotter.feed(frame, energies[frame : frame + 4], noise)
            told.append(spotter.ended(frame + 4, sentence_ends=False))
        return any(end is not None for end in told)

    assert heard({})
    assert not heard({"low": [longer]})


def test_a_phrase_that_ends_with_the_word_is_found_beside_it() -> None:
    phrase = sentence("water stop")
    settings = UrgentSettings(threshold=0.33)
    urgent = UrgentTemplates({"low": [CALL]}, {}, frozenset({"stop"}), [phrase])

    def excuse(sound: Samples) -> float:
        energies = energies_of(in_noise(sound))
        spotter = UrgentSpotter(urgent, settings)
        for frame in range(96, len(energies) - 4, 4):
            spotter.feed(frame, energies[frame : frame + 4], energies[:40].mean(axis=0))
        word = spotter.take()
        assert word is not None
        return word.excuse - word.score

    assert excuse(phrase) > -0.25
    assert excuse(sentence("green stop")) < -0.25


def test_the_size_of_the_blocks_changes_nothing() -> None:
    sound = over(talk(), 0.7, CALL)
    spans = [
        [(type(e), e.start_sample) for _, e in hear(ears(), sound, block) if isinstance(e, Held | Urgent)]
        for block in (37, 400, 16_000)
    ]
    assert spans[0] == spans[1] == spans[2] != []


def test_a_sentence_is_asked_how_much_of_the_word_it_shows_by_itself() -> None:
    spotter = UrgentSpotter(UrgentTemplates({"low": [word("rob", 170.0)]}, {}, frozenset({"rob"})))
    bank = TemplateBank({"low": {name: [word(name)] for name in ("hi", "rob", "water", "green")}})
    sound = in_noise(sentence("hi rob, water green"))
    [said] = [e for _, e in hear(Recogniser(graph(), templates()), sound) if isinstance(e, Recognised)]
    lookalike = Lookalike(bank, spotter)
    voiced = replace(said, voice="low")
    spans = {span.word: span for span in voiced.spans}
    shares = {name: lookalike.share(voiced, s.start_sample, s.end_sample) for name, s in spans.items()}
    assert shares["rob"] > 0.7
    assert max(shares["hi"], shares["green"]) < 0.4
    assert lookalike.share(voiced, 0, 10) == 0.0
    assert not spotter.pending
