"""The phrasebook: one source for saying, hearing, understanding and printing."""

import gc
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import PhraseError, VocabularyError
from hvcpd.language import messages as m
from hvcpd.language.card import Topic, as_markdown, as_text, make_card
from hvcpd.language.forms import Kind
from hvcpd.language.graph import WordGraph
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.language.words import number_words, spoken_phrases, spoken_words

ROSES = tuple(f"water the {colour} rose" for colour in ("green", "violet", "indigo", "orange", "yellow", "red"))
BOOK = Phrasebook(
    Vocabulary(("Rob", "Bot", "R2D2"), ("plant", "a"), ROSES, (1, 2, 3, 4, 5, 21), ("the roses look thirsty",))
)
YELLOW = m.TaskByName("water the yellow rose")


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("Hi, I am Rob", m.Utterance("Rob")),
        ("Hi all, I am Rob, member of team plant", m.Utterance("Rob", m.ToAll(), "plant")),
        ("hello all i am rob member of team a", m.Utterance("Rob", m.ToAll(), "a")),
        (
            "Hi all, I am Rob, completing task: water the red rose",
            m.Utterance("Rob", m.ToAll(), None, m.Working(m.TaskByName("water the red rose"))),
        ),
        (
            "Hi all, I am Rob, member of team plant, completing task, water the red rose",
            m.Utterance("Rob", m.ToAll(), "plant", m.Working(m.TaskByName("water the red rose"))),
        ),
        (
            "Hi, [team plant], I am Rob, I will complete task: 1",
            m.Utterance("Rob", m.ToTeam("plant"), None, m.Claim(m.TaskByNumber(1))),
        ),
        ("Hi, Rob, I am Bot, water the yellow rose!", m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(YELLOW))),
        ("Hi Bot, I am Rob, I will water the yellow rose", m.Utterance("Rob", m.ToRobot("Bot"), None, m.Claim(YELLOW))),
        ("Hi all, I am Bot, task one complete", m.Utterance("Bot", m.ToAll(), None, m.Completed(m.TaskByNumber(1)))),
        ("Hi all, I am Bot, task 21 failed", m.Utterance("Bot", m.ToAll(), None, m.Failed(m.TaskByNumber(21)))),
        (
            "Hi all, I am Bot, task one complete, I will complete task two",
            m.Utterance("Bot", m.ToAll(), None, m.Completed(m.TaskByNumber(1), m.TaskByNumber(2))),
        ),
        (
            "Hi Bot, I am R2D2, Rob says, I will water the yellow rose",
            m.Utterance("R2D2", m.ToRobot("Bot"), None, m.Relayed("Rob", m.Claim(YELLOW))),
        ),
        (
            "Hi Rob, I am Bot, task one and three and twenty one left",
            m.Utterance(
                "Bot",
                m.ToRobot("Rob"),
                None,
                m.Left(m.TaskByNumber(1), m.TaskByNumber(3), m.TaskByNumber(21)),
            ),
        ),
        (
            "Hi all, I am Bot, task 2 and more left",
            m.Utterance("Bot", m.ToAll(), None, m.Left(m.TaskByNumber(2), more=True)),
        ),
        ("Hi all, I am Bot, nothing left", m.Utterance("Bot", m.ToAll(), None, m.Left())),
        ("Hi Rob, what are you doing?", m.Utterance(None, m.ToRobot("Rob"), None, m.WhatDoing())),
        ("Who is here?", m.Utterance(None, None, None, m.WhoHere())),
        ("Hi Rob", m.Utterance(None, m.ToRobot("Rob"), None, m.Hail())),
        ("What is left", m.Utterance(None, None, None, m.WhatLeft())),
        ("Rob, come back", m.Utterance(None, m.ToRobot("Rob"), None, m.ComeBack())),
        ("Move forward two metres", m.Utterance(None, None, None, m.MoveBy(2.0))),
        ("Hello Rob, move back half a metre", m.Utterance(None, m.ToRobot("Rob"), None, m.MoveBy(0.5, True))),
        ("Turn left", m.Utterance(None, None, None, m.TurnBy(90.0))),
        (
            "Hi Bot, I am Rob, I will turn around",
            m.Utterance("Rob", m.ToRobot("Bot"), None, m.WillMove(m.TurnBy(180.0))),
        ),
        ("Hi Bot, I am Rob, say again slowly", m.Utterance("Rob", m.ToRobot("Bot"), None, m.SayAgain(True))),
        ("Stop", m.Utterance(None, None, None, m.Stop())),
        ("Rob, please come back", m.Utterance(None, m.ToRobot("Rob"), None, m.ComeBack())),
        ("Turn left, please", m.Utterance(None, None, None, m.TurnBy(90.0))),
        ("Please stop", m.Utterance(None, None, None, m.Stop())),
        ("Rob stop, please", m.Utterance(None, m.ToRobot("Rob"), None, m.Stop())),
        ("Who is here, please?", m.Utterance(None, None, None, m.WhoHere())),
        ("Hi Rob, I am Bot, please resume", m.Utterance("Bot", m.ToRobot("Rob"), None, m.Resume())),
        ("Hi Rob, I am Bot, please say again", m.Utterance("Bot", m.ToRobot("Rob"), None, m.SayAgain())),
        (
            "Hi Rob, I am Bot, please water the yellow rose",
            m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(YELLOW)),
        ),
        ("Hi all, I am Bot, report", m.Utterance("Bot", m.ToAll(), None, m.ReportWanted())),
        ("All, report, please", m.Utterance(None, m.ToAll(), None, m.ReportWanted())),
        (
            "Hi Bot, I am Rob, member of team plant, report, completing task two, battery 11 and a half volts",
            m.Utterance("Rob", m.ToRobot("Bot"), "plant", m.Report(m.Doing.WORKING, m.TaskByNumber(2), 11.5)),
        ),
        ("Hi all, I am Rob, report, I am free", m.Utterance("Rob", m.ToAll(), None, m.Report(m.Doing.FREE))),
        ("R2D2 stop", m.Utterance(None, m.ToRobot("R2D2"), None, m.Stop())),
    ],
)
def test_the_papers_forms_are_understood(text: str, meaning: m.Utterance) -> None:
    assert BOOK.parse_text(text) == meaning


