"""The team's key on disk and on paper: who may read it, what is shown of it, and how it is changed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta
from functools import partial
from pathlib import Path

import pytest

from hil_fakes.word_seals import keyed_book
from hvcpd.control.cli import main
from hvcpd.errors import KeyFileError
from hvcpd.language.messages import Code
from hvcpd.language.spelling import number_of
from hvcpd.security.keyring import (
    CREDENTIAL,
    DEFAULT_PATH,
    KeyFile,
    changing,
    find_key_file,
    fresh_entry,
    parse_key_file,
    read_key_file,
    write_key_file,
    written,
)
from hvcpd.security.one_time import counted_code
from hvcpd.security.recovery import secret_of
from tests.coordination.mission import plants
from tests.permissions import bound, needs_permissions

ROOT = Path(__file__).parents[2]
DAY = date(2026, 11, 21)
WEEK, MONTH = timedelta(days=7), timedelta(days=30)
Change = Callable[[list[str]], list[str]]


@pytest.fixture
def made(tmp_path: Path) -> Path:
    path = tmp_path / "team.key"
    write_key_file(path, KeyFile((fresh_entry(DAY),)), replaces=False)
    return path


def run(*words: str) -> int:
    return main(["key", *words])


def test_a_new_key_is_for_its_owner_alone_and_is_not_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "team.key"
    assert run("new", "--key", str(path)) == 0
    assert path.stat().st_mode & 0o777 == 0o600
    keys = read_key_file(path)
    assert f"Print `hvcpctl key sheet --key {path}`" in capsys.readouterr().out
    assert run("show", "--key", str(path)) == 0
    out = capsys.readouterr().out
    assert keys.entries[0].key.fingerprint in out
    assert keys.entries[0].key.secret.hex() not in out
    assert list(tmp_path.iterdir()) == [path]


def test_a_key_is_not_made_over_another(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = made.read_bytes()
    assert run("new", "--key", str(made)) == 2
    remedy = f"change its key with: hvcpctl key rotate --key {made}, or move it away\n"
    assert capsys.readouterr().err == f"hvcpctl: {made}: this is there; {remedy}"
    assert made.read_bytes() == before


@pytest.mark.parametrize(
    ("content", "remedy"),
    [
        ("", "move it away, and make one with: hvcpctl key new"),
        ("key x", "or move it away and type the recovery"),
    ],
)
def test_what_is_advised_for_a_file_without_a_key_is_possible(made: Path, content: str, remedy: str) -> None:
    """`key new` and `key restore`, which were advised, refuse to write over a file."""
    made.write_text(content)
    with pytest.raises(KeyFileError, match=remedy):
        read_key_file(made)


def test_what_is_told_of_a_new_key_has_its_whole_path_here_and_on_the_robots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Robots do not have the folder of the computer where the key is made, and systemd takes no relative path."""
    monkeypatch.chdir(tmp_path)
    assert run("new", "--key", "team.key") == 0
    told = capsys.readouterr().out
    assert f"security: {{key: {DEFAULT_PATH}}}" in told
    assert f"LoadCredential={CREDENTIAL}:{DEFAULT_PATH}. Print `hvcpctl key sheet --key {tmp_path}/" in told


