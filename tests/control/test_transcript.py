"""`hvcpctl transcript` and `hvcpctl audit`: a robot's memory, read by people."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from hvcpd.control.cli import main
from hvcpd.control.live import transcript
from hvcpd.memory.store import Store, TranscriptRecord
from tests.control.conftest import Ran, Refuse

TALK = (
    ("heard", "Anna", "Hi Rob, I am Anna, water the yellow rose"),
    ("said", "Rob", "Hi Anna, I am Rob, I will water the yellow rose"),
    ("heard", "Anna", "Hi Rob, I am Anna, confirmed"),
    ("heard", "Anna", "Hi Rob, I am Anna, turn left"),
    ("said", "Rob", "Hi Anna, I am Rob, I am busy"),
    ("heard", "Anna", "Hi Bot, I am Anna, complete task nine"),
    ("heard", "Bot", "Hi Anna, I am Bot, I do not know task nine"),
    ("said", "Rob", "Hi Anna, I am Rob, task five complete"),
    ("garbled", None, ""),
    ("garbled", None, "pour failed: the tank is empty"),
    ("said", "Rob", "Hi team plant, I am Rob, I will complete task one"),
    ("said", "Rob", "Hi all, I am Rob, task one complete, I will complete task two"),
    ("heard", "Bot", "Hi team plant, I am Bot, I will complete task three"),
    ("heard", "Bot", "Hi all, I am Bot, task three complete"),
    ("heard", None, "Stop"),
    ("said", "Rob", "Stop"),
)


@pytest.fixture
def memory(tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "rob.sqlite3"
    with closing(Store(path)) as store:
        for n, (kind, speaker, text) in enumerate(TALK):
            store.append_transcript(TranscriptRecord(float(n), kind, speaker, text, 0.9 if kind == "heard" else None))  # type: ignore[arg-type]
        yield path


def test_the_transcript_as_text_and_as_json(memory: Path, ran: Ran) -> None:
    lines = ran("transcript", "--memory", memory).splitlines()
    assert len(lines) == len(TALK)
    assert lines[0].endswith("heard    Hi Rob, I am Anna, water the yellow rose  (90%)")
    assert lines[8].endswith("garbled  …")
    assert lines[9].endswith("noted    pour failed: the tank is empty"), "nobody has spoken"
    objects = [json.loads(line) for line in ran("transcript", "--memory", memory, "--json").splitlines()]
    assert [(o["kind"], o["speaker"], o["text"]) for o in objects] == list(TALK)


def test_faults_of_the_settings_keep_nobody_from_reading(memory: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = memory.parent / "hvcpd.yaml"
    config.write_text("name: Rob\nmdoe: follow\nstate_dir: .\n")
    assert main(["transcript", "--config", str(config)]) == 0
    out, err = capsys.readouterr()
    assert len(out.splitlines()) == len(TALK)
    assert err.startswith(f"hvcpctl: note: the settings have errors ({config}:2: unknown key 'mdoe'")
    assert len(err.splitlines()) == 1


def test_a_memory_that_a_daemon_has_open_is_not_read_past_it(memory: Path) -> None:
    assert not memory.with_name(f"{memory.name}-shm").exists(), "it would be written to the card with each change"
    other = [sys.executable, "-m", "hvcpd.control.cli", "transcript", "--memory", str(memory)]
    told = subprocess.run(other, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout) == (2, "")
    remedy = "ask that, by `hvcpctl transcript` without --memory, or end it"
    assert told.stderr == f"hvcpctl: {memory}: the robot's daemon has it open; {remedy}\n"


@pytest.mark.parametrize("content", [b"", b"name: Rob\n"])
def test_a_file_that_is_no_memory_is_not_said_to_need_a_daemon(
    content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "hvcpd.yaml"
    path.write_bytes(content)
    assert main(["transcript", "--memory", str(path)]) == 2
    assert capsys.readouterr().err == f"hvcpctl: {path}: this is no robot's memory; name another with --memory FILE\n"


def test_seals_are_told(memory: Path, ran: Ran) -> None:
    with closing(Store(memory)) as store:
        for seal in ("encrypted", "not trusted"):
            store.append_transcript(TranscriptRecord(99.0, "heard", "Bot", "Hi all, I am Bot, I am busy", 0.9, seal))
    lines = ran("transcript", "--memory", memory).splitlines()
    assert [line.rpartition("(90%)")[2].strip() for line in lines[-2:]] == ["encrypted ✓", "not trusted"]


def test_since_leaves_out_what_is_older(memory: Path, ran: Ran) -> None:
    assert len(ran("transcript", "--memory", memory, "--since", "1h").splitlines()) == len(TALK)
    assert ran("transcript", "--memory", memory, "--since", "2999-01-01") == ""


class _Enough(Exception):
    """Ends the following."""


def test_follow_prints_each_new_line_once(memory: Path, capsys: pytest.CaptureFixture[str]) -> None:
    waits = []

    def wait(_s: float) -> None:
        waits.append(capsys.readouterr().out)
        if len(waits) == 3:
            raise _Enough
        with closing(Store(memory)) as store:
            store.append_transcript(TranscriptRecord(99.0, "said", "Rob", f"line {len(waits)}"))

    options = argparse.Namespace(memory=memory, since=None, follow=True, json=False)
    with pytest.raises(_Enough):
        transcript.run(options, wait=wait)
    assert len(waits[0].splitlines()) == len(TALK)
    assert [out.splitlines()[0].split("said")[1].strip() for out in waits[1:]] == ["line 1", "line 2"]
    assert all(len(out.splitlines()) == 1 for out in waits[1:])


def test_the_audit_counts_orders_refusals_and_shares(memory: Path, ran: Ran) -> None:
    found = json.loads(ran("audit", "--memory", memory, "--json"))
    assert found["orders"] == {"Anna to Rob": 2, "Anna to Bot": 1}
    assert found["taken"] == {"Anna to Rob": 1}
    assert found["refusals"] == {"Rob to Anna: busy": 1, "Bot to Anna: unknown task": 1}
    assert found["done"] == {"5": "Rob", "1": "Rob", "3": "Bot"}
    assert found["shares"] == {"Rob": 2, "Bot": 1}
    assert found["fairness"] == pytest.approx(9 / (2 * 5))
    assert found["garbled"] == 1
    assert found["not_understood"] == 0
    assert found["stops"] == {"somebody": 1, "Rob": 1}, "its own one is without a name, too"
    assert "0.90 (1 = all equal)" in ran("audit", "--memory", memory)


def test_the_audit_counts_what_recurs_each_time(memory: Path, ran: Ran) -> None:
    """Of a task that is done every hour of a day only the first time counted, and only for the robot that did it."""
    again = "Hi all, I am Bot, task five complete, I will complete task three"
    with closing(Store(memory)) as store:
        for text in (
            "Hi team plant, I am Bot, I will water the yellow rose",
            again,
            again,
            "Hi all, I am Bot, task three complete",
        ):
            store.append_transcript(TranscriptRecord(50.0, "heard", "Bot", text))
    found = json.loads(ran("audit", "--memory", memory, "--json"))
    assert (found["shares"], found["done"]["5"]) == ({"Rob": 2, "Bot": 3}, "Rob")


def test_a_failure_that_is_said_until_somebody_confirms_it_counts_once(memory: Path, ran: Ran) -> None:
    failed = "Hi all, I am Bot, task two failed"
    with closing(Store(memory)) as store:
        for text in (failed, failed, "Hi all, I am Bot, I will complete task two", failed, failed):
            store.append_transcript(TranscriptRecord(50.0, "heard", "Bot", text))
    assert json.loads(ran("audit", "--memory", memory, "--json"))["failed"] == {"Bot": 2}


def test_the_audit_counts_what_is_only_passed_on_or_confirmed_as_the_report_of_the_shift_does(
    memory: Path, ran: Ran
) -> None:
    with closing(Store(memory)) as store:
        for text in (
            "Hi Anna, I am Rob, Bot says task two complete",
            "Hi Bot, I am Rob, confirmed two complete, I will complete task four",
            "Hi Rob, I am Bot, confirmed four complete",
            "Hi Anna, I am Rob, Bot says task one failed",
        ):
            store.append_transcript(TranscriptRecord(50.0, "heard", text.split()[4].strip(","), text))
    found = json.loads(ran("audit", "--memory", memory, "--json"))
    assert found["done"] == {"5": "Rob", "1": "Rob", "3": "Bot", "2": "Bot", "4": "Rob"}
    assert (found["shares"], found["failed"]) == ({"Rob": 3, "Bot": 2}, {"Bot": 1})


def test_what_a_file_says_cannot_steer_the_terminal(memory: Path, ran: Ran) -> None:
    with closing(Store(memory)) as store:
        store.append_transcript(TranscriptRecord(50.0, "heard", None, "\x1b[2Jgone\nnext"))
    out = ran("transcript", "--memory", memory)
    assert "\x1b" not in out
    assert len(out.splitlines()) == len(TALK) + 1


def test_bad_input_names_the_remedy(refused: Refuse, tmp_path: Path, memory: Path) -> None:
    assert "--memory" in refused("transcript", "--memory", tmp_path / "none")
    assert "8h" in refused("audit", "--memory", memory, "--since", "yesterday")
    for command in ("report", "audit"):
        assert "2999-01-01 is yet to come" in refused(command, "--memory", memory, "--since", "2999-01-01"), command
