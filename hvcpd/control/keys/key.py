"""`hvcpctl key`: make, show, print, change, revoke and restore a team's key."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

from hvcpd.config.settings_file import load_settings
from hvcpd.control.output import print_note
from hvcpd.errors import KeyFileError, writing
from hvcpd.language.spelling import BITS, number_of, words_of
from hvcpd.language.words import spoken_words
from hvcpd.reporting.text import plural
from hvcpd.security.keyring import (
    CREDENTIAL,
    DEFAULT_PATH,
    Entry,
    KeyFile,
    changing,
    find_key_file,
    fresh_entry,
    keep_out_of_dumps,
    key_command,
    read_key_file,
    see_free,
    write_key_file,
)
from hvcpd.security.keys import KEY_BYTES, TeamKey
from hvcpd.security.one_time import authenticator_uri, counted_code
from hvcpd.security.recovery import CHECK_BYTES, checked_number, secret_of

Today = Callable[[], date]

RECOVERY_WORDS = 8 * (KEY_BYTES + CHECK_BYTES) // BITS
A_LINE = 6
"""Words or codes in a line."""


def today() -> date:
    """By the clock of this computer."""
    return datetime.now(UTC).date()


def run(options: argparse.Namespace, day: Today = today) -> None:
    """Carry out the action; keys go into their file, and nowhere else unless a sheet is requested."""
    keep_out_of_dumps()
    _ACTIONS[options.action](options, _path(options), day())


def _path(options: argparse.Namespace) -> Path:
    if options.key is not None:
        return Path(options.key)
    settings = load_settings(options.config, name_needed=False)
    return find_key_file(settings.security.key) or DEFAULT_PATH


def _new(_options: argparse.Namespace, path: Path, day: date) -> None:
    _store_first(path, fresh_entry(day), "made")


def _restore(_options: argparse.Namespace, path: Path, day: date) -> None:
    with changing(path):  # and not while somebody types: others would wait for that
        see_free(path)
    if sys.stdin.isatty():
        sys.stderr.write(f"Type the {RECOVERY_WORDS} words of the recovery sheet, then Ctrl-D:\n")
    words = spoken_words(sys.stdin.read(10_000))
    number = number_of(words)
    if len(words) != RECOVERY_WORDS or number is None:
        wrong = next((place for place, word in enumerate(words, 1) if number_of((word,)) is None), None)
        what = (
            f"word {wrong} is not a code word"
            if wrong
            else f"these are {plural(len(words), 'word')}, not {RECOVERY_WORDS}"
        )
        raise KeyFileError(f"{what}; type them as on the recovery sheet")
    secret = secret_of(number)
    if secret is None:
        raise KeyFileError("the words do not fit together: one is wrong, or two are swapped; compare them again")
    _store_first(path, Entry(TeamKey(secret), day, day), "restored")


def _store_first(path: Path, entry: Entry, done: str) -> None:
    with changing(path):
        write_key_file(path, KeyFile((entry,)), replaces=False)
    path = path.absolute()  # it may be printed from another folder
    _tell(
        f"The team's key is {done}: {path} (fingerprint {entry.key.fingerprint}). Copy it by hand to {DEFAULT_PATH} on "
        f"every robot of the team, readable for the daemon's user alone, and set `security: {{key: {DEFAULT_PATH}}}` "
        "there; or have systemd hand it to the service: systemctl edit hvcpd, with the lines [Service] and "
        f"LoadCredential={CREDENTIAL}:{DEFAULT_PATH}. Print `{key_command('sheet', path)}` and lock it away."
    )


def _show(_options: argparse.Namespace, path: Path, day: date) -> None:
    keys = read_key_file(path)
    ring = keys.ring(day)
    for entry in keys.entries:
        state = "spoken" if entry.key == ring.spoken else "accepted" if entry.key in ring.others else "ended"
        until = f", until {entry.until}" if entry.until else ""
        _tell(f"{entry.key.fingerprint}  {state:9} made {entry.made}, spoken from {entry.spoken_from}{until}")
    _tell(f"revoked: {', '.join(keys.revoked) or 'nobody'}")


def _sheet(options: argparse.Namespace, path: Path, day: date) -> None:
    keys = read_key_file(path)
    settings = load_settings(options.config, name_needed=False)
    ring = keys.ring(day)
    text = sheet(ring.spoken, settings.team, day, options.first, options.codes, not options.no_recovery)
    for entry in keys.entries:
        will_be_spoken = entry.until is None and entry.spoken_from > max(day, keys.newest)
        if entry.key != ring.spoken and will_be_spoken:
            print_note(
                f"this is the sheet of {ring.spoken.fingerprint}; the newer key {entry.key.fingerprint} has its own "
                f"from {entry.spoken_from} on: print that then"
            )
    if options.output is None:
        sys.stdout.write(text)
        return
    with writing(options.output, KeyFileError, otherwise="name another with -o"):
        handle = os.open(options.output, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
        except OSError:
            options.output.unlink()  # a cut sheet could be printed
            raise


def _rotate(options: argparse.Namespace, path: Path, day: date) -> None:
    after, keep = timedelta(days=options.after), timedelta(days=options.keep)
    with changing(path):
        keys = read_key_file(path).rotated(day, after, keep)
        write_key_file(path, keys, replaces=True)
    newest = keys.entries[-1]
    if len(keys.entries) == 1:
        _tell(
            f"A new key: fingerprint {newest.key.fingerprint}; the old one is no longer believed, where this file is: "
            f"copy {path} to every other robot and restart hvcpd there. Print `{key_command('sheet', path)}` "
            "anew."
        )
        return
    _tell(
        f"A new key: fingerprint {newest.key.fingerprint}, spoken from {newest.spoken_from}. Copy {path} to every "
        f"robot before then and restart hvcpd there; the old key is believed until {newest.spoken_from + keep}. "
        f"Print `{key_command('sheet', path)}` anew on the first day of the new one."
    )


def _revoke(options: argparse.Namespace, path: Path, _day: date) -> None:
    names = load_settings(options.config, name_needed=False).names
    if options.name.casefold() not in map(str.casefold, names):
        print_note(f"{options.name} is none of the names in the settings ({', '.join(names)}); is it spelled so?")
    with changing(path):
        write_key_file(path, read_key_file(path).with_revoked(options.name), replaces=True)
    _tell(
        f"{options.name} is no longer believed, where this file is: copy {path} to every other robot and restart hvcpd "
        "there. If somebody may have read its memory card, that is not enough: "
        f"{key_command('rotate --after 0 --keep 0', path)}"
    )


def _tell(text: str) -> None:
    sys.stdout.write(text + "\n")


_ACTIONS: dict[str, Callable[[argparse.Namespace, Path, date], None]] = {
    "new": _new,
    "show": _show,
    "sheet": _sheet,
    "rotate": _rotate,
    "revoke": _revoke,
    "restore": _restore,
}


def sheet(key: TeamKey, team: str, day: date, first: int, codes: int, recovery: bool) -> str:
    """The text; codes from number `first` (1 and up) on."""
    lines = [f"hvcpd: team {team}, key {key.fingerprint}, printed {day}", "Keep this sheet locked away.", ""]
    if recovery:
        lines += [f"The key in {RECOVERY_WORDS} words (hvcpctl key restore):", ""]
        lines += [*_rows(words_of(checked_number(key.secret), RECOVERY_WORDS)), ""]
    lines += ["For a telephone's authenticator:", "", f"  {authenticator_uri(key.clock_key, team)}", ""]
    if codes:
        lines += [
            'One-time codes. Say "code" and the six digits after a sentence, as in "Rob, move forward one metre, code',
            'one two three four five six". Use them in order, and cross out what was said.',
            "",
        ]
    numbers = range(first - 1, first - 1 + codes)
    lines += _rows(f"{n + 1:4} {counted_code(key.sheet_key, n)}" for n in numbers)
    return "\n".join(lines).rstrip() + "\n"


def _rows(cells: Iterable[str]) -> list[str]:
    given = tuple(cells)
    width = max(map(len, given), default=0) + 2
    rows = (given[start : start + A_LINE] for start in range(0, len(given), A_LINE))
    return ["  " + "".join(f"{cell:<{width}}" for cell in row).rstrip() for row in rows]
