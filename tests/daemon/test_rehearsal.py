"""After the rehearsal no sentence needs the synthesizer any more."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest

from hvcpd.assembly import Sound, make_phrasebook
from hvcpd.config.settings import Settings
from hvcpd.daemon.outfit import equip
from hvcpd.daemon.rehearsal import rehearse
from hvcpd.ports import Samples
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import voice_for


class CountingCache(UnitCache):
    """Counts the units that had to be made."""

    made = 0

    def get(self, content: object, make: object) -> Samples:
        def counted() -> Samples:
            self.made += 1
            assert callable(make)
            unit = make()
            assert isinstance(unit, np.ndarray)
            return unit

        return super().get(content, counted)


@pytest.mark.slow
def test_every_sentence_is_ready(tmp_path: Path, units: Path) -> None:
    outfit = equip(Settings(name="Rob", state_dir=tmp_path))
    book = make_phrasebook(outfit.names, outfit.settings.teams, outfit.tasks)
    cache = CountingCache(units)
    rehearse("Rob", book.graph.words, Sound(outfit.sound.lexicon, cache))
    cache.made = 0
    speaker = Speaker(voice_for("Rob"), outfit.sound.lexicon, cache)
    chance = random.Random(1)
    for _ in range(200):
        assert len(speaker.render(book.phrases(book.sample(chance)))) > 0
    assert cache.made == 0


def test_without_a_cache_there_is_nothing_to_do(tmp_path: Path) -> None:
    outfit = equip(Settings(name="Rob", state_dir=tmp_path))
    rehearse("Rob", ["hello"], Sound(outfit.sound.lexicon))
    assert list(tmp_path.iterdir()) == []
