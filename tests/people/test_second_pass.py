"""Voices that no robot has: understood if they are enrolled, or by the sounds of English."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly.make import make_template_recogniser, make_waveform_books
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.control.enrol.recordings import check_take
from hvcpd.coordination.commands import SURE
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.requests import is_harmless_request
from hvcpd.people import fusion
from hvcpd.people.enrolled import STRANGER, Person, probability
from hvcpd.people.second_pass import MIN_REQUEST, MIN_STRANGERS_PROBABILITY, SecondPassRecogniser
from hvcpd.people.stage import PeopleStage
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.recogniser import ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment
from hvcpd.recognition.decoder import TracedWord
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.frontend import Energies
from hvcpd.recognition.stages import Segment, SpeechRecogniser, SynchronousWorker
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice, voice_for

SENTENCES = ("hi rob, i am anna, what is left", "bot, turn left", "hi all, i am anna, complete task two", "rob stop")

CHILD = Voice("child", 240.0, 1.35, 0.92, -32.0, 0.6, 3000.0)
"""Unlike all robots' voices."""
NOISES_RMS = (0.04, 0.045, 0.05, 0.055, 0.06, 0.065, 0.07, 0.08, 0.1, 0.2)


@pytest.fixture(scope="module")
def sound(units: Path) -> Sound:
    return make_sound(None, units)


@pytest.fixture(scope="module")
def book() -> Phrasebook:
    return make_phrasebook(("Rob", "Bot", "Anna"), DEFAULT_TEAMS, load_tasks(default_tasks_path()))


def stranger(sound: Sound) -> Speaker:
    """A voice that neither Rob nor Bot has."""
    robots = {voice_for(name).name for name in ("Rob", "Bot")}
    return sound.speaker_in(next(v for v in VOICES if v.name not in robots))


def in_room(sounds: Sequence[Samples], gain: float, noise_rms: float = 3e-4) -> Samples:
    gap = np.zeros(round(1.6 * SAMPLE_RATE_HZ), np.float32)
    clean = np.concatenate([gap, gap, *[part for s in sounds for part in (gain * s, gap)], gap])
    return np.asarray(clean + noise_rms * np.random.default_rng(4).standard_normal(len(clean)), np.float32)


def noise(seconds: float, rms: float) -> Samples:
    return (rms * np.random.default_rng(6).standard_normal(round(seconds * SAMPLE_RATE_HZ))).astype(np.float32)


def phrases(text: str) -> list[list[str]]:
    return [part.split() for part in text.split(", ")]


def heard(book: Phrasebook, sound: Sound, people: Sequence[Person], strangers: bool, room: Samples) -> list[Event]:
    known = {person.name: person for person in people}
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, known, strangers)
    first = make_template_recogniser(book, ("Rob", "Bot"), sound)
    recogniser = SpeechRecogniser(first, [PeopleStage(first, opinion, SynchronousWorker())])
    return [e for at in range(0, len(room), 1600) for e in recogniser.push(room[at : at + 1600])]


@pytest.mark.slow
def test_an_enrolled_voice_is_understood_from_single_words(book: Phrasebook, sound: Sound) -> None:
    speaker = sound.speaker_in(CHILD)
    takes = {}
    for word in book.people_graph.words:
        take, _ = check_take(np.pad(speaker.render([[word]]), 4000))
        if take is not None:
            takes[word] = [take]
    assert len(takes) > 0.9 * len(book.people_graph.words)
    room = in_room([speaker.render(phrases(text)) for text in SENTENCES], 0.5)
    events = heard(book, sound, [Person("Anna", takes)], False, room)
    wanted = [tuple(text.replace(",", "").split()) for text in SENTENCES]
    assert [e.words for e in events if isinstance(e, Recognised)] == wanted
    assert {e.voice for e in events if isinstance(e, Recognised)} == {"anna, enrolled"}
    # Where each sentence was is told in the robot's own time.
    first = next(e for e in events if isinstance(e, Recognised))
    assert abs(first.start_sample / SAMPLE_RATE_HZ - 3.2) < 0.3


@pytest.mark.slow
def test_who_is_not_enrolled_is_heard(book: Phrasebook, sound: Sound) -> None:
    texts = ("who is here", "hi all", "what is left", "move forward")
    room = in_room([stranger(sound).render(phrases(text)) for text in texts], 0.5)
    events = heard(book, sound, [], True, room)
    understood = [e for e in events if isinstance(e, Recognised)]
    assert [" ".join(e.words) for e in understood] == list(texts)
    assert STRANGER in {e.voice for e in understood}  # the robots' own listener may understand one first
    assert all(book.parse(e.words) for e in understood)


