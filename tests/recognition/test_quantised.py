"""Sounds in half the memory."""

from __future__ import annotations

import numpy as np
import pytest

from hvcpd.assembly.rendered_waveforms import QUANTA, quantised, restored


def test_a_sound_is_restored_but_for_half_a_step() -> None:
    sound = np.asarray(np.random.default_rng(1).uniform(-1.9, 1.9, (3, 500)), np.float32)
    again = restored(quantised(sound))
    assert (again.dtype, again.shape) == (np.float32, sound.shape)
    assert again == pytest.approx(sound, abs=0.5 / float(QUANTA) + 1e-7)


def test_what_is_too_loud_is_cut_off() -> None:
    assert restored(quantised(np.array([5.0, -5.0], np.float32))) == pytest.approx([2.0, -2.0], abs=1e-4)
