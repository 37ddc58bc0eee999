"""What the network decodes later is what it would have decoded at once."""

from __future__ import annotations

import numpy as np

from hvcpd.recognition.decoder_session import DecoderSession, SessionSettings
from hvcpd.recognition.frontend import energies_of
from hvcpd.recognition.network import Network
from hvcpd.recognition.templates import TemplateBank
from tests.recognition.signals import graph, sentence, templates

BANK = TemplateBank(templates())
SOUND = sentence("hi rob") + np.random.default_rng(3).normal(0.0, 1e-3, len(sentence("hi rob"))).astype(np.float32)
ENERGIES = energies_of(SOUND)
NOISE = ENERGIES[-8:].mean(axis=0)


def decoded(at_once: bool) -> tuple[DecoderSession, list[int]]:
    session = DecoderSession(Network(graph(), BANK.templates), BANK, SessionSettings())
    session.wake(ENERGIES[:12], 0, NOISE)
    left = list(session.catch_up(NOISE)) if at_once else []
    for end in range(16, len(ENERGIES) + 1, 4):
        session.defer(ENERGIES[end - 4 : end], ENERGIES[max(end - 40, 0) : end])
        left += list(session.catch_up(NOISE)) if at_once else []
    return session, left + list(session.catch_up(NOISE))


def test_deferred_frames_are_decoded_as_if_at_once() -> None:
    (now, left_now), (later, left_later) = decoded(True), decoded(False)
    assert now.best == later.best
    assert now.best.cost < -10.0
    assert left_now == [0] * len(left_later)
    assert left_later == list(range(4 * len(left_later) - 4, -1, -4))


def test_only_frames_since_it_woke_count_as_deferred() -> None:
    session = DecoderSession(Network(graph(), BANK.templates), BANK, SessionSettings())
    session.wake(ENERGIES[:12], 0, NOISE)
    assert session.deferred_frames == 0
    session.defer(ENERGIES[12:16], ENERGIES[:16])
    assert session.deferred_frames == 4
    session.sleep()
    assert session.deferred_frames == 0
