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
SENTENCES = (("rob", "what", "is", "left"), ("rob", "stop"), ("rob", "resume"))
QUIET_S = 20.0
"""Before the first sentence, for the greeting, and between two."""


class OverError(HvcpdError):
    """Everything was said."""


@dataclass
class Overheard(VirtualStream):
    """A microphone that also hears somebody without a body."""

    talk: Samples = field(default_factory=lambda: np.zeros(0, np.float32))
    at: int = 0

    async def read(self) -> Samples:
        heard = await super().read()
        piece = self.talk[self.at : self.at + len(heard)]
        self.at += len(heard)
        if len(piece) < len(heard):
            raise OverError("everything was said")
        return heard + piece


def talk() -> Samples:
    """What strangers say, with quiet around it."""
    speaker = Speaker(STRANGER, Lexicon.load())
    quiet = np.zeros(round(QUIET_S * SAMPLE_RATE_HZ), np.float32)
    parts = [part for words in SENTENCES for part in (quiet, 0.5 * speaker.render([words]))]
    return np.concatenate([*parts, quiet])


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