def test_an_utterance_is_written_as_a_person_would() -> None:
    assert BOOK.write(m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(YELLOW))) == (
        "Hi Rob, I am Bot, water the yellow rose"
    )
    assert BOOK.write(m.Utterance("R2D2", m.ToAll(), "plant")) == "Hi all, I am R2D2, member of team plant"
    assert BOOK.write(m.Utterance(None, m.ToRobot("Bot"), None, m.Stop())) == "Bot stop"


def test_a_word_that_is_also_a_robots_name_has_a_capital_only_where_it_is_a_name() -> None:
    """It wrote "task Seven, Seven metres" and "water the green Rose" for a team of Seven and Rose."""
    tasks = ("water the green rose",)
    book = Phrasebook(
        Vocabulary(
            names=("Seven", "Rose"), teams=("plant",), tasks=tasks, numbers=(1,), remarks=("thank you, Rose", "hurrah")
        )
    )
    for text in (
        "Hi Rose, I am Seven, water the green rose",
        "Hi Seven, I am Rose, confirmed seven",
        "Hi team plant, I am Seven, I will complete task seven, seven metres",
        "Hi all, I am Rose, Seven says, I will complete task seven",
        "Rose stop",
        "Hi all, I am Seven, thank you Rose",
        "Hi all, I am Rose, hurrah",
    ):
        assert book.write(book.parse_text(text)) == text


def test_a_robot_pauses_at_the_commas_of_a_remark() -> None:
    remark = "Dinner is ready, please come, Rob!"
    book = Phrasebook(Vocabulary(("Rob",), remarks=(remark,)))
    said = book.phrases(book.parse_text(f"Hi all, I am Rob, {remark}"))
    assert said[2:] == spoken_phrases(remark)
    at, rests = book.graph.start, []
    for phrase in said:
        for word in phrase:
            at = dict(book.graph.following[at])[word]
        rests.append(at)
    assert book.graph.rests.issuperset(rests)


def test_a_remark_keeps_the_capitals_of_names_and_of_i_before_an_apostrophe() -> None:
    """It wrote "rob's cup" and "i'm done"."""
    book = Phrasebook(Vocabulary(("Rob", "Rose"), remarks=("Rob's rose is dry, and I'm done",)))
    text = "Hi all, I am Rose, Rob's rose is dry and I'm done"
    assert book.write(book.parse_text(text)) == text


