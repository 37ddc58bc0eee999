"""Settings and tasks that change while a robot runs, by its control socket."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path

import numpy as np
import pytest
from structlog.testing import capture_logs

from hvcpd.config.settings import SecuritySettings, Settings
from hvcpd.daemon.reloading import Reloader
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import NotDoneError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.memory.people import person_path, remove_person, write_person
from hvcpd.people.enrolled import Person, SpokenSentence
from hvcpd.security.keyring import KeyFile, fresh_entry, write_key_file
from tests.daemon.control_bench import ONE_TASK, control, talking
from tests.daemon.test_control_service import shown
from tests.full_disk import no_new_bytes


async def test_settings_come_with_their_sources(tmp_path: Path) -> None:
    async with talking(tmp_path) as (_, talk):
        settings = {each["key"]: each for each in (await talk.ask("config"))["result"]["settings"]}
        assert settings["name"] == {"key": "name", "value": "Rob", "source": "--name"}
        assert settings["pick"]["source"] == "default"


async def test_reload_changes_how_much_the_robot_says(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
        usual = {"now": "normal", "level_db": 0.0, "for_noise": False, "quiet": None}
        assert (await talk.ask("status"))["result"]["talk"] == usual
        bench.file.write_text('talk: full\nquiet: {hours: "00:00-23:59", level_db: -6}\n')
        changed = [change["key"] for change in (await talk.ask("reload"))["result"]["changed"]]
        assert changed == ["talk", "quiet.hours", "quiet.level_db"]
        settings, role = bench.body.wiring.settings, bench.bench.robot.coordination.role
        noon_s = datetime(2026, 11, 23, 12).timestamp()
        quiet = bench.body.wiring.with_talk(role, noon_s)
        assert (quiet.talk.value, quiet.softly_db) == ("terse", -6.0)
        by_day = bench.body.wiring.with_talk(quiet, noon_s + 11 * 3600.0 + 59 * 60.0)
        assert (by_day.talk.value, by_day.softly_db) == ("full", 0.0)
        no_clock = replace(bench.body.wiring, settings=replace(settings, clock=False))
        assert no_clock.with_talk(by_day, noon_s) is by_day, "it has no quiet hours"
        status = (await talk.ask("status"))["result"]
        assert status["talk"]["quiet"] == "00:00-23:59"
        assert "(quiet hours 00:00-23:59)" in shown(status)


async def test_reload_changes_what_it_can_and_names_what_it_cannot(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
        bench.file.write_text("mode: follow\nunable: [1]\naudio: {block_ms: 20}\n")
        tasks = tmp_path / "tasks.yaml"
        tasks.write_text(ONE_TASK.replace("x_m: 0", "x_m: 2"))
        result = (await talk.ask("reload"))["result"]
        assert result["restart"] == ["audio.block_ms"]
        assert [change["key"] for change in result["changed"]] == ["mode", "unable", "task 1"]
        role = bench.bench.robot.coordination.role
        assert (role.volunteer, role.unable) == (False, frozenset({1}))
        assert (await talk.ask("status"))["result"]["mode"] == "follow"
        (task,) = (await talk.ask("tasks"))["result"]["tasks"]
        assert (task["place"], task["unable"]) == ({"x_m": 2.0, "y_m": 0.0}, True)
        settings = {each["key"]: each for each in (await talk.ask("config"))["result"]["settings"]}
        assert settings["mode"]["source"] == f"{bench.file}:1"
        assert settings["audio.block_ms"]["value"] == 25, "what is in force"
        tasks.write_text(ONE_TASK.replace("green", "pink"))
        assert (await talk.ask("reload"))["result"]["restart"] == ["audio.block_ms", "tasks"]
        bench.file.write_text("mood: follow\nmode: volunteer\n")
        refused = (await talk.ask("reload"))["error"]
        assert refused["code"] == "bad_settings"
        assert "did you mean 'mode'" in refused["text"]
        assert bench.bench.robot.coordination.role.volunteer is False, "all or nothing"


async def test_reload_tells_what_differs_in_the_tasks(tmp_path: Path) -> None:
    async with talking(tmp_path) as (bench, talk):
        bench.body.retask = lambda _tasks, then: then()

        async def changes(text: str) -> list[tuple[object, ...]]:
            (tmp_path / "tasks.yaml").write_text(text)
            return [tuple(change.values()) for change in (await talk.ask("reload"))["result"]["changed"]]

        often = ONE_TASK.replace("}]}", "}], every: 6 h, priority: 3}")
        assert await changes(often) == [("task 1", "once, priority 0", "every 6 h, priority 3")]
        longer = often.replace("forward: 1", "forward: 2")
        assert await changes(longer) == [("task 1", "1 action", "1 action, others")]
        more = "other_tasks: [water the red rose]\nalternatives: {green: [grin]}\nskills: {wave: {}}\n"
        more += "places: [{name: tap, centre: {x_m: 3, y_m: 1}, radius_m: 0.4}]\n"
        assert await changes(longer + more) == [
            ("other tasks", [], ["water the red rose"]),
            ("alternatives", [], ["grin for green"]),
            ("declared skills", [], ["wave"]),
            ("places", [], ["tap"]),
        ], "it was told that nothing has changed"
        farther = more.replace("x_m: 3", "x_m: 4")
        assert await changes(longer + farther) == [("places", ["tap"], ["tap, changed"])]


async def test_reload_takes_tasks_with_new_words_once_the_robot_knows_these(tmp_path: Path) -> None:
    two = ONE_TASK + ONE_TASK.partition("tasks:\n")[2].replace("number: 1", "number: 2").replace("green", "pink")
    async with talking(tmp_path) as (bench, talk):
        learned: list[Callable[[], None]] = []
        bench.body.retask = lambda _tasks, then: learned.append(then)
        (tmp_path / "tasks.yaml").write_text(two)
        result = (await talk.ask("reload"))["result"]
        new = {"key": "task 2", "before": None, "now": "water the pink rose"}
        assert result == {"changed": [new], "restart": []}
        assert len((await talk.ask("tasks"))["result"]["tasks"]) == 1, "it does not know the words yet"
        learned.pop()()
        board = (await talk.ask("tasks"))["result"]["tasks"]
        assert [task["name"] for task in board] == ["water the green rose", "water the pink rose"]
        await bench.live(blocks=2)
        await bench.journal.settled()
        (tmp_path / "tasks.yaml").write_text(two.replace("pink", "white"))
        (change,) = (await talk.ask("reload"))["result"]["changed"]
        assert change == {"key": "task 2", "before": "water the pink rose", "now": "water the white rose"}
        (tmp_path / "tasks.yaml").write_text(ONE_TASK)
        (change,) = (await talk.ask("reload"))["result"]["changed"]
        assert change == {"key": "task 2", "before": "water the white rose", "now": None}, "though it is not known yet"
        for then in learned:
            then()
        assert [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]] == [1]
        (tmp_path / "tasks.yaml").write_text(two.replace("pink", "grin"))
        assert "sounds like" in (await talk.ask("reload"))["error"]["text"]


async def test_a_removed_task_is_gone_at_once_while_the_words_of_others_are_learned(tmp_path: Path) -> None:
    """The command said "gone", and for as long as other words were prepared the robot still claimed the task."""
    more = ONE_TASK.partition("tasks:\n")[2]
    first, second = (
        more.replace("number: 1", f"number: {n}").replace("green", c) for n, c in ((2, "pink"), (3, "red"))
    )
    async with talking(tmp_path) as (bench, talk):
        learned: list[Callable[[], None]] = []

        async def numbers() -> list[int]:
            return [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]]

        bench.body.retask = lambda _tasks, then: learned.append(then)
        for text in (ONE_TASK + first, ONE_TASK + second):  # the first ones are learned last
            (tmp_path / "tasks.yaml").write_text(text)
            await talk.ask("reload")
        learned.pop(0)()
        assert await numbers() == [1], "2 is removed by now, and 3 not known yet"
        learned.pop(0)()
        assert await numbers() == [1, 3]
        await talk.ask("task", do="remove", number=1)
        assert await numbers() == [3]
        assert await numbers() == [task.number for task in bench.body.wiring.tasks.tasks]
        learned.pop(0)()
        assert await numbers() == [3]


async def test_a_task_is_added_and_removed_and_the_task_file_stays_as_it_is(tmp_path: Path) -> None:
    tulip = {"number": 11, "name": "water the red tulip", "place": {"x_m": 1.2, "y_m": 0.5}}
    tulip |= {"actions": ["go to place", {"water": 5}], "after": [1], "every": "6 h"}
    async with talking(tmp_path) as (bench, talk):
        bench.body.retask = lambda _tasks, then: then()
        kept = bench.body.wiring.settings.task_changes_path
        for wrong, why in (
            (tulip | {"number": 1}, "there already is a task 1"),
            (tulip | {"name": "water the grin rose"}, "sounds like 'water the green rose' in line 2"),
            (tulip | {"after": [11]}, "task 11: task 11 after task 11"),
            (tulip | {"actions": [{"wave": 3}]}, "unknown action 'wave'"),
            (tulip | {"colour": "red"}, "unknown key 'colour'"),
            (tulip | {"name": "\ud800"}, "task 11: '\\ud800' has a character that no text can have"),
        ):
            error = (await talk.ask("task", do="add", task=wrong))["error"]
            assert (error["code"], why in error["text"]) == ("bad_settings", True), error
        assert not kept.exists(), "what is refused is not kept"
        result = (await talk.ask("task", do="add", task=tulip))["result"]
        assert result["changed"] == [{"key": "task 11", "before": None, "now": "water the red tulip"}]
        board = (await talk.ask("tasks"))["result"]["tasks"]
        assert [(task["number"], task["every"]) for task in board] == [(1, None), (11, "6 h")]
        assert wire_up(bench.body.wiring.settings).tasks == bench.body.wiring.tasks, "as after a restart"
        error = (await talk.ask("task", do="remove", number=1))["error"]
        assert "comes after task 1, which does not exist" in error["text"]
        assert (await talk.ask("task", do="remove", number=11))["result"]["changed"][0]["now"] is None
        assert "there is no task 11" in (await talk.ask("task", do="remove", number=11))["error"]["text"]
        assert (await talk.ask("task", do="add", task=tulip | {"after": []}))["result"]["restart"] == []
        assert (await talk.ask("task", do="remove", number=1))["result"]["changed"][0]["key"] == "task 1"
        assert [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]] == [11]
        assert (tmp_path / "tasks.yaml").read_text() == ONE_TASK
        kept.write_text("removed: [")
        for asked in (talk.ask("reload"), talk.ask("task", do="remove", number=11)):
            assert f"{kept}:1: not valid YAML" in (await asked)["error"]["text"], "a start would set it aside"
        assert [task["number"] for task in (await talk.ask("tasks"))["result"]["tasks"]] == [11]


async def test_a_change_that_cannot_be_kept_has_failed(tmp_path: Path) -> None:
    """Its code was that of a robot that is still starting, so a program would have tried it again and again."""
    async with talking(tmp_path) as (_, talk):
        with capture_logs(), no_new_bytes():
            task = {"number": 2, "name": "water the pink rose", "actions": ["dock"]}
            error = (await talk.ask("task", do="add", task=task))["error"]
        assert (error["code"], "rob.tasks.yaml: cannot be written" in error["text"]) == ("failed", True)


async def test_who_has_no_settings_to_read_again_says_so(tmp_path: Path) -> None:
    async with control(tmp_path) as bench:
        with pytest.raises(NotDoneError, match="no settings to read"):
            await Reloader(bench.body, None).remove(1)


@pytest.mark.slow
def test_a_word_that_would_be_taken_for_another_is_refused_with_a_proposal(tmp_path: Path) -> None:
    async def scene() -> None:
        board = ONE_TASK.replace("green", "lamp")
        async with talking(tmp_path, board=board, compares_words=True) as (bench, talk):
            land = {"number": 2, "name": "water the land rose", "actions": ["dock"]}
            error = (await talk.ask("task", do="add", task=land))["error"]
            assert error["code"] == "bad_settings"
            assert "instead of 'lamp' say for example 'lantern'" in error["text"]
            assert not bench.body.wiring.settings.task_changes_path.exists()

    asyncio.run(scene())  # a comparison in which much is wrong takes its time


async def test_reload_takes_new_words_and_whoever_is_new_or_gone(tmp_path: Path) -> None:
    take = np.ones((20, 24), np.float32)
    anna = Person("Anna", {"stop": [take]})
    state = tmp_path / "state"
    write_person(person_path(state, "Anna"), anna)
    async with talking(tmp_path) as (bench, talk):
        write_person(person_path(state, "Anna"), anna.with_takes({"rob": [take]}))
        joined: list[Sequence[str]] = []
        bench.body.join = joined.append
        (more,) = (await talk.ask("reload"))["result"]["changed"]
        assert more == {"key": "takes of Anna", "before": 1, "now": 2}
        kept = bench.body.wiring.people["anna"]
        assert kept.takes.keys() == {"stop", "rob"}
        assert joined == [[]], "what the net makes of the new word is found out before it is needed"
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
        assert bench.body.wiring.people["anna"] is kept
        assert joined == [[]]
        said = SpokenSentence(("rob", "stop"), np.full((20, 25), 1.0 / 3.0, np.float32))
        write_person(person_path(state, "Anna"), kept.with_sentences([said]))
        (spoke,) = (await talk.ask("reload"))["result"]["changed"]
        assert spoke == {"key": "sentences of Anna", "before": 0, "now": 1}, "it was: takes of Anna, 2 and 2"
        assert joined == [[], []]
        learned = bench.body.wiring.people["anna"].with_sentences([said])  # a third is no float16, as in the file
        bench.body.update_person(learned)
        write_person(person_path(state, "Anna"), learned)
        assert (await talk.ask("reload"))["result"]["changed"] == [], "what it has learned is no news"
        assert bench.body.wiring.people["anna"] is learned, "whose layers are kept"
        assert joined == [[], []]
        write_person(person_path(state, "Ben"), Person("Ben", {"stop": [take]}))
        result = (await talk.ask("reload"))["result"]
        change = {"key": "people", "before": ["Anna"], "now": ["Anna", "Ben"]}
        assert result == {"changed": [change], "restart": []}
        assert joined == [[], [], ["Ben"]]
        remove_person(person_path(state, "Anna"))
        (change,) = (await talk.ask("reload"))["result"]["changed"]
        assert change["now"] == ["Ben"]
        assert list(bench.body.wiring.people) == ["ben"], "whom the second look listens for"
        assert joined == [[], [], ["Ben"], []]


async def test_a_file_that_says_other_things_waits_for_a_restart(tmp_path: Path) -> None:
    tasks, lexicon, key, folder = (tmp_path / name for name in ("tasks.yaml", "lexicon.txt", "team.key", "voice"))
    tasks.write_text(ONE_TASK)
    lexicon.write_text("zorg Z AO1 R G\n")
    keys = KeyFile((fresh_entry(date(2026, 11, 1)),))
    write_key_file(key, keys, replaces=False)
    folder.mkdir()
    settings = Settings(name="Rob", tasks=tasks, state_dir=tmp_path / "state", security=SecuritySettings(key))
    word = np.hanning(3_200).astype(np.float32)
    for name in wire_up(settings).phrasebook().marked_graph.words:
        write_wav(folder / f"{name}.wav", 0.5 * word)
    given = {"lexicon": str(lexicon), "security.key": str(key), "voice_folder": str(folder)}
    async with talking(tmp_path, **given) as (_, talk):
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}
        lexicon.write_text("# of ours\nzorg Z AO1 R JH\n")
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": ["lexicon"]}
        write_wav(folder / "rob.wav", np.roll(word, 160) * word)
        write_key_file(key, keys.with_revoked("Bot"), replaces=True)
        restart = ["lexicon", "voice_folder", "security.key"]
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": restart}


async def test_who_counts_stays_the_same_while_the_settings_for_it_wait_for_a_restart(tmp_path: Path) -> None:
    anna = Person("Anna", {"stop": [np.ones((20, 24), np.float32)]})
    write_person(person_path(tmp_path / "state", "Anna"), anna)
    async with talking(tmp_path) as (bench, talk):
        bench.file.write_text("mode: volunteer\nvoices: robots\n")
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": ["voices"]}
        assert list(bench.body.wiring.people) == ["anna"]
        bench.file.write_text("mode: volunteer\n")
        assert (await talk.ask("reload"))["result"] == {"changed": [], "restart": []}


async def test_whom_the_settings_name_is_a_robot_until_a_restart(tmp_path: Path) -> None:
    anna = Person("Anna", {"stop": [np.ones((20, 24), np.float32)]})
    async with talking(tmp_path, names=["Rob", "Anna"]) as (_, talk):
        write_person(person_path(tmp_path / "state", "Anna"), anna)
        result = (await talk.ask("reload"))["result"]
        assert result["restart"] == ["people"]
        assert [change["now"] for change in result["changed"]] == [["Anna"]]
