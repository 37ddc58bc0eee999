"""A robot with the team's key: where it gets it, what it remembers of it, and what it shows of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from hil_fakes.word_seals import keyed_book
from hvcpd.assembly.plan import MemoryPlan
from hvcpd.config.settings import SecuritySettings, Settings
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.daemon.journal_service import JournalService
from hvcpd.daemon.logging import log_record
from hvcpd.daemon.wiring import Wiring, wire_up
from hvcpd.errors import ConfigError
from hvcpd.language import messages as m
from hvcpd.language.forms import Kind
from hvcpd.robot.records import DoubtRecord, SaveCounter
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import SKIPPED, Guard
from hvcpd.security.keyring import KeyFile, fresh_entry, write_key_file
from hvcpd.security.one_time import counted_code
from hvcpd.security.trust import People, Trust

TODAY = datetime.now(UTC).date()


@pytest.fixture
def key(tmp_path: Path) -> Path:
    path = tmp_path / "team.key"
    write_key_file(path, KeyFile((fresh_entry(TODAY),)), replaces=False)
    return path


def outfit_with(key: Path | None, tmp_path: Path, people: str = "questions") -> Wiring:
    security = SecuritySettings(key, people)  # type: ignore[arg-type]
    return wire_up(Settings(name="Rob", state_dir=tmp_path / "state", security=security))


def test_a_robot_is_given_the_key_that_its_settings_name(key: Path, tmp_path: Path) -> None:
    wiring = outfit_with(key, tmp_path, "nothing")
    plan = wiring.plan(MemoryPlan(counters={"a": 1}))
    assert plan.security.keys == wiring.ring()
    assert plan.security.keys is not None
    assert (plan.memory.counters, plan.role.people) == ({"a": 1}, People.NOTHING)


def test_encryption_is_what_its_settings_say_and_needs_a_key(key: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    settings = Settings(name="Rob", state_dir=state, security=SecuritySettings(key, encrypted=True))
    wiring = wire_up(settings)
    assert wiring.plan().security.encrypts
    assert Kind.ENCRYPTED in wiring.phrasebook().vocabulary.kinds
    assert Kind.ENCRYPTED not in outfit_with(key, tmp_path).phrasebook().vocabulary.kinds
    with pytest.raises(ConfigError, match="hvcpctl key new"):
        wire_up(Settings(name="Rob", state_dir=state, security=SecuritySettings(None, encrypted=True)))


def test_people_who_were_heard_before_a_restart_are_no_robots_of_the_team(key: Path, tmp_path: Path) -> None:
    plan = outfit_with(key, tmp_path).plan(heard=("Wendy",))
    assert "Wendy" in plan.team.names
    assert set(plan.roster) == {"Rob", "Bot"}


def test_without_a_key_nothing_is_different(tmp_path: Path) -> None:
    wiring = outfit_with(None, tmp_path)
    assert (wiring.keys, wiring.ring(), wiring.wall_s(), wiring.plan().security.keys) == (None,) * 4


def test_a_key_that_others_can_read_keeps_the_robot_from_starting(key: Path, tmp_path: Path) -> None:
    key.chmod(0o644)
    with pytest.raises(ConfigError, match="chmod 600"):
        outfit_with(key, tmp_path)


def test_a_clock_that_was_never_set_is_none(key: Path, tmp_path: Path) -> None:
    write_key_file(key, KeyFile((fresh_entry(TODAY + timedelta(days=400)),)), replaces=True)
    wiring = outfit_with(key, tmp_path)
    assert wiring.wall_s() is None
    assert wiring.ring() is not None


def test_keys_that_have_all_expired_while_a_robot_runs_are_its_keys_until_it_is_restarted(
    key: Path, tmp_path: Path
) -> None:
    wiring = outfit_with(key, tmp_path)
    assert wiring.ring_now() == wiring.ring()
    old = replace(fresh_entry(TODAY - timedelta(days=9)), until=TODAY - timedelta(days=5))
    assert replace(wiring, keys=KeyFile((old,))).ring_now() is None


async def life(wiring: Wiring, *counters: SaveCounter) -> dict[str, int]:
    """A daemon that saves these counters; returns those that it found at its start."""
    journal = JournalService(wiring)
    found = dict((await journal.open()).counters)
    journal.write(counters, 1.0)
    await journal.close()
    return found


def test_counters_outlive_the_memory_of_tasks(key: Path, tmp_path: Path) -> None:
    wiring = outfit_with(key, tmp_path)
    asyncio.run(life(wiring, SaveCounter("k/bot", 7), SaveCounter("k/zoe", 3), SaveCounter("k/bot", 5)))
    wiring.settings.memory_path.unlink()
    assert asyncio.run(life(wiring)) == {"k/bot": 7, "k/zoe": 3}


def counters_after(harm: Callable[[Wiring], None], wiring: Wiring) -> tuple[dict[str, int], list[str]]:
    """What a robot that has heard seals knows of them once this has happened, and what its log says."""
    own = f"{wiring.ring().spoken.fingerprint}/rob"  # type: ignore[union-attr]
    asyncio.run(life(wiring, SaveCounter("k/bot", 7), SaveCounter(own, 40)))
    harm(wiring)
    with capture_logs() as logs:
        counters = asyncio.run(life(wiring))
    return {name.replace(own, "own"): value for name, value in counters.items()}, [line["event"] for line in logs]


def test_counters_that_are_lost_are_told_and_doubted(key: Path, tmp_path: Path) -> None:
    def lose(wiring: Wiring) -> None:
        wiring.seals_path.unlink()

    wiring = outfit_with(key, tmp_path)
    counters, events = counters_after(lose, wiring)
    fingerprint = wiring.ring().spoken.fingerprint  # type: ignore[union-attr]
    assert counters.pop("own") > 40, "no number is used twice"
    assert counters == {f"doubted/{fingerprint}": 1, f"lost/{fingerprint}": 1}
    assert events == ["memory lost", "counters of seals lost"]
    _, events = counters_after(lambda _: None, wiring)
    assert events == ["starts stopped", "counters of seals lost"], "until there is another key"


def test_counters_that_may_lag_behind_are_doubted(key: Path, tmp_path: Path) -> None:
    def fail(wiring: Wiring) -> None:
        wiring.latch_path.write_text("")

    wiring = outfit_with(key, tmp_path)
    counters, events = counters_after(fail, wiring)
    assert counters == {"k/bot": 7, "own": 40 + SKIPPED, f"doubted/{wiring.ring().spoken.fingerprint}": 1}  # type: ignore[union-attr]
    assert events == ["memory lost"]


async def test_what_is_not_believed_is_in_the_log_and_the_transcript(key: Path, tmp_path: Path) -> None:
    wiring = outfit_with(key, tmp_path)
    doubt = DoubtRecord(3.0, "Bot", "Hi Rob, I am Bot, turn left, tango tango tango tango", Trust.WRONG.value, 20.0)
    journal = JournalService(wiring)
    await journal.open()
    journal.write((doubt,), 3.0)
    rows = await journal.transcript(0, 0.0, 10)
    assert [row.record.text for row in rows] == ["not believed: the seal is wrong"]
    await journal.close()
    with capture_logs() as logs:
        log_record(doubt, wiring.tasks)
    [line] = logs
    assert (line["log_level"], line["not_listened_to_s"], line["speaker"]) == ("warning", 20.0, "Bot")


def test_neither_key_nor_code_is_in_what_is_recorded(key: Path, tmp_path: Path) -> None:
    wiring = outfit_with(key, tmp_path)
    ring = wiring.ring()
    assert ring is not None
    digits = counted_code(ring.spoken.sheet_key, 0)
    sealing = Sealing(Guard("Rob", ring))
    book = keyed_book(("Rob", "Ann"), load_tasks(default_tasks_path()).tasks)
    said = m.Utterance("Ann", m.ToRobot("Rob"), None, m.TurnBy(90.0), m.Code(digits))
    first, second = (sealing.heard(said, book, now) for now in (0.0, 1.0))
    assert (first.trust, second.trust) == (Trust.CODE, Trust.WRONG)
    shown = repr((first, second, wiring.keys, ring))
    assert "turn left" in shown
    assert digits not in shown
    assert ring.spoken.secret.hex() not in shown