def test_our_voices_say_a_mere_greeting_as_the_question_that_robots_hear() -> None:
    hail = BOOK.parse_text("Hello Rob")
    assert BOOK.write(hail) == "Hi Rob"
    assert BOOK.write(m.for_robots(hail)) == "Rob, who is here"


@pytest.mark.parametrize("text", ["Rob, complete task two", "Rob, confirmed", "Hi Rob, I am friend, negative"])
def test_no_voice_of_ours_leaves_out_who_speaks(text: str) -> None:
    """`hvcpctl say` made sound of it that no robot understands."""
    with pytest.raises(PhraseError, match=r"with a robot's voice say 'Hi Rob, I am NAME, …'"):
        m.for_robots(BOOK.parse_text(text))


def test_robots_never_say_please() -> None:
    rng = random.Random(3)
    assert not any("please" in BOOK.render(BOOK.sample(rng)) for _ in range(500))


def test_one_word_alone_asks_for_no_report() -> None:
    with pytest.raises(PhraseError):
        BOOK.parse_text("report")


def test_commas_group_the_words_into_phrases() -> None:
    order = m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(YELLOW))
    assert BOOK.phrases(order) == (("hi", "rob"), ("i", "am", "bot"), ("water", "the", "yellow", "rose"))


@given(st.integers(0, 2**32))
def test_what_is_said_is_what_is_understood(seed: int) -> None:
    utterance = BOOK.sample(random.Random(seed))
    assert BOOK.parse(BOOK.render(utterance)) == utterance
    assert BOOK.parse_text(BOOK.write(utterance)) == utterance


def _accepts(graph: WordGraph, words: tuple[str, ...]) -> bool:
    node = graph.start
    arcs = {(arc.source, arc.word): arc.target for arc in graph.arcs}
    for word in words:
        if (node, word) not in arcs:
            return False
        node = arcs[node, word]
    return node in graph.finals


def _path(graph: WordGraph, rng: random.Random) -> tuple[str, ...]:
    """The words of a random path from the start to a final node."""
    node, words = graph.start, []
    while graph.following[node] and not (node in graph.finals and rng.random() < 0.3):
        word, node = rng.choice(graph.following[node])
        words.append(word)
    return tuple(words)


@given(st.integers(0, 2**32))
def test_the_network_accepts_every_sentence_and_each_of_its_paths_is_one(seed: int) -> None:
    rng = random.Random(seed)
    assert _accepts(BOOK.graph, BOOK.render(BOOK.sample(rng)))
    meaning = BOOK.parse(_path(BOOK.graph, rng))
    assert BOOK.parse(BOOK.render(meaning)) == meaning


@given(st.integers(0, 2**32))
def test_the_robots_network_has_what_robots_say_and_nothing_else(seed: int) -> None:
    rng = random.Random(seed)
    assert _accepts(BOOK.robots_graph, BOOK.render(BOOK.sample(rng)))
    words = _path(BOOK.robots_graph, rng)
    assert BOOK.render(BOOK.parse(words)) == words


def test_the_network_is_deterministic_and_merges_equal_tails() -> None:
    graph = BOOK.graph
    keys = [(arc.source, arc.word) for arc in graph.arcs]
    assert len(keys) == len(set(keys))
    tails = {
        (frozenset((a.word, a.target) for a in graph.arcs if a.source == n), n in graph.finals, n in graph.pauses)
        for n in range(graph.n_nodes)
    }
    assert len(tails) == graph.n_nodes


