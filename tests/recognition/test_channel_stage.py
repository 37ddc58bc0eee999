"""What the first ears tell, and what a second look through any channel makes of it."""

from __future__ import annotations

import gc
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.channel.endpoints import CLATTER, CUT_AFTER, CUT_AGAIN_AFTER
from hvcpd.recognition.channel.estimation import blocks_of
from hvcpd.recognition.channel.path import Path
from hvcpd.recognition.channel.recogniser import ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.channel.stage import ChannelStage, contradicts
from hvcpd.recognition.events import Event, Garbled, Held, Recognised, Source
from hvcpd.recognition.stages import GOES_ON_WITHIN, SynchronousWorker
from hvcpd.recognition.stream import HISTORY_SAMPLES, MAX_WAIT
from tests.recognition.hisses import BOOKS, GRAPH, Book, fresh, scene, spoken, through_a_room
from tests.recognition.scripted import (
    AT,
    BLOCK,
    END,
    GARBLED,
    HEARD,
    RIGHT,
    SNR_DB,
    SOUND,
    Script,
    Slow,
    alone,
    guess,
    recogniser,
    run,
    the_sentence,
)


def test_a_sentence_that_templates_found_is_held_until_the_look_and_replaced() -> None:
    worker = Slow()
    listening = recogniser(Script([(END + 2000, guess())]), worker)
    assert run(listening, 0, END + 10_000) == []
    assert listening.busy
    worker.end()
    the_sentence(listening.push(SOUND[END + 10_000 : END + 10_010]))
    assert not listening.busy


@pytest.mark.parametrize(
    ("event", "after"),
    [
        (GARBLED, 0),
        (GARBLED, 20_000),
        (guess(), 6000),
        (guess("hi rob water rose"), 6000),
        (guess("stop", 0.9), 20_000),
    ],
)
def test_the_sentence_found_is_told_once_whatever_the_first_ears_make_of_it_and_when(event: Event, after: int) -> None:
    the_sentence(run(recogniser(Script([(END + after, event)]))))


def test_what_the_first_ears_miss_is_found() -> None:
    the_sentence(run(recogniser(Script())))


@pytest.mark.parametrize("source", [Source.SPELLED])
def test_sentences_from_others_than_templates_pass_and_are_told_once(source: Source) -> None:
    sentence = guess("hi rob water rose", source=source)
    assert run(recogniser(Script([(END, sentence), (END + 3000, sentence), (END + 5000, GARBLED)]))) == [sentence]


def test_a_sentence_without_any_sign_of_speech_is_found_and_somebody_speaks_meanwhile() -> None:
    listening = recogniser(Script(speech=()))
    assert run(listening, 0, AT) == []
    assert not listening.busy
    assert run(listening, AT, END) == []
    assert listening.busy
    the_sentence(run(listening, END))
    assert not listening.busy


def test_a_sentence_whose_signs_end_early_is_told_whole() -> None:
    the_sentence(run(recogniser(Script(speech=((AT, AT + 3000),)))))


def test_other_events_pass() -> None:
    held = Held(AT, AT + 100)
    assert run(recogniser(Script([(AT + 1600, held)]), Slow()), 0, AT + 1600) == [held]


