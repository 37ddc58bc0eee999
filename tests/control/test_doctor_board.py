"""The doctor's look at a board whose supply, system or sound cards are not as they should be."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from hvcpd.control.doctor.diagnosis import Machine, run_command
from hvcpd.control.doctor.doctor_board import look_at_board


def board(folder: Path, word: str | None = None, told: dict[str, str] | None = None) -> Machine:
    """A board that prints `told` for each command, and whose firmware has that word."""
    (folder / "proc").mkdir(exist_ok=True)
    if word is not None:
        (folder / "throttled").write_text(f"{word}\n")

    def run(command: Sequence[str]) -> str | None:
        return (told or {}).get(command[0])

    return Machine(throttled=folder / "throttled", boot=folder / "config.txt", proc=folder / "proc", run=run)


def card(folder: Path, number: int, name: str, device: str, status: str) -> None:
    there = folder / f"proc/asound/card{number}"
    (there / device / "sub0").mkdir(parents=True)
    (there / "id").write_text(f"{name}\n")
    (there / device / "sub0/status").write_text(status)


def found(a_board: Machine) -> list[tuple[str, str, str]]:
    return [(each.subject, str(each.grade), each.text) for each in look_at_board(a_board)]


def test_what_a_command_prints_need_be_no_text() -> None:
    """As the name of a sound card's control, which its maker wrote."""
    assert run_command(("printf", r"Mikrofon \374")) == "Mikrofon \ufffd"
    assert run_command(("no-such-command-here",)) is None


def test_another_computer_has_nothing_to_tell(tmp_path: Path) -> None:
    assert found(board(tmp_path)) == []


@pytest.mark.parametrize(
    ("word", "grade", "says"),
    [
        ("50005", "wrong", "too low now"),
        ("50000", "note", "has been too low"),
        ("8", "note", "hot and slowed down; "),
        ("e0000", "note", "hot and was slowed down since"),
    ],
)
def test_the_supply_is_told_from_the_firmwares_word(tmp_path: Path, word: str, grade: str, says: str) -> None:
    ((subject, told, text),) = found(board(tmp_path, word))
    assert (subject, told) == ("supply", grade)
    assert says in text


@pytest.mark.parametrize(
    ("answer", "grade", "says"),
    [
        ("throttled=0x80008\n", "note", "hot and slowed down; "),
        ("throttled=0x50000\n", "note", "has been too low since"),
        ("throttled=0x0\n", "ok", "has not been too low since"),
        ("Can't open device file: /dev/vcio\n", "ok", "not too low now; `sudo vcgencmd get_throttled` prints"),
        (None, "ok", "not too low now; `sudo vcgencmd get_throttled` prints"),
    ],
)
def test_the_firmware_is_asked_rather_than_the_kernel_which_forgets(
    tmp_path: Path, answer: str | None, grade: str, says: str
) -> None:
    """The kernel's file was 0 where `vcgencmd` printed 0x80008 (raspberrypi/linux, issue 2367)."""
    asked = {"vcgencmd": answer} if answer is not None else {}
    ((subject, told, text),) = found(board(tmp_path, "0", told=asked))
    assert (subject, told) == ("supply", grade)
    assert says in text


def test_a_word_that_is_none_is_left_alone(tmp_path: Path) -> None:
    assert found(board(tmp_path, "error=1")) == []


def test_a_narrow_system_on_a_wide_kernel_is_told(tmp_path: Path) -> None:
    ((subject, grade, text),) = found(board(tmp_path, told={"uname": "aarch64\n", "dpkg": "armhf\n"}))
    assert (subject, grade) == ("system", "wrong")
    assert "64-bit" in text
    assert found(board(tmp_path, told={"uname": "aarch64\n", "dpkg": "arm64\n"})) == []


@pytest.mark.parametrize(
    ("config", "says"),
    [
        ("dtparam=audio=on\ndtoverlay=vc4-kms-v3d\n", "which has none"),
        ("#dtoverlay=wm8960-soundcard\n", "which has none"),
        ("dtoverlay=wm8960-soundcard\n", "which has dtoverlay=wm8960-soundcard: look at `sudo dmesg`"),
        ("dtoverlay=i2c-rtc,ds3231\n", "plug in a USB microphone"),
        ("dtoverlay=max98357a,no-sdmode\n", "plug in a USB microphone"),
    ],
)
def test_a_board_without_a_microphone_is_told_what_its_start_asks_for(tmp_path: Path, config: str, says: str) -> None:
    (tmp_path / "config.txt").write_text(config)
    ((subject, grade, text),) = found(board(tmp_path))
    assert (subject, grade) == ("overlay", "wrong")
    assert says in text
    card(tmp_path, 1, "Device", "pcm0c", "closed\n")
    assert found(board(tmp_path)) == [], "one that can record is there"


def process(folder: Path, thread: int, number: int, name: str) -> None:
    (folder / f"proc/{thread}").mkdir()
    (folder / f"proc/{thread}/status").write_text(f"Name:\t{name}\nUmask:\t0022\nTgid:\t{number}\nPid:\t{thread}\n")


@pytest.mark.parametrize(("name", "grade"), [("arecord", "wrong"), ("pipewire", "note"), ("hvcpd", "ok")])
def test_who_has_a_card_is_named_with_the_cards_lasting_name(tmp_path: Path, name: str, grade: str) -> None:
    card(tmp_path, 0, "vc4hdmi", "pcm0p", "closed\n")
    card(tmp_path, 1, "robot", "pcm0c", "state: RUNNING\nowner_pid   : 4711\n")
    process(tmp_path, 4711, 4711, name)
    ((subject, told, text),) = found(board(tmp_path))
    assert (subject, told) == ("cards", grade)
    assert f"{name} (process 4711) has robot" in text


def test_a_program_that_ended_meanwhile_is_not_named(tmp_path: Path) -> None:
    card(tmp_path, 1, "robot", "pcm0c", "owner_pid : 4711\n")
    assert found(board(tmp_path)) == []


def test_a_sound_server_is_known_by_its_thread_that_opened_the_card(tmp_path: Path) -> None:
    """The kernel's owner is a thread: pulseaudio opens a card again in one of its own, after each pause."""
    card(tmp_path, 1, "robot", "pcm0c", "owner_pid   : 902\n")
    card(tmp_path, 2, "Device", "pcm0c", "owner_pid   : 903\n")
    process(tmp_path, 902, 900, "alsa-source-USB")
    process(tmp_path, 903, 900, "alsa-source-Dev")
    process(tmp_path, 900, 900, "pulseaudio")
    ((subject, grade, text),) = found(board(tmp_path))
    assert (subject, grade) == ("cards", "note")
    assert "pulseaudio (process 900) has Device, robot" in text
