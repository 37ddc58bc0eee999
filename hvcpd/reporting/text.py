"""Words, numbers and times as people read them; text from outside made harmless to a terminal or a page."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

_HARMFUL = {"Cc", "Cs", "Zl", "Zp"}
"""Unicode categories that steer a terminal (escape sequences) or cannot be encoded (lone surrogates)."""
_BIDI = frozenset("\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""They turn the order of what follows round, so that a line can pretend to say something else."""


def clean(text: str) -> str:
    """The text on one line, with whatever could steer a terminal or a page replaced by U+FFFD."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        " " if c in "\n\t" else "\N{REPLACEMENT CHARACTER}" if unicodedata.category(c) in _HARMFUL or c in _BIDI else c
        for c in text
    )


def clock(at_s: float) -> str:
    """A time as minutes and seconds: 3:05."""
    if not math.isfinite(at_s):
        return "–"
    whole = max(round(at_s), 0)
    return f"{whole // 60}:{whole % 60:02d}"


def if_known(confidence: float, form: str) -> str:
    """A confidence in its place in `form`; nothing if it is NaN, as where a word was heard by itself."""
    return form.format(percent(confidence)) if math.isfinite(confidence) else ""


def at_least(confidences: Iterable[float], form: str) -> str:
    """What confidences reach or exceed, in its place in `form`: "98 % or more", but "100 %"; nothing if all are NaN."""
    least = min(filter(math.isfinite, confidences), default=math.nan)
    return if_known(least, form if percent(least) == percent(1.0) else form.format("{} or more"))


def over_noise(snr_db: float) -> str:
    """A signal-to-noise ratio in words: "21 dB over the noise", "3 dB below the noise"."""
    return f"{abs(round(snr_db))} dB {'below' if round(snr_db) < 0 else 'over'} the noise"


def how_sure(confidence: float | None, snr_db: float | None) -> str:
    """How a sentence was heard: "heard, 97 % sure, 21 dB over the noise"; NaN or None: not known."""
    if confidence is None or math.isnan(confidence):
        return "heard, the word by itself"
    noise = f", {over_noise(snr_db)}" if snr_db is not None else ""
    return f"heard, {percent(confidence)} sure{noise}"


def number(value: float, decimals: int = 2) -> str:
    """A number without trailing zeros; 0 for what is not finite."""
    if not math.isfinite(value):
        return "0"
    text = f"{value:.{decimals}f}"
    return "0" if float(text) == 0 else text.rstrip("0").rstrip(".") if "." in text else text


def task_words(number: int, name: str | None) -> str:
    """A task in words, its name made harmless: "task 3, water the rose", or "task 3" for one without a name."""
    return f"task {number}, {clean(name)}" if name and name != f"task {number}" else f"task {number}"


def skill_words(call: Mapping[str, Any]) -> str:
    """What a skill is at, for people: "pour (litres 0.25): running, 40 %". `call`: the fields of the event `Skill`."""
    details = ", ".join(f"{name} {_plain(value)}" for name, value in (call["results"] or call["arguments"]).items())
    head = f"{call['skill']} ({details})" if details else str(call["skill"])
    running = call["share"] is not None and call["state"] in ("running", "paused")
    done = percent(call["share"]) if running else ""
    return f"{head}: {', '.join(filter(None, (call['state'], done, call['text'])))}"


def _plain(value: object) -> str:
    return number(float(value), 3) if isinstance(value, int | float) else str(value)


def percent(value: float) -> str:
    """A share of 1 as whole percent."""
    return f"{100 * value:.0f} %" if math.isfinite(value) else "– %"


def plural(count: int, one: str) -> str:
    """The count with its noun: 1 task, 2 tasks."""
    return f"{count} {one}{'s' * (count != 1)}"


def seal_words(seal: str) -> str:
    """What is shown of an event's seal: "sealed ✓", "not trusted"; empty without one."""
    return f"{seal} ✓" if seal and seal != "not trusted" else seal


def listed(names: Iterable[str]) -> str:
    """Rob; Rob and Bot; Rob, Bot and Zoe."""
    each = list(names)
    return " and ".join(filter(None, [", ".join(each[:-1]), *each[-1:]]))


def without_common_start(names: Sequence[str]) -> list[str]:
    """The names without the words that all begin with: "water the green rose" → "green rose" among its like."""
    split = [name.split() for name in names]
    shared = 0
    if len(split) > 1:
        shortest = min(len(words) for words in split)
        while shared < shortest - 1 and len({words[shared] for words in split}) == 1:
            shared += 1
    return [" ".join(words[shared:]) or name for words, name in zip(split, names, strict=True)]


def shown_away(peer: Mapping[str, Any]) -> str:
    """How far a peer is, as `status` has it of the last measurement; empty if there was none."""
    away = peer.get("away")
    if away is None:
        return ""
    return f"{away['distance_m']:.2f} ± {away['deviation_m']:.2f} m{'' if away['sure'] else ', unsure'}"


def columns(rows: Sequence[tuple[str, ...]], right: Collection[int] = ()) -> list[str]:
    """Rows of cells as lines, each column as wide as its widest cell."""
    rows = [tuple(map(clean, row)) for row in rows]
    wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(n) if k in right else cell.ljust(n) for k, (cell, n) in enumerate(zip(row, wide, strict=True))
        ).rstrip()
        for row in rows
    ]
