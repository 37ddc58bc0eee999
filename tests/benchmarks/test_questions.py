"""Questions asked of a transcript are answered from its words, and from nothing else."""

from benchmarks.questions import Transcript, ask

TOLD = (
    (3.0, "Hi team plant, I am Rob, I will complete task three, four metres"),
    (9.0, "Hi Rob, I am Bot, I will complete task three, one metre"),
    (14.0, "Hi Bot, I am Rob, confirmed three, I will complete task five and twelve"),
    (30.0, "Stop"),
    (33.0, "Hi all, I am Bot, I have stopped"),
    (60.0, "Hi all, I am Bot, task three failed, the tank is empty"),
    (70.0, "Hi all, I am Rob, task five and twelve complete, I will complete task three"),
    (80.0, "Hi Rob, I am Bot, confirmed five and twelve complete"),
)


def test_answers_come_from_the_words() -> None:
    told = Transcript(TOLD)
    assert told.doers(75.0) == {5: ("Rob", 70.0), 12: ("Rob", 70.0)}
    assert told.doers(69.0) == {}
    assert [told.owner(3, at_s) for at_s in (5.0, 40.0, 65.0, 75.0)] == ["Rob", "Bot", None, "Rob"]
    assert told.failures() == [("Bot", 3, "the tank is empty")]
    assert told.stopped() == {"Bot"}


def test_nearly_all_questions_about_a_mission_are_answered() -> None:
    answers = [each for seed in range(3) for each in ask(seed)]
    assert len(answers) == 60
    assert sum(right for _, right in answers) >= 57
