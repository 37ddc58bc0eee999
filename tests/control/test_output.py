"""Where the output goes to the wrong place: a message, a true exit status, and never a traceback."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hvcpd.config.files import write_whole
from hvcpd.control.cli import main
from hvcpd.errors import unwritable
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from tests.control.obliging import obliging_robot
from tests.full_disk import NO_BYTECODE

HVCPCTL = (sys.executable, "-m", "hvcpd.control.cli")
HVCPD = (sys.executable, "-m", "hvcpd.cli")
FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    whole = {**os.environ, "PYTHONUNBUFFERED": "", **environment}
    return subprocess.run(
        ["/bin/sh", "-c", command], capture_output=True, text=True, timeout=120, check=False, env=whole
    )


@needs_full
@pytest.mark.slow
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", ["", "--help", "--version", "key", "stop --help", "completion bash", "phrases"])
def test_a_full_disk_is_told(arguments: str, unbuffered: str) -> None:
    done = shell(f"{' '.join(HVCPCTL)} {arguments} > /dev/full", PYTHONUNBUFFERED=unbuffered)
    assert done.returncode == 2
    assert done.stderr == (
        "hvcpctl: standard output: cannot be written: No space left on device; make room there, or name another place\n"
    )


@needs_full
@pytest.mark.slow
@pytest.mark.parametrize("arguments", ["say stop --local -o /dev/full", "pronounce rose -o /dev/full"])
def test_a_full_disk_is_told_of_a_file(arguments: str) -> None:
    done = shell(f"{' '.join(HVCPCTL)} {arguments}")
    assert done.returncode == 2
    assert "hvcpctl: /dev/full: cannot be written: No space left on device; make room" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("arguments", ["say stop --local -o", "pronounce rose --track", "key sheet --key {key} -o"])
def test_a_disk_that_fills_up_leaves_no_part_of_a_file(arguments: str, tmp_path: Path) -> None:
    key, folder = tmp_path / "key", tmp_path / "folder"
    folder.mkdir()
    assert shell(f"{' '.join(HVCPCTL)} key new --key {key}").returncode == 0
    done = shell(f"ulimit -f 1; {' '.join(HVCPCTL)} {arguments.format(key=key)} {folder / 'x.wav'}", **NO_BYTECODE)
    assert "cannot be written: File too large; make room" in done.stderr
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_sound_is_added_to_a_file_that_the_shell_adds_to(tmp_path: Path) -> None:
    path = tmp_path / "x"
    assert shell(f"printf before > {path}; {' '.join(HVCPCTL)} say stop --local -o - >> {path}").returncode == 0
    assert path.read_bytes().startswith(b"beforeRIFF")


@needs_full
def test_no_message_can_be_written_either() -> None:
    done = shell(f"{' '.join(HVCPCTL)} --help > /dev/full 2> /dev/full")
    assert done.returncode == 2


@needs_full
def test_a_note_that_cannot_be_written_keeps_nobody_from_stopping(tmp_path: Path) -> None:
    """The robot was not asked."""
    settings = tmp_path / "damaged.yaml"
    settings.write_text("\t: [")
    with obliging_robot(tmp_path) as environment:
        environment |= {"HVCPD_STATE_DIR": str(tmp_path)}
        done = shell(f"{' '.join(HVCPCTL)} stop --config {settings} 2> /dev/full", **environment)
    assert (done.returncode, done.stdout.startswith("Rob stands still")) == (0, True)


@pytest.mark.slow
def test_the_name_of_a_file_does_not_steer_a_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_wav(tmp_path / "\x1b[2J.wav", np.zeros(SAMPLE_RATE_HZ, np.float32))
    assert main(["hear", str(tmp_path / "\x1b[2J.wav")]) == 0
    assert "\N{REPLACEMENT CHARACTER}[2J.wav is silent" in capsys.readouterr().err


@needs_full
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_the_daemons_help_is_no_exception(unbuffered: str) -> None:
    done = shell(f"{' '.join(HVCPD)} --help > /dev/full", PYTHONUNBUFFERED=unbuffered)
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("arguments", ["phrases", "--help", "say stop --local -o -"])
def test_a_reader_that_goes_away_is_no_fault(arguments: str) -> None:
    done = shell(f"{{ {' '.join(HVCPCTL)} {arguments}; echo $? >&2; }} | head -c 1")
    assert done.stderr == "0\n"


@pytest.mark.slow
@pytest.mark.parametrize("arguments", ["bench", "hear -"])
def test_a_full_disk_with_the_temporary_folders_is_told(arguments: str) -> None:
    """It was "standard output: cannot be written", and "/dev/stdin: there is no such file"."""
    done = shell(f"ulimit -f 0; echo RIFF | {' '.join(HVCPCTL)} {arguments}", **NO_BYTECODE)
    assert done.returncode == 2
    assert "no folder for temporary files can be written: make room in /tmp" in done.stderr


@pytest.mark.slow
def test_a_folder_that_was_deleted_is_told(tmp_path: Path) -> None:
    """It was "no folder for temporary files can be written"."""
    here = tmp_path / "here"
    here.mkdir()
    command = f"cd {here}; rmdir {here}; {' '.join(HVCPCTL)} say stop --local -o x.wav"
    done = shell(command, PYTHONPATH=str(Path(__file__).parents[2]))
    assert done.returncode == 2
    assert done.stderr == "hvcpctl: the folder that this runs in has been deleted; change to another\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [("key restore --key key", "these are 0 words, not 24"), ("new-team team", "this is not a terminal")],
)
def test_a_closed_input_has_ended(arguments: str, message: str, tmp_path: Path) -> None:
    done = shell(f"cd {tmp_path}; {' '.join(HVCPCTL)} {arguments} <&-", PYTHONPATH=str(Path(__file__).parents[2]))
    assert done.returncode == 2
    assert done.stderr.startswith(f"hvcpctl: {message}")


def test_a_closed_output_does_no_harm() -> None:
    done = shell(f"{' '.join(HVCPCTL)} phrases >&-")
    assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("environment", "name"),
    [
        ({"PYTHONIOENCODING": "ascii"}, 'Ubung->".yaml'),
        ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, "??bung??????.yaml"),
    ],
)
def test_an_output_without_the_letters_has_others_instead(environment: dict[str, str], name: str) -> None:
    """It was refused."""
    done = shell(f"{' '.join(HVCPCTL)} say --help; {' '.join(HVCPCTL)} phrases --tasks Übung→“.yaml", **environment)
    assert "usage: hvcpctl say" in done.stdout
    assert (done.stdout + done.stderr).isascii()
    assert f"hvcpctl: {name}: there is no such file" in done.stderr


def test_a_device_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_whole(pipe, b"whole")
        assert os.read(reader, 16) == b"whole"
    finally:
        os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_what_a_link_leads_to_is_replaced(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "file")
    write_whole(link, b"whole")
    assert link.is_symlink()
    assert (tmp_path / "file").read_bytes() == b"whole"


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError) as raised:
        write_whole(tmp_path, b"")
    assert unwritable(tmp_path, raised.value) == f"{tmp_path}: cannot be written: Is a directory; name a file in it"


def test_a_folder_where_a_new_file_should_be_is_no_file(tmp_path: Path) -> None:
    """`key sheet -o FOLDER` called it a file."""
    with pytest.raises(FileExistsError) as raised:
        os.close(os.open(tmp_path, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
    assert unwritable(tmp_path, raised.value) == f"{tmp_path}: cannot be written: Is a directory; name a file in it"


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none" / "x.html"
    with pytest.raises(FileNotFoundError) as raised:
        write_whole(path, b"")
    assert f"there is no folder {tmp_path / 'none'}; make it" in unwritable(path, raised.value)


def test_a_folder_that_exists_is_not_said_to_be_missing() -> None:
    """The kernel has no such file there, whatever anybody makes."""
    with pytest.raises(FileNotFoundError) as raised:
        Path("/proc/none").mkdir()
    assert unwritable("/proc/none", raised.value).endswith("No such file or directory; name a file that you may write")


def test_a_file_where_a_folder_should_be_is_told(tmp_path: Path) -> None:
    path = tmp_path / "team"
    path.touch()
    with pytest.raises(FileExistsError) as raised:
        path.mkdir(exist_ok=True)
    told = unwritable(path, raised.value, "name another")
    assert told == f"{path}: cannot be written: there is a file of this name already; name another"