def test_a_robot_that_was_cut_off_is_garbled_and_marked() -> None:
    whole = through_a_room(spoken("all, who is here"), 1)
    end = AT + len(whole) // 2
    event = Garbled(AT, end)
    script = Script([(end + 3000, event)], [(AT, end)])
    assert run(recogniser(script), sound=scene(160_000, (AT, whole[: len(whole) // 2]))) == [Garbled(AT, end, True)]


@pytest.mark.parametrize("event", [GARBLED, guess("stop", 0.9)])
def test_what_no_robot_is_known_to_have_said_stands(event: Event) -> None:
    stranger = through_a_room(spoken("hi rob, water rose", book=Book("elm")), 1)
    assert run(recogniser(Script([(END + 3000, event)])), sound=scene(160_000, (AT, stranger))) == [event]


@pytest.mark.parametrize("event", [GARBLED, guess()])
@pytest.mark.parametrize("after", [-5000, 20_000])
def test_a_worker_that_is_full_loses_nothing(event: Event, after: int) -> None:
    listening = recogniser(Script([(END + after, event)]), Slow(room=0))
    assert run(listening, 0, END + 24_000) == [event]
    assert run(listening, END + 24_000) == []
    assert not listening.busy


@pytest.mark.parametrize("event", [GARBLED, guess()])
def test_a_worker_that_is_slow_loses_nothing_and_is_not_waited_for(event: Event) -> None:
    worker = Slow()
    listening = recogniser(Script([(END + 3000, event)]), worker)
    assert run(listening, 0, END + MAX_WAIT) == []
    assert listening.busy
    assert run(listening, END + MAX_WAIT, END + MAX_WAIT + SAMPLE_RATE_HZ) == [event]
    assert not listening.busy
    worker.end()
    assert run(listening, END + MAX_WAIT + SAMPLE_RATE_HZ) == []


def test_a_sentence_that_seemed_to_go_on_and_did_not_is_garbled_in_time() -> None:
    whole = through_a_room(spoken("all, who is here"), 1)
    end = AT + len(whole) // 2
    sound = scene(160_000, (AT, whole[: len(whole) // 2]))
    told = run(recogniser(Script([(end + 800, Garbled(AT, end))], [(AT, end)])), 0, end + MAX_WAIT + 10_000, sound)
    assert told == [Garbled(AT, end, True)]


class Told(SynchronousWorker[ChannelSegment, SearchResult]):
    """A worker that finds the same in every stretch."""

    def __init__(self, result: SearchResult) -> None:
        super().__init__()
        self.result = result

    def submit(self, job: ChannelSegment, search: Callable[[ChannelSegment], SearchResult]) -> bool:
        self._found.append((job, self.result))
        return True


def paths_of_a_half() -> tuple[Path, ...]:
    """The paths in progress in the middle of a sentence."""
    whole = through_a_room(spoken("all, who is here"), 1)
    half = scene(AT + len(whole) // 2, (AT, whole[: len(whole) // 2]))
    going_on = fresh("oak").search(ChannelSegment(half, 0, AT, cut=True)).in_progress
    assert going_on
    return going_on


@pytest.mark.parametrize("robot", [False, True])
def test_what_a_person_said_is_not_held_because_some_path_seems_to_go_on(robot: bool) -> None:
    """A person's sentences were reported up to 40 s late, all at once when everybody was silent."""
    going_on = paths_of_a_half()
    result = SearchResult(best=going_on[0] if robot else None, in_progress=going_on)
    listening = recogniser(Script([(END + 800, GARBLED)]), Told(result))
    assert run(listening, 0, END + 10_000) == ([] if robot else [GARBLED])


@pytest.mark.parametrize("after", [True, False])
def test_a_sentence_is_held_for_long_only_if_it_may_be_the_beginning_of_one_in_progress(after: bool) -> None:
    """A sentence at another speaking rate was told up to 17 s late, while others spoke soon one after the other."""
    path = paths_of_a_half()[0]
    going_on = path.shifted(END - path.starts[0]) if after else path
    speech = [(AT, END), *((AT + at, AT + at + 8_000) for at in range(32_000, 96_000, 16_000))]
    event = guess()
    listening = recogniser(Script([(END + 800, event)], speech), Told(SearchResult(in_progress=(going_on,))))
    assert run(listening, 0, END + MAX_WAIT) == []
    assert run(listening, END + MAX_WAIT, END + MAX_WAIT + 2 * BLOCK) == ([event] if after else [])


def test_a_sentence_that_goes_on_is_looked_at_though_another_one_in_its_sound_was_told() -> None:
    """The louder of two robots that spoke at once was lost if it ended within a second after the other one."""
    path, heard = paths_of_a_half()[0], replace(guess(source=Source.CHANNEL, end=END + 4000), snr_db=SNR_DB)
    going_on = path.shifted(END + 4000 - path.end)
    worker = Told(SearchResult((heard,), in_progress=(going_on,), sure_at=END + 12_000))
    listening = recogniser(Script(), worker)
    assert run(listening, 0, END + 10_000) == [heard]
    other = replace(heard, words=("all", "who", "is", "here"), voice="willow")
    worker.result = SearchResult((other,))
    assert run(listening, END + 10_000, END + 60_000) == [other]


def test_a_path_contradicts_a_sentence_if_it_follows_other_words_through_most_of_it() -> None:
    """At another speaking rate the search followed a word or two, and no sentence was understood in quiet."""
    path = paths_of_a_half()[0]
    begin, length = path.starts[0], path.end - path.starts[0]
    assert contradicts(path, replace(guess(), start_sample=begin, end_sample=begin + 19 * length // 10))
    assert not contradicts(path, replace(guess(), start_sample=begin, end_sample=begin + 21 * length // 10))
    assert not contradicts(path, replace(guess("all who is here"), start_sample=begin, end_sample=path.end))
    assert not contradicts(None, replace(guess(), start_sample=begin, end_sample=path.end))


def test_where_a_recording_ends_nothing_is_held_any_more() -> None:
    whole = through_a_room(spoken("all, who is here"), 1)
    end = AT + len(whole) // 2
    sound = scene(160_000, (AT, whole[: len(whole) // 2]))
    listening = recogniser(Script([(end + 800, Garbled(AT, end))], [(AT, end)]))
    assert run(listening, 0, end + 10_000, sound) == []
    assert listening.flush() == [Garbled(AT, end, True)]
    assert listening.flush() == []


def test_a_sentence_of_a_robot_stands_only_with_a_word_that_is_said_otherwise_too() -> None:
    """And it is told at once, though the listener expects more words."""
    whole = through_a_room(spoken("all, who is here"), 1)
    end = AT + len(whole) // 2
    sound, event = scene(160_000, (AT, whole[: len(whole) // 2])), guess(end=end)
    for unmodelled, soon, late in (("lily", [event], []), ("rose", [], [Garbled(AT, end, True)])):
        script = Script([(end + 800, event)], [(AT, end)])
        searcher = ChannelRecogniser(GRAPH, (BOOKS["oak"],), unmodelled=frozenset((unmodelled,)))
        listening = alone(ChannelStage(script, searcher, SynchronousWorker()))
        assert (run(listening, 0, end + 10_000, sound), listening.flush()) == (soon, late)


def test_a_sentence_whose_signs_paused_is_looked_at_whole() -> None:
    script = Script([(AT + 13_000, Garbled(AT, AT + 8000))], [(AT, AT + 4000), (AT + 14_000, END)])
    the_sentence(run(recogniser(script)))


def test_the_own_voice_ends_a_stretch_and_is_not_looked_at() -> None:
    worker = Slow()
    sound = SOUND.copy()
    own = (END // BLOCK + 2) * BLOCK
    sound[own:] = 0.9
    run(recogniser(Script(), worker), 0, own + BLOCK, sound, [(own, len(sound))])
    [(job, _)] = worker.waiting
    assert np.abs(job.sound).max() < 0.9


def test_who_answers_the_own_voice_soon_is_heard_at_its_place() -> None:
    own = (AT - 4_000 - 16_000, AT - 4_000)
    the_sentence(run(recogniser(Script([(END + 3000, GARBLED)])), own=[own], block=200))


@pytest.mark.parametrize("gap", [0, 400])
def test_what_may_be_the_end_of_a_sentence_under_the_own_voice_is_garbled(gap: int) -> None:
    """The end of a sentence that the robot's own voice had covered was taken for "hi all, i am bot, resume"."""
    own = (AT - gap - 16_000, AT - gap)
    told = run(recogniser(Script([(END + 3000, GARBLED)])), own=[own], block=200)
    assert [type(event) for event in told] == [Garbled]


def test_lost_sound_ends_a_stretch_and_places_are_right_after_it() -> None:
    worker = Slow()
    listening = recogniser(Script(speech=((8000, 20_000), (AT, END))), worker)
    run(listening, 0, 16_000)
    assert worker.waiting == []
    listening.lost(AT - 4_000 - 16_000)
    assert len(worker.waiting) == 1
    run(listening, AT - 4_000, END + 12_000)
    worker.end()
    the_sentence(run(listening, END + 12_000))


def test_what_is_learned_in_the_middle_of_a_sentence_counts_for_it() -> None:
    listening = alone(ChannelStage(Script([(END + 2000, GARBLED)]), ChannelRecogniser(GRAPH, ()), SynchronousWorker()))
    run(listening, 0, AT + 8000)
    others = Script()
    listening.adopt(recogniser(others))
    assert listening.first_pass.learned is others  # type: ignore[attr-defined]
    the_sentence(run(listening, AT + 8000))


@pytest.mark.parametrize(("block", "event"), [(67, GARBLED), (400, guess()), (1000, GARBLED), (8000, guess())])
def test_blocks_may_have_any_size(block: int, event: Event) -> None:
    the_sentence(run(recogniser(Script([(END + 2000, event)])), block=block))


def test_what_is_no_sound_does_not_matter() -> None:
    sound = SOUND.copy()
    sound[AT - 20_000 : AT - 12_000] = np.nan
    sound[END + 10_000 :] = np.inf
    the_sentence(run(recogniser(Script([(END + 2000, GARBLED)])), sound=sound))
    assert run(recogniser(Script()), sound=np.full(len(SOUND), np.nan, np.float32)) == []
    assert recogniser(Script()).push(np.zeros(0, np.float32)) == []


def test_what_takes_long_is_made_ready_before_anybody_speaks() -> None:
    script, book = Script(), Book("oak")
    alone(ChannelStage(script, ChannelRecogniser(GRAPH, (book,)), SynchronousWorker())).prepare(lambda: True)
    assert script.prepared
    assert book.prepared


@pytest.mark.parametrize("at", [88_000, 100_000, 112_000])
def test_in_clatter_that_never_ends_a_sentence_is_told_whole_and_soon(at: int) -> None:
    sound = scene(200_000, (at, HEARD))
    told = run(recogniser(Script(speech=((0, len(sound)),))), 0, at + len(HEARD) + CUT_AFTER + GOES_ON_WITHIN, sound)
    assert [(event.words, event.source) for event in told if isinstance(event, Recognised)] == [(RIGHT, Source.CHANNEL)]


@pytest.mark.parametrize("at", range(CLATTER + 8_000, CLATTER + CUT_AFTER, 8_000))
def test_in_clatter_a_sentence_is_told_a_second_after_its_end_or_at_the_next_cut(at: int) -> None:
    """It was told at the next cut after that second, up to 2.25 s after its end."""
    sound = scene(CLATTER + 3 * CUT_AFTER, (at, HEARD))
    told = run(recogniser(Script(speech=((0, len(sound)),))), 0, at + len(HEARD) + CUT_AGAIN_AFTER + BLOCK, sound)
    assert [event.words for event in told if isinstance(event, Recognised)] == [RIGHT]


def test_wherever_clatter_is_cut_a_sentence_is_told_whole() -> None:
    at = 100_000
    sound = scene(200_000, (at, HEARD))
    for late in range(0, CUT_AFTER, CUT_AFTER // 4):
        told = run(recogniser(Script(speech=((late, len(sound)),))), 0, len(sound), sound)
        assert [event.words for event in told if isinstance(event, Recognised)] == [RIGHT]


def test_what_was_garbled_late_in_a_sentence_does_not_hide_its_beginning() -> None:
    the_sentence(run(recogniser(Script([(END + 2000, Garbled(END - 4000, END))]))))


@pytest.mark.parametrize("after", [2_000, 12_000])
def test_a_sentence_of_the_templates_is_looked_at_from_its_beginning_though_signs_of_speech_began_late(
    after: int,
) -> None:
    """In noise 10 dB above the voice, only the end of a long sentence was searched: "task two" became "task three"."""
    script = Script([(END + after, guess())], [(END - 8_000, END)])
    searcher = ChannelRecogniser(GRAPH, (BOOKS["oak"],), prepared=False)
    the_sentence(run(alone(ChannelStage(script, searcher, SynchronousWorker()))))


class ToldFirst(SynchronousWorker[ChannelSegment, SearchResult]):
    """A worker that finds something else in the first stretch."""

    def __init__(self, first: SearchResult) -> None:
        super().__init__()
        self.first: SearchResult | None = first

    def submit(self, job: ChannelSegment, search: Callable[[ChannelSegment], SearchResult]) -> bool:
        first, self.first = self.first, None
        return super().submit(job, search if first is None else lambda _: first)


def test_a_path_that_seems_to_begin_late_does_not_hide_the_beginning_of_a_sentence_of_the_templates() -> None:
    path = paths_of_a_half()[0]
    late = path.shifted(END - 6_000 - path.starts[0])
    script = Script([(END + 12_000, guess())], [(END - 8_000, END)])
    searcher = ChannelRecogniser(GRAPH, (BOOKS["oak"],), prepared=False)
    the_sentence(run(alone(ChannelStage(script, searcher, ToldFirst(SearchResult(in_progress=(late,)))))))


def test_what_a_search_made_is_forgotten_once_nobody_has_spoken_for_a_while() -> None:
    listening = recogniser(Script([(END + 2000, guess())]))
    run(listening)
    assert blocks_of.cache_info().currsize > 0
    quiet = np.zeros(HISTORY_SAMPLES + SAMPLE_RATE_HZ, np.float32)
    run(listening, 0, len(quiet), quiet)
    assert blocks_of.cache_info().currsize == 0


def test_a_worker_that_never_answers_keeps_no_old_stretches_in_memory() -> None:
    events = [(at, Garbled(at - 8000, at)) for at in range(2 * CLATTER, 6 * CLATTER, SAMPLE_RATE_HZ)]
    sound = scene(6 * CLATTER)
    worker: Slow[ChannelSegment, SearchResult] = Slow(room=99)
    worker.waiting = deque(maxlen=1)
    listening = recogniser(Script(events, ((0, len(sound)),)), worker)
    run(listening, 0, len(sound), sound)
    gc.collect()
    assert sum(isinstance(each, ChannelSegment) for each in gc.get_objects()) < 12


def test_a_sentence_that_the_own_voice_cut_off_does_not_keep_the_next_one_from_being_looked_at_whole() -> None:
    whole = through_a_room(spoken("all, who is here"), 1)
    begin, cut = 14_000, 7 * len(whole) // 10
    sound = SOUND + scene(len(SOUND), (begin, whole[:cut]))
    own = (begin + cut, begin + cut + 6_000)
    signs = [(begin, own[0]), (AT, AT + 4000), (AT + 14_000, END)]
    script = Script([(AT + 13_000, Garbled(AT, AT + 8000))], signs)
    told = run(recogniser(script), sound=sound, own=[own], block=400)
    the_sentence([event for event in told if isinstance(event, Recognised)])