def test_pauses_stand_where_the_commas_are() -> None:
    arcs = {(arc.source, arc.word): arc.target for arc in BOOK.graph.arcs}
    node, paused = BOOK.graph.start, []
    for word in BOOK.render(m.Utterance("Bot", m.ToRobot("Rob"), None, m.Order(YELLOW))):
        if node in BOOK.graph.pauses:
            paused.append(word)
        node = arcs[node, word]
    assert paused == ["rob", "i", "water"]  # before "rob", because "Hi, I am Bot" begins alike


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Hi Rob, I am Bot, water the yelow rose", "did you mean 'yellow'"),
        ("Rob, compleet task three", "'compleet' is not in the phrasebook after 'rob'; did you mean 'complete'?"),
        ("Rob, waiter the yellow rose", "did you mean 'water'?"),
        ("Rob", "it could go on with: come, complete, confirmed, "),
        ("Hi Rob, I am", "breaks off after 'hi rob i am'"),
        ("Hi Zorg", "'zorg' is not in the phrasebook after 'hi'"),
        ("", "no word to say"),
        ("\x00\u2620", "is not in the phrasebook at the beginning"),
        ("Hi Bot, I am Rob, task -1 complete", "'-1' is not in the phrasebook after"),
        ("Rob, move forward .5 m", "'.5' is not in the phrasebook after"),
        ("Rob, move back (,5 m)", "',5' is not in the phrasebook after"),
        ("Rob, move forward \N{EN DASH}5 m", "'\N{EN DASH}5' is not in the phrasebook after"),
        ("Hi, I am Rob, \u043f\u0440\u0438\u0432\u0435\u0442", "is not in the phrasebook after"),
        ("Hi, I am Rob, \U0001f642", "is not in the phrasebook after"),
        ("Rob stop now", "'now' is not in the phrasebook after 'rob stop'"),
        ("dance " * 10_000, "'dance' is not in the phrasebook at the beginning"),
        ("a" * 20_000, f"'{'a' * 40}' is not in the phrasebook at the beginning"),
        ("Hi " + "a" * 20_000, "is not in the phrasebook after 'hi'; possible there:"),
        ("Rob, complete task twelve", "'twelve' is not in the phrasebook after 'rob complete task'; possible there:"),
        ("Rob, complete task", "breaks off after 'rob complete task'; it could go on with:"),
        ("Hi all, I am Rob, I will complete task two one", "it could go on with: metre, or end before 'one'"),
    ],
)
def test_other_sentences_are_refused_with_the_place_and_a_hint(text: str, said: str) -> None:
    with pytest.raises(PhraseError) as caught:
        BOOK.parse_text(text)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 500


@given(st.text(max_size=60))
def test_any_text_is_a_sentence_or_a_phrase_error(text: str) -> None:
    try:
        utterance = BOOK.parse_text(text)
    except PhraseError:
        return
    assert BOOK.parse(BOOK.render(utterance)) == utterance


@pytest.mark.parametrize(
    "vocabulary",
    [
        Vocabulary(names=("Rob", "rob")),
        Vocabulary(names=("Rob",), tasks=("complete task one",)),
        Vocabulary(names=("Rob",), tasks=("say again",)),
        Vocabulary(names=("Rob",), tasks=("water the rose", "Water  the rose")),
        Vocabulary(names=("Team",)),
        Vocabulary(names=("all",)),
        Vocabulary(names=("Stop",)),
        Vocabulary(names=("Rob",), teams=("plant", "Plant")),
        Vocabulary(names=("Rob",), tasks=("!!!",)),
    ],
)
def test_a_vocabulary_that_is_ambiguous_is_refused(vocabulary: Vocabulary) -> None:
    with pytest.raises(PhraseError):
        Phrasebook(vocabulary)


@pytest.mark.parametrize(
    "task",
    ["turn left", "come back", "complete task two", "move forward two metres", "move forward", "stop it", "rob stop"],
)
def test_the_task_that_reads_as_another_sentence_is_blamed_not_the_name_before_it(task: str) -> None:
    with pytest.raises(VocabularyError, match=f"^the task '{task}' can be mistaken for ") as refused:
        Phrasebook(Vocabulary(names=("Rob", "Bot"), tasks=(task, "shelve the novels")))
    assert refused.value.key == "tasks"


@pytest.mark.parametrize(
    ("more", "named", "key"),
    [
        ({"teams": ("stop",)}, "the team 'stop'", "teams"),
        ({"places": ("bus stop",)}, "the place 'bus stop'", "tasks"),
        ({"remarks": ("please stop here",)}, "the remark 'please stop here'", "tasks"),
        ({"failures": ("the motors stop",)}, "the reason 'the motors stop'", "tasks"),
        ({"remarks": ("who is here",)}, "the remark 'who is here'", "tasks"),
    ],
)
def test_nothing_of_a_teams_own_halts_or_commands(more: dict[str, tuple[str, ...]], named: str, key: str) -> None:
    """A robot that said it would halt all that hear it."""
    with pytest.raises(VocabularyError, match=f"^{named} can be mistaken for a command") as refused:
        Phrasebook(Vocabulary(names=("Rob", "Bot"), tasks=("shelve the novels",), **more))
    assert refused.value.key == key