@pytest.mark.parametrize("folder", ["/", "."])
def test_a_folder_is_no_key(folder: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The first was a traceback, and in the second "there is a key already"."""
    assert run("new", "--key", folder) == 2
    assert capsys.readouterr().err == f"hvcpctl: {folder}: this is a folder; name a file in it with --key\n"


@needs_permissions
def test_for_a_key_that_another_user_owns_no_new_one_is_advised(made: Path) -> None:
    """A robot with a new one understands its team no more."""
    made.chmod(0)
    ended = bound("-m", "hvcpd.control.cli", "key", "show", "--key", made)
    remedy = "Permission denied; run as its owner, or make this user its owner\n"
    assert ended.stderr == f"hvcpctl: {made}: the key cannot be read: {remedy}"


def test_a_disk_that_fails_while_the_key_is_read_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """It was "standard output: cannot be written", and a daemon ended with a traceback."""
    fails = "/proc/self/mem"  # whose first page is not there
    assert run("show", "--key", fails) == 2
    told = f"{fails}: the key cannot be read: Input/output error; check its name and its disk"
    assert capsys.readouterr().err == f"hvcpctl: {told}\n"


def test_two_new_keys_differ() -> None:
    assert fresh_entry(DAY).key.secret != fresh_entry(DAY).key.secret


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660])
def test_a_key_that_others_can_read_is_refused_with_the_remedy(made: Path, mode: int) -> None:
    made.chmod(mode)
    with pytest.raises(KeyFileError, match=r"others can read this key; close it with: chmod 600"):
        read_key_file(made)


def test_what_systemd_hands_over_is_found_and_taken_as_it_is(made: Path) -> None:
    credential = made.rename(made.with_name(CREDENTIAL))
    credential.chmod(0o440)
    environment = {"CREDENTIALS_DIRECTORY": str(credential.parent)}
    assert find_key_file(None, environment) == credential
    assert read_key_file(credential, environment).entries[0].made == DAY
    assert find_key_file(None, {}) is None
    assert find_key_file(made, environment) == made


@pytest.mark.parametrize(
    "content",
    ["", "# nothing\n", "key 00 made 2026-11-21 from 2026-11-21\n", "revoked Rob\n", "\0\xff", "key " + "z" * 99],
)
def test_a_broken_key_file_is_refused_without_showing_it(tmp_path: Path, content: str) -> None:
    path = tmp_path / "team.key"
    path.write_text(content)
    path.chmod(0o600)
    with pytest.raises(KeyFileError) as caught:
        read_key_file(path)
    assert str(path) in str(caught.value)
    assert "zzz" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing", "."])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(KeyFileError):
        read_key_file(tmp_path / name)


def test_a_film_is_not_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "film"
    path.write_bytes(bytes(100_000))
    path.chmod(0o600)
    with pytest.raises(KeyFileError, match="too large"):
        read_key_file(path)


def test_a_wrong_day_is_named_by_its_line(made: Path) -> None:
    text = made.read_text().replace("made 2026-11-21", "made 2026-13-21")
    with pytest.raises(KeyFileError, match="line 2"):
        parse_key_file(text, "team.key")


def test_a_key_file_is_read_as_it_was_written() -> None:
    keys = KeyFile((fresh_entry(DAY),), ("Rob",)).rotated(DAY, WEEK, MONTH)
    assert parse_key_file(written(keys), "here") == keys


def test_rotation_lets_robots_be_apart() -> None:
    old = KeyFile((fresh_entry(DAY),))
    new = old.rotated(DAY, WEEK, MONTH)
    first, second = new.entries[0].key, new.entries[1].key
    for day, spoken, others in (
        (DAY, first, (second,)),
        (DAY + WEEK, second, (first,)),
        (DAY + WEEK + MONTH, second, (first,)),
        (DAY + WEEK + MONTH + timedelta(days=1), second, ()),
    ):
        assert (new.ring(day).spoken, new.ring(day).others) == (spoken, others)
    assert old.ring(DAY + timedelta(days=9999)).spoken == first


@pytest.mark.parametrize("day", [None, date(1970, 1, 1)])
def test_without_a_clock_it_is_the_day_of_the_newest_key(day: date | None) -> None:
    keys = KeyFile((fresh_entry(DAY),)).rotated(DAY + WEEK, timedelta(0), MONTH)
    assert keys.ring(day).spoken == keys.entries[-1].key


def test_a_file_whose_keys_have_all_ended_is_refused_with_the_remedy() -> None:
    ended = KeyFile((replace(fresh_entry(DAY + WEEK), until=DAY),))
    with pytest.raises(KeyFileError, match="hvcpctl key rotate"):
        ended.ring(DAY)


def test_an_ended_key_leaves_the_file_at_the_next_rotation() -> None:
    keys = KeyFile((fresh_entry(DAY),)).rotated(DAY, timedelta(0), timedelta(1))
    assert len(keys.rotated(DAY + WEEK, timedelta(0), MONTH).entries) == 2


@pytest.mark.parametrize("day", [None, DAY])
def test_a_stolen_key_can_be_ended_at_once(made: Path, day: date | None, capsys: pytest.CaptureFixture[str]) -> None:
    stolen = read_key_file(made).entries[0].key
    assert run("revoke", "--key", str(made), "Bot") == 0
    advised = capsys.readouterr().out.split("hvcpctl key rotate ")[1].split()
    assert run("rotate", *advised) == 0
    assert stolen not in read_key_file(made).ring(day).accepted
    assert stolen.secret.hex() not in made.read_text()
    assert "no longer believed" in capsys.readouterr().out


def test_a_computer_without_a_clock_ends_no_key_by_rotating() -> None:
    old = KeyFile((fresh_entry(DAY),))
    new = old.rotated(date(1970, 1, 1), WEEK, MONTH)
    assert new.ring(None).spoken == old.entries[0].key
    assert new.ring(DAY + WEEK).accepted == (new.entries[1].key, old.entries[0].key)


def test_who_changes_a_key_file_waits_for_who_is_at_it(made: Path) -> None:
    command = [sys.executable, "-m", "hvcpd.control.cli", "key", "revoke", "--key", str(made), "Bot"]
    with changing(made):
        other = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT)
        with pytest.raises(subprocess.TimeoutExpired):
            other.wait(2.0)
        write_key_file(made, read_key_file(made).with_revoked("Zoe"), replaces=True)
    assert other.wait(30.0) == 0
    assert read_key_file(made).revoked == ("Zoe", "Bot")


def test_a_link_to_a_key_file_stays_a_link(made: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.key"
    link.symlink_to(made.name)
    assert run("revoke", "--key", str(link), "Bot") == 0
    assert read_key_file(made).revoked == ("Bot",)
    assert link.is_symlink()


@pytest.mark.parametrize("days", ["3651", "-1", "000000000999999999", "9" * 5000, "\u0663"])
def test_days_are_a_number_of_days(made: Path, days: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run("rotate", "--key", str(made), "--keep", days)
    assert ended.value.code == 2
    assert "number of days from 0 to 3650" in capsys.readouterr().err


def test_a_name_that_is_not_of_the_team_is_revoked_with_a_warning(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("revoke", "--key", str(made), "bot") == 0
    assert capsys.readouterr().err == ""
    assert run("revoke", "--key", str(made), "Bott") == 0
    assert "Bott is none of the names in the settings (Rob, Bot)" in capsys.readouterr().err
    assert read_key_file(made).revoked == ("bot", "Bott")


def test_a_sheet_tells_of_the_key_that_is_to_follow(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sheet", "--key", str(made)) == 0
    assert capsys.readouterr().err == ""
    assert run("rotate", "--key", str(made), "--after", "3650") == 0
    assert run("sheet", "--key", str(made)) == 0
    old, new = read_key_file(made).entries
    said = capsys.readouterr().err
    assert f"sheet of {old.key.fingerprint}" in said
    assert f"{new.key.fingerprint} has its own from {new.spoken_from} on" in said
    assert run("rotate", "--key", str(made), "--after", "0") == 0
    assert run("sheet", "--key", str(made)) == 0
    assert capsys.readouterr().err == ""  # the one that was to follow is overtaken


def test_rotate_and_revoke_change_the_file(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("rotate", "--key", str(made), "--after", "0", "--keep", "3650") == 0
    assert run("revoke", "--key", str(made), "Bot") == 0
    assert run("revoke", "--key", str(made), "bot") == 0
    keys = read_key_file(made)
    assert (len(keys.entries), keys.revoked) == (2, ("Bot",))
    assert keys.ring(None).is_revoked("BOT")
    assert made.stat().st_mode & 0o777 == 0o600
    assert "rotate --after 0 --keep 0" in capsys.readouterr().out


def test_the_sheet_restores_the_key_and_has_the_codes(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = read_key_file(made).entries[0].key
    assert run("sheet", "--key", str(made), "--codes", "12") == 0
    lines = capsys.readouterr().out.splitlines()
    words = " ".join(lines[5:9]).split()
    assert secret_of(number_of(words) or 0) == key.secret
    assert f"  12 {counted_code(key.sheet_key, 11)}" in "\n".join(lines)
    assert any("otpauth://totp/hvcpd:plant?" in line for line in lines)
    [example] = re.findall('as in "(.*?)"', " ".join(lines))
    book = keyed_book(("Rob", "Bot"), plants(2))
    assert book.parse(example.lower().replace(",", "").split()).mark == Code("123456")


def test_a_sheet_for_who_only_commands_has_no_key(made: Path, tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.txt"
    assert run("sheet", "--key", str(made), "--no-recovery", "-o", str(sheet)) == 0
    assert sheet.stat().st_mode & 0o777 == 0o600
    assert "words" not in sheet.read_text()


def test_a_sheet_without_codes_does_not_speak_of_them(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sheet", "--key", str(made), "--codes", "0") == 0
    printed = capsys.readouterr().out
    assert "One-time" not in printed
    assert not printed.endswith("\n\n")


def recovery_words(path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    run("sheet", "--key", str(path), "--codes", "0")
    return " ".join(capsys.readouterr().out.splitlines()[5:9]).split()


def test_a_key_is_restored_from_its_words(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = recovery_words(made, capsys)
    copy = tmp_path / "copy.key"
    command = [sys.executable, "-m", "hvcpd.control.cli", "key", "restore", "--key", str(copy)]
    done = subprocess.run(command, input=" ".join(words), text=True, capture_output=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    assert read_key_file(copy).entries[0].key == read_key_file(made).entries[0].key


class Typist:
    """Somebody who types the words of a sheet; `meanwhile` is called before the first."""

    def __init__(self, words: list[str], meanwhile: Callable[[], object]) -> None:
        self._words, self._meanwhile = words, meanwhile

    def isatty(self) -> bool:
        return False

    def read(self, _size: int) -> str:
        self._meanwhile()
        return " ".join(self._words)


def test_while_words_are_typed_others_may_change_keys_in_that_folder(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`hvcpctl key` of another terminal waited, without a word, until somebody had typed all 24."""
    typist = Typist(recovery_words(made, capsys), partial(run, "revoke", "--key", str(made), "Bot"))
    monkeypatch.setattr(sys, "stdin", typist)  # Python's own place for what a command reads
    assert run("restore", "--key", str(tmp_path / "copy.key")) == 0
    assert read_key_file(made).revoked == ("Bot",)


def test_words_in_another_encoding_are_no_words(tmp_path: Path) -> None:
    """A file that Windows saved as UTF-16 ended in a traceback."""
    command = [sys.executable, "-m", "hvcpd.control.cli", "key", "restore", "--key", str(tmp_path / "new.key")]
    strict = os.environ | {"PYTHONIOENCODING": "utf-8:strict"}  # as Python has it for all languages but C and POSIX
    words = "acid aged also".encode("utf-16")
    done = subprocess.run(command, input=words, capture_output=True, cwd=ROOT, env=strict, check=False)
    assert (done.returncode, done.stderr.startswith(b"hvcpctl: word 1 is not a code word; type")) == (2, True)


def test_where_no_key_can_be_restored_nobody_types_its_words(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    typist = Typist([], partial(pytest.fail, "the words were asked for"))
    monkeypatch.setattr(sys, "stdin", typist)  # Python's own place for what a command reads
    for path, why in ((made, "this is there"), (tmp_path, "this is a folder"), (tmp_path / "no/x", "cannot be opened")):
        assert run("restore", "--key", str(path)) == 2
        assert why in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda w: [*w[:3], "carburettor", *w[4:]], "word 4 is not a code word"),
        (lambda w: w[:-1], "23 words, not 24"),
        (lambda w: w[:1], "1 word, not 24"),
        (lambda w: [w[1], w[0], *w[2:]], "do not fit together"),
    ],
)
def test_wrong_words_are_not_taken(made: Path, tmp_path: Path, change: Change, said: str) -> None:
    key = KeyFile((fresh_entry(DAY),))
    path = tmp_path / "known.key"
    write_key_file(path, key, replaces=False)
    out = subprocess.run(
        [sys.executable, "-m", "hvcpd.control.cli", "key", "sheet", "--key", str(path), "--codes", "0"],
        text=True,
        capture_output=True,
        cwd=Path(__file__).parents[2],
        check=True,
    ).stdout
    words = " ".join(out.splitlines()[5:9]).split()
    if words[0] == words[1]:
        words[0] = next(word for word in ("tango", "kilo") if word != words[1])
    done = subprocess.run(
        [sys.executable, "-m", "hvcpd.control.cli", "key", "restore", "--key", str(tmp_path / "new.key")],
        input=" ".join(change(words)),
        text=True,
        capture_output=True,
        cwd=Path(__file__).parents[2],
        check=False,
    )
    assert (done.returncode, said in done.stderr) == (2, True), done.stderr
    assert not (tmp_path / "new.key").exists()


def test_a_process_with_a_key_leaves_no_core_and_lets_nobody_look() -> None:
    look = (
        "import ctypes, resource; from hvcpd.security.keyring import keep_out_of_dumps; keep_out_of_dumps(); "
        "print(ctypes.CDLL(None).prctl(3, 0, 0, 0, 0), resource.getrlimit(resource.RLIMIT_CORE))"
    )
    done = subprocess.run(
        [sys.executable, "-c", look], text=True, capture_output=True, check=True, cwd=Path(__file__).parents[2]
    )
    assert done.stdout.strip() == "0 (0, 0)"
