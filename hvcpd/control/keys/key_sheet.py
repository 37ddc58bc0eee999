"""The sheet of a team's key, to be printed: the key in words, and the codes that people say."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date

from hvcpd.language.code_words import BITS, words_of
from hvcpd.security.keys import KEY_BYTES, TeamKey
from hvcpd.security.one_time import authenticator_uri, counted_code
from hvcpd.security.recovery import CHECK_BYTES, checked_number

RECOVERY_WORDS = 8 * (KEY_BYTES + CHECK_BYTES) // BITS
A_LINE = 6
"""Words or codes in a line."""


def sheet(key: TeamKey, team: str, day: date, first: int, codes: int, recovery: bool) -> str:
    """The text; codes from number `first` (1 and up) on."""
    lines = [f"hvcpd: team {team}, key {key.fingerprint}, printed {day}", "Keep this sheet locked away.", ""]
    if recovery:
        lines += [f"The key in {RECOVERY_WORDS} words (hvcpctl key restore):", ""]
        lines += [*_rows(words_of(checked_number(key.secret), RECOVERY_WORDS)), ""]
    lines += ["For a telephone's authenticator:", "", f"  {authenticator_uri(key.clock_key, team)}", ""]
    lines += [
        'One-time codes. Say "code" and the six digits after a sentence, as in "Rob, move forward one metre, code one',
        'two three four five six". Use them in order, and cross out what was said.',
        "",
    ]
    numbers = range(first - 1, first - 1 + codes)
    return "\n".join(lines + _rows(f"{n + 1:4} {counted_code(key.sheet_key, n)}" for n in numbers)) + "\n"


def _rows(cells: Iterable[str]) -> list[str]:
    given = tuple(cells)
    width = max(map(len, given), default=0) + 2
    rows = (given[start : start + A_LINE] for start in range(0, len(given), A_LINE))
    return ["  " + "".join(f"{cell:<{width}}" for cell in row).rstrip() for row in rows]
