"""`hvcpctl check-vocabulary`, and the refusal of confusable words when a mission starts."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.assembly.vocabulary import (
    FIXED_WORDS,
    LIMIT_NOISE,
    check,
    refusal,
)
from hvcpd.config.settings import DEFAULT_TEAMS, Settings
from hvcpd.config.shared_places import SharedPlace
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskDefinition, TaskRepository, Wait, default_tasks_path
from hvcpd.control.cli import main
from hvcpd.control.say.check_vocabulary import SHOWN
from hvcpd.daemon.preflight import find_confusable
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import EX_CONFIG
from hvcpd.language.clashes import RESERVED_WORDS
from hvcpd.language.rewording import SYNONYMS_PATH, known_names
from hvcpd.synthesis.lexicon import Lexicon, Origin
from hvcpd.synthesis.voices import VOICES, voice_for
from tests.control.conftest import Ran, Refuse

pytestmark = pytest.mark.slow

EIGHT = tuple("Rob Bot Max Zoe Ada Kim Zorg R2D2".split())


def task_file(folder: Path, *names: str) -> Path:
    lines = [f"  - {{number: {n}, name: {name}, actions: [{{wait: 1}}]}}" for n, name in enumerate(names, start=1)]
    path = folder / "tasks.yaml"
    path.write_text("\n".join(["tasks:", *lines]) + "\n")
    return path


def repository(*names: str) -> TaskRepository:
    return TaskRepository(tuple(TaskDefinition(n, name, None, (Wait(1),)) for n, name in enumerate(names, start=1)))


@pytest.fixture
def sound() -> Sound:
    return make_sound(None, user_cache_folder())


def test_of_two_articles_none_is_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It said: instead of 'a' say for example 'big a' or 'little a'."""
    main(["check-vocabulary", "--tasks", str(task_file(tmp_path, "greet the visitor", "greet a visitor"))])
    assert "by the words 'a' and 'the'; reword one of them" in capsys.readouterr().out


def test_the_default_team_passes(ran: Ran) -> None:
    out = ran("check-vocabulary")
    assert "No words of this team are predicted to be confused" in out
    assert "three | two" in out
    head, *rows = out.splitlines()
    column = head.index("voice")
    assert all(row[column - 1] == " " and row[column] != " " for row in rows[:SHOWN]), (
        "each column stands below its head"
    )


def test_a_word_inside_a_task_that_sounds_like_a_command_is_refused(sound: Sound) -> None:
    tasks = repository("fill the stopp", "water the rose")
    found = check(make_phrasebook(("Rob", "Bot"), DEFAULT_TEAMS, tasks), ("Rob",), sound)
    text = refusal(found, Path("tasks.yaml"), allowable=False)
    assert text is not None
    assert text.startswith("tasks.yaml: 'stop' and 'stopp' sound the same; reword 'stopp'")


