"""A whole daemon in virtual time under what a unit forbids, while strangers speak to it.

Its log goes to standard output as JSON lines, the last of which says that it lived.

python -m tests.daemon.under_the_unit UNIT STATE_DIR
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.daemon.forbidden import forbid

if __name__ == "__main__":
    forbid(Path(sys.argv[1]))  # before anything else is loaded, as a service's are

import asyncio
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from hvcpd.config.settings_file import load_settings
from hvcpd.daemon.allocator import tune_allocator
from hvcpd.daemon.logging import set_up_logging
from hvcpd.daemon.main_loop import Daemon
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import HvcpdError
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.security.keyring import keep_out_of_dumps
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import Voice
from tests.daemon.virtual import VirtualStream, devices_of, shared_room

STRANGER = Voice("child", 240.0, 1.35, 0.92, -32.0, 0.6, 3000.0)
"""Unlike all robots' voices."""
SENTENCES = (("rob", "what", "is", "left"), ("rob", "stop"), ("rob", "turn", "left"))
BETWEEN_S = 20.0
"""Before the first sentence, for the greeting, and after each."""
PAUSE_S = 2.0
"""Strangers wait until the robot has been silent for so long, as people do: when it speaks depends on its threads."""


class OverError(HvcpdError):
    """Everything was said."""


@dataclass
class Overheard(VirtualStream):
    """A microphone that also hears somebody without a body."""

    talk: list[Samples] = field(default_factory=list)
    """What is still to be said."""
    silent: int = 0
    """Samples since the robot spoke last."""
    waited: int = 0
    """Samples since the last sentence ended."""
    saying: Samples = field(default_factory=lambda: np.zeros(0, np.float32))

    async def read(self) -> Samples:
        heard = await super().read()
        self.silent = 0 if np.any(self.playing) else self.silent + len(heard)
        self.waited = 0 if len(self.saying) else self.waited + len(heard)
        if self.waited >= BETWEEN_S * SAMPLE_RATE_HZ and self.silent >= PAUSE_S * SAMPLE_RATE_HZ:
            if not self.talk:
                raise OverError("everything was said")
            self.saying = self.talk.pop(0)
        piece, self.saying = self.saying[: len(heard)], self.saying[len(heard) :]
        return heard + np.pad(piece, (0, len(heard) - len(piece)))


def talk() -> list[Samples]:
    """What strangers say."""
    speaker = Speaker(STRANGER, Lexicon.load())
    return [0.5 * speaker.render([words]) for words in SENTENCES]


def main(state: Path) -> None:
    """Live until all is said."""
    set_up_logging("info", form="json", stream=sys.stdout)
    tune_allocator()
    keep_out_of_dumps()
    given = {"name": "Rob", "names": ["Bot"], "state_dir": str(state), "seed": 3, "clips.folder": str(state / "clips")}
    settings = load_settings(None, given, system_path=state / "none.yaml")
    with shared_room([settings], lambda _: None) as room:
        stream = room.streams[0] = Overheard(room, talk=talk())
        daemon = Daemon(wire_up(settings), devices_of(room))
        stream.settled = daemon.settled
        with suppress(OverError):
            asyncio.run(daemon.run())
    sys.stdout.write('{"event": "lived"}\n')


if __name__ == "__main__":
    main(Path(sys.argv[2]))
