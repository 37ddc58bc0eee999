"""A task's icon: a name that is drawn, or one character; strict."""

from __future__ import annotations

import subprocess
import sys

import pytest

from hvcpd.config.icons import ICONS, is_one_character, valid_icon


@pytest.mark.parametrize(
    "icon", [*ICONS, "A", "§", "★", "📚", "☂️", "👍🏽", "🇫🇷", "👩‍🌾", "❤️‍🔥", "1️⃣", "é", "e\u0301", "本"]
)
def test_a_name_or_a_single_character_is_an_icon(icon: str) -> None:
    assert valid_icon(icon) is None


@pytest.mark.parametrize(
    "icon",
    ["", " ", "ab", "📚📚", "🇫🇷🇩🇪", "\u0301", "\ufe0f", "\u200d", "👩\u200d", "a\u200db", "\x1b", "\u202e", "\ud800"],
)
def test_anything_else_is_not(icon: str) -> None:
    assert valid_icon(icon) is not None
    assert not is_one_character(icon)


def test_a_mistyped_name_has_its_nearest_proposed() -> None:
    assert (
        valid_icon("flour") == "'flour' is not an icon; did you mean 'flower'? any single character or emoji also works"
    )
    assert "known are: flower, book" in (valid_icon("elephant") or "")


def test_looking_at_icons_needs_nothing_heavy() -> None:
    code = "import sys, hvcpd.config.icons; print('numpy' in sys.modules, 'rich' in sys.modules)"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        == "False False\n"
    )
