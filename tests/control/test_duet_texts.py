"""What a duet writes at its beginning."""

from __future__ import annotations

import shlex
from pathlib import Path

from hvcpd.config.settings_file import load_settings
from hvcpd.control.cli import make_parser
from hvcpd.control.duet.texts import lacking_text, partner_command, ready_text, welcome_text
from hvcpd.daemon.wiring import wire_up

TASKS = """skills: {pour: {}, grip: {}}
tasks:
  - {number: 1, name: water the green rose, actions: [pour]}
  - {number: 2, name: fetch the atlas, actions: [grip]}
  - {number: 3, name: count the chairs, actions: [{wait: 5}]}
"""


def test_the_terminal_says_how_to_ask_its_robots(tmp_path: Path) -> None:
    text = welcome_text(("Rob", "Bot"), "through simulated air (--pipe)", "", tmp_path / "my robots" / "rob.sock")
    asks = next(line for line in text.splitlines() if "hvcpctl" in line)
    options = make_parser().parse_args(shlex.split(asks.partition("hvcpctl ")[2]))
    assert options.socket == tmp_path / "my robots" / "rob.sock"
    assert "Watch" not in text


def test_nobody_is_asked_to_speak_without_a_microphone() -> None:
    assert "Say, or type and press Enter:  Bot, stop" in ready_text(("Rob", "Bot"), "", by_voice=True)
    assert "\nType and press Enter:  Bot, stop" in ready_text(("Rob", "Bot"), "", by_voice=False)
    assert "Say, or type and press Enter:  Rob, stop" in ready_text(("Rob",), "", by_voice=True)


def test_who_is_alone_is_told_where_the_partner_starts_if_there_is_one() -> None:
    """A robot by itself was its own partner, on another computer."""
    assert "Rob begins in a moment. Its partner runs on another computer within earshot: hvcpctl duet --as Bot\n" in (
        ready_text(("Rob",), partner_command(("Rob", "Bot"), ("Rob",), None, None), by_voice=True)
    )
    assert partner_command(("Rob", "Bot"), ("Rob", "Bot"), None, None) == ""
    assert "Rob begins in a moment.\n" in ready_text(("Rob",), "", by_voice=False)
    assert "one of them begins in a moment.\n" in ready_text(("Rob", "Bot"), "", by_voice=False)


def test_a_partner_starts_with_the_same_robots_and_files(tmp_path: Path) -> None:
    """It was told to start without them, as one who knows neither the first robot nor its tasks."""
    command = partner_command(("Ida", "Max"), ("Ida",), tmp_path / "my team.yaml", tmp_path / "tasks.yaml")
    options = make_parser().parse_args(shlex.split(command)[1:])
    assert (options.names, options.as_name) == (("Ida", "Max"), "Max")
    assert (options.config, options.tasks) == (tmp_path / "my team.yaml", tmp_path / "tasks.yaml")


def test_tasks_that_nobody_can_do_yet_are_named_and_how_to_have_them_done(tmp_path: Path) -> None:
    """Robots did all but these, and then fell silent, without a word of why."""
    path = tmp_path / "my tasks.yaml"
    path.write_text(TASKS)
    given = {"name": "Rob", "tasks": str(path), "state_dir": str(tmp_path / "state")}
    wiring = wire_up(load_settings(None, given, system_path=tmp_path / "none.yaml"))
    text = lacking_text(wiring, path)
    assert text.startswith("Nobody does task 1, water the green rose and task 2, fetch the atlas until each robot is")
    command = make_parser().parse_args(shlex.split(text.partition("hvcpctl ")[2]))
    assert (command.config, command.socket.name) == (path, "rob.sock")
    path.write_text(TASKS.replace("[pour]", "[{wait: 1}]").replace("[grip]", "[{wait: 1}]"))
    assert lacking_text(wire_up(wiring.settings), None) == ""


def test_a_robot_with_a_joint_does_all_tasks_of_that_skill(tmp_path: Path) -> None:
    """Only the first one of them was taken for one that it does."""
    path = tmp_path / "tasks.yaml"
    path.write_text(TASKS.replace("pour: {}, ", "").replace("[pour]", "[grip]"))
    skills = {"grip": {"joint": {"id": 3}}}
    given = {"name": "Rob", "tasks": str(path), "state_dir": str(tmp_path / "state"), "skills": skills}
    wiring = wire_up(load_settings(None, given, system_path=tmp_path / "none.yaml"))
    assert lacking_text(wiring, None) == ""
