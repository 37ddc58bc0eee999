"""What robots said in a stretch of sound, through channels that nobody knows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.channel.path import Rendering
from hvcpd.recognition.channel.recogniser import EDGE, MOST_LOSS, ChannelRecogniser, noise_sample
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.events import Source
from tests.recognition.hisses import BOOKS, GRAPH, Book, fresh, scene, spoken, through_a_room

AT, ORIGIN = 24_000, 500_000


def look(*sounds: tuple[int, Samples], noise: float = 0.3) -> SearchResult:
    """At sounds in noise."""
    n = max(at + len(sound) for at, sound in sounds) + 12_000
    return fresh().search(ChannelSegment(scene(n, *sounds, noise=noise), ORIGIN, AT - 4000))


def heard(text: str, voice: str = "oak", seed: int = 1) -> Samples:
    return through_a_room(spoken(text, voice), seed)


def told(found: SearchResult) -> set[tuple[str, str]]:
    return {(" ".join(each.words), each.voice) for each in found.sentences}


@pytest.mark.parametrize("noise", [0.03, 1.0])
def test_a_sentence_is_told_with_its_words_in_their_places(noise: float) -> None:
    sound = heard("hi rob, water rose")
    found = look((AT, sound), noise=noise)
    [sentence] = found.sentences
    assert (found.robot, found.in_progress) == (False, ())
    assert (sentence.words, sentence.source) == (("hi", "rob", "water", "rose"), Source.CHANNEL)
    assert abs(sentence.start_sample - ORIGIN - AT) <= 32
    assert abs(sentence.end_sample - ORIGIN - AT - len(sound)) <= 500
    assert [span.word for span in sentence.spans] == list(sentence.words)
    starts = [span.start_sample for span in sentence.spans]
    assert starts == sorted(starts)


@pytest.mark.parametrize("later", [0, 4000])
def test_two_robots_at_once_6_db_apart_are_both_heard(later: int) -> None:
    quiet = 0.5 * heard("all, who is here", "willow", 2)
    found = look((AT, heard("hi rob, water rose")), (AT + later, quiet))
    assert told(found) == {("hi rob water rose", "oak"), ("all who is here", "willow")}


@pytest.mark.parametrize("fainter_db", [9.0, 12.0])
def test_a_sentence_under_louder_noise_is_told(fainter_db: float) -> None:
    said, gain = heard("hi rob, water rose"), np.float32(10.0 ** (-fainter_db / 20.0))
    louder = np.random.default_rng(1).standard_normal(len(said)).astype(np.float32)
    louder *= np.sqrt(np.mean(said**2))
    found = look((AT, gain * said), (AT, louder), noise=0.1 * float(gain))
    assert told(found) == {("hi rob water rose", "oak")}


def test_who_says_it_again_is_heard_twice() -> None:
    sound = heard("hi rob, water rose")
    found = look((AT, 0.5 * sound), (AT + len(sound) + 4000, sound), noise=0.1)
    places = sorted(each.start_sample - ORIGIN - AT for each in found.sentences)
    assert places == pytest.approx([0, len(sound) + 4000], abs=32)


@pytest.mark.parametrize("share", [0.4, 0.7])
def test_a_robot_that_is_cut_off_is_noticed_and_nothing_is_told(share: float) -> None:
    whole = heard("all, who is here")
    found = look((AT, whole[: int(share * len(whole))]))
    assert (found.sentences, found.robot) == ((), True)


def test_who_is_cut_off_at_the_end_of_the_sound_may_go_on() -> None:
    whole = heard("all, who is here")
    sound = scene(AT + len(whole) // 2, (AT, whole[: len(whole) // 2]))
    found = fresh().search(ChannelSegment(sound, 0, AT))
    assert (found.sentences, found.robot) == ((), True)
    assert found.in_progress[0].starts[0] == pytest.approx(AT, abs=32)
    later = scene(AT + len(whole) // 2 + 2 * SAMPLE_RATE_HZ, (AT, whole[: len(whole) // 2]))
    found = fresh().search(ChannelSegment(later, 0, AT))
    assert (found.sentences, found.robot, found.in_progress) == ((), True, ())


def test_a_sentence_of_which_the_end_is_not_in_the_sound_is_not_told() -> None:
    whole = heard("stop")
    sound = scene(AT + len(whole), (AT, whole))
    for end, sentences in ((len(whole), 1), (len(whole) - 3000, 0)):
        found = fresh().search(ChannelSegment(sound[: AT + end], 0, AT))
        assert len(found.sentences) == sentences


def test_who_has_begun_at_a_cut_is_heard_out_whatever_was_said_before() -> None:
    cut = heard("hi rob, water rose")[: len(heard("hi rob, water"))]
    begun = 0.5 * heard("all, who is here", "willow")[: len(heard("all, who", "willow")) // 2]
    later = AT + len(cut) + SAMPLE_RATE_HZ
    sound = scene(later + len(begun), (AT, np.concatenate([cut[: len(cut) - 6000], np.zeros(6000)])), (later, begun))
    found = fresh().search(ChannelSegment(sound, 0, AT, cut=True))
    assert found.in_progress[0].starts[0] == pytest.approx(later, abs=32)


class Slowly(Book):
    """The same voice at another rate: other hisses."""

    def _made(self, word: str, third: int) -> Sequence[Rendering]:
        return Book(f"{self.voice}, slowly").renderings(word, third)


USUAL, SLOW = Book("oak"), Slowly("oak")


@pytest.mark.parametrize("seed", [0, 2])
@pytest.mark.parametrize("book", [USUAL, SLOW])
@pytest.mark.parametrize("learned", [False, True])
def test_a_sentence_in_progress_is_heard_out(book: Book, learned: bool, seed: int) -> None:
    """At whatever rate, and whether or not names are learned meanwhile, so that all voices are made anew."""
    whole = through_a_room(spoken("all, who is here", book=book), seed)
    sound = scene(AT + len(whole) + 3 * SAMPLE_RATE_HZ, (AT, whole), noise=1.0)
    listener = ChannelRecogniser(GRAPH, (USUAL, SLOW))
    begun = listener.search(ChannelSegment(sound[: AT + len(whole) // 2], 0, AT, cut=True))
    assert {path.book for path in begun.in_progress} == {book}
    later = ChannelRecogniser(GRAPH, (Book("oak"), Slowly("oak"))) if learned else listener
    found = later.search(ChannelSegment(sound, 0, AT))
    assert told(found) == {("all who is here", "oak")}


def test_a_word_that_seems_to_begin_does_not_hide_a_slow_sentence_in_progress() -> None:
    """In a motor's noise the slow "I am Mia, member of team B, resume" became the templates' "I am Mia, negative"."""
    whole = through_a_room(spoken("hi rob, water rose", book=SLOW), 0)
    begun, first, last = whole[: 4 * len(whole) // 5], 0.6 * heard("hi rob")[:4000], 0.3 * heard("stop")[:6000]
    at = AT + 12_000
    end = at + len(begun)
    sound = scene(end, (at, begun), (AT, first), (end - len(last), last), noise=1.0)
    found = ChannelRecogniser(GRAPH, (USUAL, SLOW)).search(ChannelSegment(sound, 0, AT, cut=True))
    assert found.in_progress[0].book is SLOW


@pytest.mark.parametrize("seed", range(2))
def test_strangers_and_noise_are_no_robots(seed: int) -> None:
    stranger = through_a_room(spoken("hi rob, water rose", book=Book(f"elm {seed}")), seed)
    assert look((AT, stranger)) == SearchResult()
    assert fresh().search(ChannelSegment(scene(50_000, seed=seed), 0, AT)) == SearchResult()


SOUNDS: dict[str, Callable[[int], Samples]] = {
    "digital silence": lambda n: np.zeros(n, np.float32),
    "a constant": lambda n: np.full(n, 0.5, np.float32),
    "a click": lambda n: np.where(np.arange(n) == n // 2, np.float32(1), np.float32(0)),
    "full scale": lambda n: np.sign(np.random.default_rng(1).standard_normal(n)).astype(np.float32),
    "hardly anything": lambda n: 1e-20 * np.random.default_rng(1).standard_normal(n).astype(np.float32),
    "a sentence and silence": lambda n: np.resize(np.pad(heard("hi bot, stop"), (30, 9000)), n),
}


@settings(max_examples=20)
@given(
    name=st.sampled_from(sorted(SOUNDS)),
    n=st.integers(0, 12_000),
    lead=st.integers(0, 12_000),
)
def test_any_sound_is_looked_at(name: str, n: int, lead: int) -> None:
    with np.errstate(divide="raise", invalid="raise"):
        found = fresh().search(ChannelSegment(SOUNDS[name](n), 0, min(lead, n)))
    assert name == "a sentence and silence" or not found.sentences


def test_a_sentence_in_digital_silence_is_heard() -> None:
    assert told(look((AT, heard("hi rob, water rose")), noise=0.0)) == {("hi rob water rose", "oak")}


@given(before=st.integers(0, 30_000), n=st.integers(0, 30_000))
def test_a_part_of_what_was_heard_is_the_noise(before: int, n: int) -> None:
    lead, sound = np.zeros(before, np.float32), np.ones(n, np.float32)
    part = noise_sample(lead, sound)
    assert len(part) <= 8000
    assert not part.any() if before >= 16_000 else part.all()


def test_noise_is_known_by_a_quiet_part_but_not_the_quietest() -> None:
    lead = scene(48_000)
    lead[4000:14_000] *= 10.0  # somebody spoke
    lead[30_000:30_500] = 0.0  # a drop-out
    part = noise_sample(lead, lead)
    assert len(part) == 8000
    assert np.std(part) == pytest.approx(0.3 * 0.05, rel=0.05)


def test_all_voices_are_made_ready() -> None:
    book = Book("oak")
    ChannelRecogniser(GRAPH, (book,)).prepare(lambda: True)
    assert book.prepared


@pytest.mark.parametrize(("loss", "is_told"), [(MOST_LOSS - 0.1, True), (MOST_LOSS + 0.1, False)])
def test_what_has_other_phones_is_not_told(loss: float, is_told: bool) -> None:
    asked: list[tuple[Sequence[str], int, int]] = []

    def check(words: Sequence[str], sound: Samples, noise: Samples) -> float:
        asked.append((words, len(sound), len(noise)))
        return loss

    sound = heard("hi rob, water rose")
    listener = ChannelRecogniser(GRAPH, tuple(BOOKS.values()), check=check)
    found = listener.search(ChannelSegment(scene(AT + len(sound) + 12_000, (AT, sound), noise=0.03), ORIGIN, AT))
    assert (told(found) == {("hi rob water rose", "oak")}) == is_told
    words, n_sound, n_noise = asked[0]
    assert tuple(words) == ("hi", "rob", "water", "rose")
    assert abs(n_sound - len(sound) - 2 * EDGE) <= 800
    assert n_noise > 0


@pytest.mark.parametrize(("rest_s", "n_checks"), [(0.8, 0), (1.1, 1)])
def test_the_phones_are_checked_of_what_would_be_told_alone(rest_s: float, n_checks: int) -> None:
    """A check takes a twentieth of the sentence's time, and a long sentence may be looked at many times."""
    asked: list[Sequence[str]] = []

    def check(words: Sequence[str], sound: Samples, noise: Samples) -> float:
        asked.append(words)
        return 0.0

    sound = heard("hi rob, water rose")
    stretch = scene(AT + len(sound) + round(rest_s * SAMPLE_RATE_HZ), (AT, sound), noise=0.03)
    found = ChannelRecogniser(GRAPH, tuple(BOOKS.values()), check=check).search(
        ChannelSegment(stretch, ORIGIN, AT, cut=True)
    )
    assert (len(found.sentences), len(asked)) == (n_checks, n_checks)