def test_an_unknown_name_or_task_cannot_be_rendered() -> None:
    with pytest.raises(PhraseError):
        BOOK.render(m.Utterance("Zorg"))
    with pytest.raises(PhraseError):
        BOOK.render(m.Utterance("Rob", None, None, m.Order(m.TaskByName("water the blue rose"))))


@given(st.integers(0, 99))
def test_numbers_are_read_in_words(number: int) -> None:
    assert spoken_words(f"task {number}") == ("task", *number_words(number))


def test_words_are_taken_from_any_writing() -> None:
    assert spoken_words("Hi,\tRob’s… N°21 café-7!") == ("hi", "rob's", "n", "twenty", "one", "cafe", "seven")
    assert spoken_words("101 R2D2") == ("101", "r2d2")
    assert spoken_words("1st 12th 20th 43rd") == ("first", "twelfth", "twentieth", "forty", "third")


def test_forms_can_be_left_out() -> None:
    robots_only = Vocabulary(("Rob", "Bot"), kinds=frozenset({Kind.CORE}))
    with pytest.raises(PhraseError):
        Phrasebook(robots_only).parse_text("Rob, come back")
    assert len(Phrasebook(robots_only).graph.arcs) < len(Phrasebook(Vocabulary(("Rob", "Bot"))).graph.arcs)
    assert "come back" not in as_text(make_card(Phrasebook(robots_only)))


def test_the_card_has_every_form_and_word() -> None:
    card = make_card(BOOK)
    for page in (as_text(card), as_markdown(card)):
        for word in (
            "R2D2",
            "water the violet rose",
            "twenty one",
            "the roses look thirsty",
            "resume",
            "come back",
            "half a metre",
        ):
            assert word in page


def test_a_new_word_network_leaves_nothing_that_only_a_garbage_collection_frees() -> None:
    book = Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), ROSES, (1, 2)))
    gc.collect()
    gc.disable()
    try:
        assert book.marked_graph.words
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_without_names_nobody_says_one() -> None:
    book = Phrasebook(Vocabulary(tasks=("water the rose",)))
    assert {book.sample(random.Random(seed)).speaker for seed in range(30)} == {None}


def test_people_whose_names_are_not_known_are_called_friend() -> None:
    """Robots speak to them and of them, and understand that one speaks; none says that it is one."""
    book = Phrasebook(Vocabulary(("Rob", "Bot"), tasks=("water the rose",)))
    busy, order = (
        m.Utterance("Rob", m.ToRobot("friend"), None, m.Busy()),
        tuple("hi rob i am friend water the rose".split()),
    )
    assert book.write(busy) == "Hi friend, I am Rob, I am busy"
    assert _accepts(book.robots_graph, book.render(busy))
    assert _accepts(book.people_graph, order)
    assert not _accepts(book.robots_graph, order)
    assert not _accepts(book.people_graph, tuple("hi friend i am rob water the rose".split()))
    assert book.parse(order).speaker == "friend"
    with pytest.raises(VocabularyError, match="Friend"):
        Phrasebook(Vocabulary(("Rob", "Friend")))


def test_the_card_tells_how_to_give_work_and_how_to_answer_beside_the_opening() -> None:
    """Orders and answers without a name, which only people's networks have, had taken their places."""
    card = make_card(Phrasebook(Vocabulary(("Rob", "Bot"), tasks=("water the rose",))))
    said = {line.topic: [each.say for each in card.statements if each.topic is line.topic] for line in card.statements}
    assert said[Topic.WORK] == ["complete task NUMBER", "TASK"]
    assert {"confirmed", "negative", "say again"} <= set(said[Topic.ANSWER])
    assert dict(card.words)["NAME"] == ("Rob", "Bot")
    assert "friend" not in dict(card.words)["WHO"]