@pytest.mark.slow
def test_a_long_pause_does_not_cut_a_sentence_in_two(book: Phrasebook, sound: Sound) -> None:
    halves = [Speaker(CHILD, sound.lexicon).render(phrases(text)) for text in ("hi rob, i am anna", "what is left")]
    said = np.concatenate([halves[0], np.zeros(round(1.05 * SAMPLE_RATE_HZ), np.float32), halves[1]])
    events = heard(book, sound, [], True, in_room([said], 0.5))
    assert [" ".join(e.words) for e in events if isinstance(e, Recognised)] == ["hi rob i am anna what is left"]


@pytest.mark.parametrize(
    ("text", "may_go_on"),
    [("turn left", False), ("stop", False), ("hi rob", True), ("move forward", True), ("hi rob, say again", False)],
)
def test_what_may_go_on_is_known_by_the_phrasebook(book: Phrasebook, sound: Sound, text: str, may_go_on: bool) -> None:
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    assert opinion.may_go_on(text.replace(",", "").split()) is may_go_on


def test_a_word_that_fits_by_chance_makes_no_robot_of_a_stranger(book: Phrasebook, sound: Sound) -> None:
    """In one stranger's sentence of six a word counted as a robot's, so nobody looked for the sentence."""
    listener = ChannelRecogniser(book.robots_graph, make_waveform_books(book, ("Rob", "Bot"), sound))
    wren = next(voice for voice in VOICES if voice.name == "wren")
    segment = alone(sound.speaker_in(wren), "move forward")
    stretch = ChannelSegment(segment.sound, 0, segment.lead)
    assert not listener.search(stretch).robot


@pytest.mark.slow
def test_words_of_nobody_stay_garbled(book: Phrasebook, sound: Sound) -> None:
    chooser = random.Random(5)
    lexicon = sorted(w for w in sound.lexicon.entries if w.isalpha() and w not in book.graph.words)
    talk = [stranger(sound).render([[chooser.choice(lexicon) for _ in range(5)]]) for _ in range(5)]
    events = heard(book, sound, [], True, in_room(talk, 0.5))
    assert sum(isinstance(e, Garbled) for e in events) >= 3
    # What is made up all the same must not move wheels by itself.
    assert all(e.confidence < SURE for e in events if isinstance(e, Recognised))


def test_what_is_farther_from_the_takes_is_less_sure() -> None:
    def match(deficit: float, passed_over: float = 0.1, above_noise: float = 2.0, margin: float = 20.0) -> float:
        path = [TracedWord(k, k * 20, k * 20 + 20, 0.0, margin) for k in range(2)]
        return probability(path, [deficit] * 2, passed_over, above_noise)

    assert match(0.2) > 0.95 > match(0.9) > match(2.0)
    assert match(2.0) < 0.1
    assert match(0.5, passed_over=0.7) < 0.5 < match(0.5)  # half of the speech was taken for noise
    assert match(0.0, above_noise=0.0, margin=1.0) < 0.8 < match(0.0)  # there was nothing to be heard
    assert match(0.5, margin=0.3) < 0.8 < match(0.5)  # another word fits as well


def takes_of(speaker: Speaker, *words: str) -> dict[str, list[Energies]]:
    checks = {word: check_take(np.pad(speaker.render([[word]]), 4000)) for word in words}
    return {word: [take] for word, (take, _) in checks.items() if take is not None}


def alone(speaker: Speaker, text: str) -> Segment:
    """One sentence, and 3.2 s of noise before it."""
    speech, lead = speaker.render([text.split()]), round(3.2 * SAMPLE_RATE_HZ)
    return Segment(in_room([speech], 0.5), lead, 0, len(speech))


def sentence(opinion: SecondPassRecogniser, segment: Segment) -> Recognised | None:
    """The sentence that is found, if one is sure enough."""
    found = opinion.search(segment)
    return found if isinstance(found, Recognised) else None


def test_who_is_enrolled_is_told_by_name_and_who_is_not_is_a_stranger(book: Phrasebook, sound: Sound) -> None:
    speaker = sound.speaker_in(CHILD)
    known = {"anna": Person("Anna", takes_of(speaker, "turn", "left", "right"))}
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, known, True)
    found = [sentence(opinion, alone(speaker, text)) for text in ("turn left", "who is here")]
    assert [(e.words, e.voice) for e in found if e is not None] == [
        (("turn", "left"), "anna, enrolled"),
        (("who", "is", "here"), STRANGER),
    ]


