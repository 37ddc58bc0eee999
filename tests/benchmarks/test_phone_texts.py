"""What the phone nets learn from: texts, and what is known of recordings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from benchmarks.phones.recorded import COFFEE_ORDERS, half_of, orders_of_coffee
from benchmarks.phones.texts import NAMES, Texts
from hvcpd.hardware.soundfile import write_wav

KNOWN = dict.fromkeys(
    "file line string object list value return call default error class method function argument type given "
    "example module number path match pattern socket thread queue buffer header message".split(),
    ("AH",),
)
"""Words of docstrings, from which names and tasks are drawn."""


def share_with_names(texts: Texts, n: int) -> float:
    names = {name.lower() for name in NAMES}
    drawn = [texts.draw().words for _ in range(n)]
    return sum("am" in words[:-1] and words[words.index("am") + 1] in names for words in drawn) / n


def test_usual_texts_have_usual_names_in_sentences_and_others_do_not() -> None:
    assert share_with_names(Texts(KNOWN, 3, usual=True, n_books=2), 200) > 0.2
    assert share_with_names(Texts(KNOWN, 3, n_books=2), 200) == 0.0


def test_the_same_seed_draws_the_same_texts() -> None:
    one, other = (Texts(KNOWN, 5, usual=True, n_books=2) for _ in range(2))
    assert [one.draw() for _ in range(20)] == [other.draw() for _ in range(20)]


def test_each_order_of_coffee_names_one_recording() -> None:
    lines = COFFEE_ORDERS.read_text(encoding="utf-8").splitlines()
    assert all(re.fullmatch(r"[0-9a-f]{8}\t[a-z' ]+", line) for line in lines)
    assert len({line.split("\t")[0] for line in lines}) == len(lines) > 100


def test_orders_of_coffee_are_of_recordings_that_are_there_and_of_one_half(tmp_path: Path) -> None:
    names = [line.split("\t")[0] for line in COFFEE_ORDERS.read_text(encoding="utf-8").splitlines()[:10]]
    (tmp_path / "negatives").mkdir()
    for name in (*names, "ffffffff"):
        sound = np.sin(np.arange(8000, dtype=np.float32))
        write_wav(tmp_path / "negatives" / f"{name}-rest.wav", sound)
    for part in ("train", "test"):
        found = orders_of_coffee(tmp_path, part)
        assert all(u.words for u in found)
        assert [u.speaker[:8] for u in found] == sorted(n for n in names if half_of(Path(f"{n}-rest.wav")) == part)
