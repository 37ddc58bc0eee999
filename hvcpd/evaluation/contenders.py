"""The recognisers to compare: ours, and those that are installed. Light, because the cost of each is measured, too."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.evaluation import listeners, porcupine
from hvcpd.evaluation.listeners import CALLER, OURS, PEER, Said
from hvcpd.evaluation.porcupine import NAMES, PORCUPINE
from hvcpd.evaluation.sphinx import sphinx_installed
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import Samples

Listen = Callable[[Samples, Sequence[Said]], object]
"""To a sound; and where in it each sentence is, for a reader."""


@cache
def book() -> Phrasebook:
    """All that one robot can say to four whose names are words that Porcupine knows."""
    return make_phrasebook((*NAMES, CALLER), DEFAULT_TEAMS, listeners.tasks())


def everybody() -> list[str]:
    """The listeners available on this machine."""
    installed = {OURS: True, PEER: sphinx_installed(), PORCUPINE: porcupine.available()}
    return [name for name, there in installed.items() if there]


def _ours() -> Listen:
    recogniser = make_speech_recogniser(book(), (CALLER,), listeners.sound())
    return lambda heard, _said: listeners.sentences(recogniser, heard)


def _peer() -> Listen:
    listeners.decoder(book())  # is cached
    return lambda heard, said: listeners.peer(heard, said, book())


def _porcupine() -> Listen:
    porcupine.detections(np.zeros(0, np.float32))
    return lambda heard, _said: porcupine.detections(heard)


MAKERS = {OURS: _ours, PEER: _peer, PORCUPINE: _porcupine}
"""What makes each listener, for its cost."""