@pytest.mark.parametrize("text", ["stop", "rob stop", "who is here", "move forward"])
def test_anybody_is_heard(book: Phrasebook, sound: Sound, text: str) -> None:
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    found = sentence(opinion, alone(stranger(sound), text))
    assert found is not None
    assert found.words == tuple(text.split())
    # Sure enough to be obeyed, but for wheels that would move: those want a read-back.
    assert 0.5 <= found.confidence < SURE
    assert found.confidence >= 0.8 or found.words[-1] != "stop"


def test_the_louder_it_is_the_less_sure_a_stranger_is(book: Phrasebook, sound: Sound) -> None:
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    quiet = alone(stranger(sound), "who is here")
    sure = []
    for rms in (0.0, 0.15, 1.0):
        loud = replace(quiet, sound=quiet.sound + noise(len(quiet.sound) / SAMPLE_RATE_HZ, rms)[: len(quiet.sound)])
        found = opinion.compared(loud)[0]
        sure.append(found.confidence if found is not None else 0.0)
    assert sure[0] > 0.5 > 0.2 > max(sure[1:])
    assert sentence(opinion, loud) is None


@pytest.mark.parametrize("name", ["sarah", "peter", "yuki", "anna"])
@pytest.mark.parametrize("text", ["hi rob i am {} what is left", "hi bot i am {} turn right", "hi all i am {}"])
def test_a_person_whose_name_is_not_known_is_a_friend(book: Phrasebook, sound: Sound, name: str, text: str) -> None:
    """All were told as said by Bot or by Anna, whose names the robot knows."""
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    found = sentence(opinion, alone(stranger(sound), text.format(name)))
    assert found is not None
    assert " ".join(found.words) == text.format("anna" if name == "anna" else "friend")


@pytest.mark.parametrize("start", ["not going to", "never going to", "unable to", "going to", "not able to"])
def test_what_somebody_is_not_going_to_do_is_no_order(book: Phrasebook, sound: Sound, start: str) -> None:
    """It was that of somebody who is called so."""
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True, "Rob")
    said = alone(stranger(sound), f"hi rob i am {start} complete task two")
    assert sentence(opinion, said) is None
    assert opinion.compared(said)[0] is None
    found = sentence(opinion, alone(stranger(sound), "hi rob i am nathan complete task two"))
    assert found is not None
    assert " ".join(found.words) == "hi rob i am friend complete task two"


@pytest.mark.parametrize(
    "text",
    ["do not turn left", "don't move forward", "do not come back", "bot do not turn left", "rob don't turn around"],
)
def test_what_nobody_should_do_is_no_order(book: Phrasebook, sound: Sound, text: str) -> None:
    """ "Do not turn left" was heard as "Bot, turn left", or as an order to team A."""
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True, "Rob")
    assert sentence(opinion, alone(stranger(sound), text)) is None


@pytest.mark.parametrize("name", ["anna", "sarah"])
@pytest.mark.parametrize("words", ["not confirmed", "have not confirmed", "do not resume", "don't resume"])
def test_what_somebody_does_not_do_after_saying_a_name_is_not_taken_for_the_opposite(
    book: Phrasebook, sound: Sound, name: str, words: str
) -> None:
    """ "I am Anna, not confirmed" confirmed an order: "Anna not" was the name of a friend."""
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True, "Rob")
    found = sentence(opinion, alone(stranger(sound), f"hi rob i am {name} {words}"))
    assert found is None


def test_a_sentence_may_begin_later_than_the_segment_does(book: Phrasebook, sound: Sound) -> None:
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    segment = after_talk(sound, "bot turn left")
    found = sentence(opinion, segment)
    assert found is not None
    assert found.words == ("bot", "turn", "left")
    assert found.start_sample >= segment.later[0] - 8000


def after_talk(sound: Sound, text: str) -> Segment:
    """A sentence 0.3 s after other words."""
    talk, before = alone(stranger(sound), text), stranger(sound).render([["banana", "potato"]])
    gap = np.zeros(5000, np.float32)
    whole = np.concatenate([talk.sound[: talk.lead], 0.5 * before, gap, talk.sound[talk.lead :]])
    later = talk.start + len(before) + len(gap)
    segment = Segment(whole, talk.lead, talk.start, talk.end + len(before) + len(gap), later=(later,))
    assert [each.start for each in segment.beginnings] == [talk.start, later]
    return segment


@pytest.mark.parametrize(
    ("text", "counts"),
    [("turn around", False), ("hi i am anna what is left", False), ("bot turn around", True), ("stop", True)],
)
def test_after_other_words_a_sentence_needs_an_addressee(
    book: Phrasebook, sound: Sound, text: str, counts: bool
) -> None:
    """Those words may be a name, and then it moves another robot: "turn around" was told of "Bot, turn around"."""
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True)
    assert sentence(opinion, alone(stranger(sound), text)) is not None
    found = sentence(opinion, after_talk(sound, text))
    assert (found.words if found is not None else ()) == (tuple(text.split()) if counts else ())


