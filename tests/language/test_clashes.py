"""Words of a team that could be taken for other words of its phrasebook."""

import pytest

from hvcpd.errors import VocabularyError
from hvcpd.language.phrasebook import Phrasebook, Vocabulary

NUMBERS = (1, 2, 3, 4, 5)


def _book(*tasks: str, remarks: tuple[str, ...] = ()) -> Phrasebook:
    return Phrasebook(Vocabulary(("Rob", "Bot"), ("plant",), ("water the rose", *tasks), NUMBERS, remarks))


@pytest.mark.parametrize(
    ("task", "sentence"),
    [
        ("member of team plant", "hi i am rob member of team plant"),
        ("member of team plant water the rose", "hi i am rob member of team plant water the rose"),
        ("i am rob", "hello i am rob"),
        ("task four", "all complete task four"),
        ("task forty two", "all complete task forty two"),
        ("complete task forty two", "all complete task forty two"),
        ("rob says", "hello i am bot rob says confirmed"),
        ("two metres", "move back two metres"),
        ("spell your name", "hello i spell alpha spell your name"),
    ],
)
def test_a_task_that_is_a_part_of_another_sentence_is_refused_with_that_sentence(task: str, sentence: str) -> None:
    """The team was blamed for the first, and the others were taken."""
    with pytest.raises(VocabularyError) as refused:
        _book(task)
    assert str(refused.value) == (
        f"the task '{task}' can be mistaken for another sentence of the phrasebook, as in '{sentence}': rename it"
    )
    assert refused.value.key == "tasks"


def test_so_is_a_remark() -> None:
    with pytest.raises(VocabularyError, match=r"^the remark 'task four' can be mistaken for another sentence"):
        _book(remarks=("task four",))


@pytest.mark.parametrize("task", ["say hello", "change the battery", "report to bot", "task force one", "come in"])
def test_words_of_the_phrasebook_in_another_order_are_a_teams_own(task: str) -> None:
    assert _book(task).parse_text(f"Hi Rob, I am Bot, {task}")


@pytest.mark.parametrize("slot", ["tasks", "teams", "places"])
def test_a_friend_is_any_name_and_so_no_word_of_what_people_say(slot: str) -> None:
    """ "Rob, visit a friend" ended the search with an error; "visit a dragon" was heard as it."""
    with pytest.raises(VocabularyError, match="'visit a friend' has the word 'friend', by which any name is heard"):
        Phrasebook(Vocabulary(("Rob", "Bot"), **{slot: ("visit a friend",)}))
    assert _book(remarks=("hello my friend",))


def test_all_words_that_clash_are_told_at_once() -> None:
    """One at a time, each start told the next."""
    with pytest.raises(VocabularyError) as refused:
        _book("stop the pump", "task four", "!?", remarks=("i am rob",))
    lines = refused.value.at(lambda written: "tasks.yaml").splitlines()
    assert [line.partition("' ")[0] for line in lines] == [
        "tasks.yaml: the task '!?",
        "tasks.yaml: the task 'stop the pump",
        "tasks.yaml: the task 'task four",
        "tasks.yaml: the remark 'i am rob",
    ]
    with pytest.raises(VocabularyError, match=r"^'Stop' is a word .*\n'all' is a word ") as refused:
        Phrasebook(Vocabulary(("Stop", "Bot", "all")))
    assert [line.split(":")[0] for line in refused.value.at(lambda written: "tasks.yaml").splitlines()] == [
        "names",
        "names",
    ]


@pytest.mark.parametrize(("word", "phrase"), [("rose", "stop"), ("rose", "please resume"), ("stop", "resume")])
def test_no_alternative_has_a_word_in_it_that_halts_or_releases(word: str, phrase: str) -> None:
    """ "Stop" within a sentence would have been taken for a rose."""
    with pytest.raises(VocabularyError, match=f"^alternatives: '{phrase}' cannot count as '{word}', because '"):
        Phrasebook(Vocabulary(("Rob",), tasks=("water the rose",), alternatives=((word, phrase),)))
