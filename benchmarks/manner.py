"""How the robots of a benchmark speak: by which synthesizer, in which accent, plainly or for noise."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

from hvcpd.assembly.sound import Sound, make_sound, user_cache_folder
from hvcpd.config.names import Accent
from hvcpd.ports import Samples
from hvcpd.synthesis.delivery import for_noise
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import Voice


class ForNoise(Speaker):
    """A speaker in noise, as loud as without."""

    def render(self, phrases: Sequence[Sequence[str]]) -> Samples:
        return for_noise(super().render(phrases))


@dataclass(frozen=True)
class Manner:
    """The options --natural, --accent and --for-noise."""

    natural: bool = False
    accent: Accent = "us"
    for_noise: bool = False

    def sound(self) -> Sound:
        """The robots' voices, which are rendered once for all benchmarks."""
        return replace(make_sound(None, user_cache_folder(), self.accent), natural=self.natural)

    def speaker(self, voice: Voice, sound: Sound) -> Speaker:
        """Who speaks so, in one of these voices."""
        return (ForNoise if self.for_noise else Speaker)(voice, sound.lexicon, sound.cache)


USUAL = Manner()


def add_manner(parser: argparse.ArgumentParser) -> None:
    """The options of `manner_of`."""
    parser.add_argument("--accent", choices=get_args(Accent), default="us", help="of the robots' voices")
    parser.add_argument("--natural", action="store_true", help="natural voices")
    parser.add_argument("--for-noise", action="store_true", help="robots speak as where it is noisy, no louder")


def manner_of(options: argparse.Namespace) -> Manner:
    """As the options say."""
    return Manner(options.natural, options.accent, options.for_noise)