@pytest.mark.parametrize("text", ["rob move forward two metres", "hi rob i am anna water the yellow rose"])
def test_whom_a_sentence_is_for_is_known_before_its_words_are(book: Phrasebook, sound: Sound, text: str) -> None:
    quiet = alone(stranger(sound), text)
    segment = replace(quiet, sound=quiet.sound + noise(len(quiet.sound) / SAMPLE_RATE_HZ, 0.065)[: len(quiet.sound)])
    rob, bot, nobody = (
        SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True, name) for name in ("Rob", "Bot", None)
    )
    assert rob.search(segment) == Garbled(segment.start, segment.end, addressed=True)
    assert bot.search(segment) is None
    assert nobody.search(segment) is None


def test_a_request_that_is_read_back_may_be_less_sure(book: Phrasebook, sound: Sound) -> None:
    """Nothing is done before it is confirmed; "resume" would count at once."""
    harmless = partial(is_harmless_request, book, "Rob")
    recogniser = SecondPassRecogniser(book.people_graph, sound.lexicon, {}, True, "Rob", harmless)

    def probabilities(text: str) -> list[float]:
        """Of what is reported, in more and more noise; in the first that hides it, it is surely for this robot."""
        quiet = alone(stranger(sound), text)
        hiss = noise(len(quiet.sound) / SAMPLE_RATE_HZ, 1.0)[: len(quiet.sound)]
        heard = [recogniser.search(replace(quiet, sound=quiet.sound + rms * hiss)) for rms in NOISES_RMS]
        reported = [found for found in heard if isinstance(found, Recognised)]
        assert all(" ".join(found.words) == text for found in reported)
        assert heard[: len(reported)] == reported
        assert heard[len(reported)] == Garbled(quiet.start, quiet.end, addressed=True)
        return [found.confidence for found in reported]

    assert MIN_REQUEST <= min(probabilities("rob move forward two metres")) < MIN_STRANGERS_PROBABILITY
    assert min(probabilities("rob resume")) >= MIN_STRANGERS_PROBABILITY


@pytest.mark.parametrize("strangers", [True, False])
@pytest.mark.filterwarnings("error")
def test_no_sound_is_too_strange(book: Phrasebook, sound: Sound, strangers: bool) -> None:
    speaker = sound.speaker_in(CHILD)
    known = {} if strangers else {"anna": Person("Anna", takes_of(speaker, "stop", "turn", "left", "who", "is"))}
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, known, strangers)
    for speech in (noise(0.0, 0.1), noise(1e-4, 0.1), noise(0.02, 0.1), noise(1.0, 0.0), np.sign(noise(1.0, 0.1))):
        for lead in (0, 8000):
            segment = Segment(np.pad(speech, (lead, 0)), lead, 0, len(speech))
            assert sentence(opinion, segment) is None
            found = opinion.compared(segment)[0]
            assert found is None or found.confidence < 0.5
    if strangers:  # none of them has spoiled what comes after
        after = sentence(opinion, alone(stranger(sound), "rob stop"))
        assert after is not None
        assert after.words == ("rob", "stop")


def test_words_count_as_soon_as_they_are_learned(book: Phrasebook, sound: Sound) -> None:
    speaker = sound.speaker_in(CHILD)
    known = {"anna": Person("Anna", takes_of(speaker, "turn", "right"))}
    opinion = SecondPassRecogniser(book.people_graph, sound.lexicon, known, False)
    before = sentence(opinion, alone(speaker, "turn left"))
    assert before is None or before.words != ("turn", "left")
    known["anna"] = known["anna"].with_takes(takes_of(speaker, "left"))
    after = sentence(opinion, alone(speaker, "turn left"))
    assert after is not None
    assert after.words == ("turn", "left")


def test_what_was_said_is_compared_with_what_is_likeliest_in_one_pass(book: Phrasebook, sound: Sound) -> None:
    """`hvcpctl hear --said` ran the nets twice."""

    class Counted(SecondPassRecogniser):
        passes = 0

        def hypotheses(self, segment: Segment) -> fusion.Hypotheses:
            self.passes += 1
            return super().hypotheses(segment)

    segment, said = alone(stranger(sound), "bot turn left"), ("bot", "turn", "right")
    ears = Counted(book.people_graph, sound.lexicon, {}, True)
    found, own = ears.compared(segment, said)
    assert ears.passes == 1
    assert found == ears.compared(segment)[0]
    assert own == fusion.probability(fusion.confidence_features(ears.hypotheses(segment), said))
