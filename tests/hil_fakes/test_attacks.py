"""The attack suite on sealed speech: nothing that an attacker without a key can do is believed."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_fakes.audio_attacks import AudioAttacks
from hil_fakes.word_attacks import WordAttacks
from hvcpd.assembly.sound import make_sound
from hvcpd.security.guard import NEAR
from tests.coordination.mission import plants


@pytest.mark.parametrize("encrypts", [False, True])
def test_no_attack_is_believed_and_honest_robots_are(encrypts: bool) -> None:
    tally = WordAttacks(1, plants(5), encrypts=encrypts).run(420)
    assert sum(tally.believed.values()) == 0
    assert len(tally.tried) == 14
    assert set(tally.tried.values()) == {30}
    assert tally.honest > 250
    assert tally.honest_believed == tally.honest


def test_shorter_seals_are_guessed_as_often_as_computed() -> None:
    """So the suite sees attacks that succeed; without a seal none does even then."""
    bits, n = 8, 1400
    tally = WordAttacks(3, plants(5), bits).run(n)
    guesses = tally.tried["guess"] + tally.tried["other words under an unheard seal"]
    expected = guesses * (1.0 - (1.0 - 2.0**-bits) ** NEAR)
    found = tally.believed["guess"] + tally.believed["other words under an unheard seal"]
    assert 0.3 * expected < found < 4.0 * expected
    assert tally.believed["no seal"] == 0


@pytest.mark.slow
def test_no_attack_with_sound_is_believed_and_the_honest_robot_is(units: Path) -> None:
    attacks = AudioAttacks(3, make_sound(None, units))
    attacks.run(13)
    assert set(attacks.tried.values()) == {1}
    assert sum(attacks.believed.values()) == 0
    assert attacks.honest[0] == attacks.honest[1] >= 5