def test_confusable_tasks_are_listed_worst_first_with_replacements(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tasks = task_file(tmp_path, "water the lamp rose", "water the land rose", "paint the red box", "paint the read box")
    assert main(["check-vocabulary", "--tasks", str(tasks)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("read | red ")
    assert "same sound" in lines[1]
    assert any(line.startswith("lamp | land ") for line in lines[2:4])
    assert any(
        line.startswith("'Hi, I am Bot, paint the read box' and 'Hi, I am Bot, paint the red box' sound the same")
        for line in lines
    )
    assert any("instead of 'lamp' say for example 'lantern'" in line for line in lines)


def test_json_has_one_pair_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tasks = task_file(tmp_path, "water the lamp rose", "water the land rose")
    assert main(["check-vocabulary", "--json", "--tasks", str(tasks)]) == 1
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    worst = next(row for row in rows if (row["first"], row["second"]) == ("lamp", "land"))
    assert worst["confusable"]
    assert not worst["same_sound"]
    assert worst["quiet"] < worst["at_0_db"] < worst["at_minus_5_db"] < 0.5
    assert worst["at_0_db"] > LIMIT_NOISE
    assert worst["sentences"] == ["Hi, I am Bot, water the lamp rose", "Hi, I am Bot, water the land rose"]
    assert len(worst["proposals"]) == 2
    assert not {"lamp", "rose", "land"} & set(worst["proposals"])


@pytest.mark.parametrize(
    ("tasks", "near"),
    [
        (("water the lamp rose", "water the land rose"), {"lantern", "light", "candle"}),
        (("bring the book", "bring the hook"), {"notebook", "volume", "novel", "manual"}),
        (("bring the zorb", "bring the zorp"), {"big zorb", "little zorb", "old zorb", "new zorb"}),
    ],
)
def test_what_is_proposed_is_near_in_meaning_and_passes(tasks: tuple[str, ...], near: set[str], sound: Sound) -> None:
    book = make_phrasebook(("Rob",), (), repository(*tasks))
    offender = next(c for c in check(book, ("Rob",), sound, chosen_only=True) if c.confusable and not c.fixed)
    assert offender.key == "tasks"
    assert set(offender.proposals) <= near
    assert offender.proposals
    for phrase in offender.proposals:
        changed = [" ".join(phrase if word == offender.subject else word for word in task.split()) for task in tasks]
        after = make_phrasebook(("Rob",), (), repository(*changed))
        assert refusal(check(after, ("Rob",), sound, chosen_only=True), Path("tasks.yaml")) is None


def test_a_place_is_reworded_and_not_its_article(sound: Sound) -> None:
    tasks = replace(repository("water the red rose"), places=(SharedPlace("free", 0.0, 0.0, 1.0, 1.0),))
    found = check(make_phrasebook(("Rob",), (), tasks), ("Rob",), sound)
    assert [c.subject for c in found if c.confusable and not c.fixed] == ["free"]


def test_a_name_is_replaced_by_a_name(sound: Sound) -> None:
    names = ("Anna", "Anne")
    book = make_phrasebook(names, (), repository("water the red rose"))
    found = check(book, names, sound, chosen_only=True)
    why = refusal(found, Path("tasks.yaml"))
    assert why is not None
    assert why.startswith("names: 'Anna, stop' and 'Anne, stop' ")
    (pair,) = (c for c in found if c.confusable and not c.fixed)
    assert pair.proposals
    assert set(pair.proposals) <= {*known_names(), "Anna2", "Anna7", "Anna9"} - {"Anna", "Anne"}


def test_a_word_of_every_list_can_be_said() -> None:
    lexicon = Lexicon.load()
    lines = [line for line in SYNONYMS_PATH.read_text().splitlines() if not line.startswith("#")]
    words = {word.lower() for line in lines for word in line.removeprefix("names:").split()}
    assert {word for word in words if lexicon.find(word).origin is Origin.LETTERS} == set()


def test_bad_input(refused: Refuse, tmp_path: Path) -> None:
    assert "no such file" in refused("check-vocabulary", "--tasks", tmp_path / "none.yaml")
    assert "R2-D2" in refused("check-vocabulary", "--names", "R2-D2")
    assert "sounds like the phrasebook's word 'did'" in refused("check-vocabulary", "--names", "Ted,Mia")


def test_a_mission_with_confusable_tasks_is_refused(refused: Refuse, tmp_path: Path) -> None:
    tasks = task_file(tmp_path, "water the lamp rose", "water the land rose")
    message = refused("simulate", "--tasks", tasks, "--json")
    line = 1 + next(n for n, line in enumerate(tasks.read_text().splitlines()) if "lamp" in line)
    assert f"{tasks}:{line}: 'Hi, I am Bot, water the lamp rose' and 'Hi, I am Bot, water the land rose'" in message
    assert "instead of 'lamp' say for example 'lantern'" in message
    assert "%" not in message
    assert "--allow-confusable" in message


def test_confusable_tasks_can_be_allowed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tasks = task_file(tmp_path, "water the red rose", "water the read rose")
    main(["simulate", "--robots", "Rob", "--tasks", str(tasks), "--json", "--allow-confusable"])
    out, err = capsys.readouterr()
    assert err == ""
    assert '"Summary"' in out or '"summary"' in out


def test_eight_usual_names_and_the_default_tasks_pass(sound: Sound) -> None:
    book = make_phrasebook(EIGHT, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
    assert refusal(check(book, EIGHT, sound, chosen_only=True), Path("tasks.yaml")) is None


def test_names_that_sound_the_same_are_refused(sound: Sound) -> None:
    book = make_phrasebook(("Ann", "Anne"), (), repository("water the red rose"))
    why = refusal(check(book, ("Ann", "Anne"), sound, chosen_only=True), Path("tasks.yaml"))
    assert why is not None
    assert "'Ann, stop' and 'Anne, stop' sound the same" in why


def test_the_daemons_preflight_refuses_too(tmp_path: Path) -> None:
    tasks = task_file(tmp_path, "water the lamp rose", "water the land rose")
    finding = find_confusable(wire_up(Settings(name="Rob", state_dir=tmp_path / "state", tasks=tasks)))
    assert finding.exit_status == EX_CONFIG
    assert "by the words 'lamp' and 'land'" in finding.text
    assert not (tmp_path / "state").exists()


def test_what_was_found_is_kept_by_content(sound: Sound, tmp_path: Path) -> None:
    names = ("Rob", "Bot")
    book = make_phrasebook(names, (), repository("water the lamp rose", "water the land rose"))
    found = check(book, names, sound, tmp_path, chosen_only=True)
    (kept,) = tmp_path.iterdir()
    kept.write_text(kept.read_text().replace('"first": "lamp"', '"first": "ramp"'))
    again = check(book, names, sound, tmp_path, chosen_only=True)
    assert {"ramp" if c.first == "lamp" else c.first for c in found} == {c.first for c in again}
    kept.write_text("no JSON")
    assert check(book, names, sound, tmp_path, chosen_only=True) == found
    other = make_phrasebook(names, (), repository("water the red rose", "water the green rose"))
    check(other, names, sound, tmp_path, chosen_only=True)
    assert len(list(tmp_path.iterdir())) == 2


def test_the_forms_own_words_are_fixed() -> None:
    assert RESERVED_WORDS <= FIXED_WORDS
    assert {"two", "three", "ninety"} <= FIXED_WORDS
    assert "green" not in FIXED_WORDS
    assert {voice_for(name) for name in EIGHT} <= set(VOICES)
