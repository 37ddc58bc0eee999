"""A team's words and sounds: its phrasebook, its pronunciations and its voices, without a recogniser.

Commands that only speak or write start quickly with this: the recogniser's modules take most of the time that a robot's
start takes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

from hvcpd.config.folders import xdg_folder
from hvcpd.config.names import Accent
from hvcpd.config.tasks import TaskRepository
from hvcpd.errors import ConfigError
from hvcpd.language.forms import OPEN_KINDS, SEALED_KINDS, Kind
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.synthesis.acoustic_net import WEIGHTS, read_weights
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.recorded import RecordedSpeaker
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.unit_cache import UnitCache
from hvcpd.synthesis.voices import VOICES, Voice, voice_for


@dataclass(frozen=True)
class Sound:
    """The source of pronunciations, the cache of rendered units, and each robot's voice.

    `voices` and `recorded` have the robots, by name in lower case, whose voice was chosen and does not follow from the
    name. All other voices are `natural` or the formant synthesizer's.
    """

    lexicon: Lexicon
    cache: UnitCache | None = None
    voices: Mapping[str, Voice] = field(default_factory=dict)
    recorded: Mapping[str, RecordedSpeaker] = field(default_factory=dict)
    natural: bool = False

    def voice_of(self, name: str) -> Voice:
        """The synthesizer's voice of that robot."""
        return self.said_by(self.voices.get(name.lower()) or voice_for(name))

    def said_by(self, voice: Voice) -> Voice:
        """That voice by the team's synthesizer."""
        return replace(voice, natural=self.natural)

    def made_natural(self, weights: Path = WEIGHTS) -> Sound:
        """The same with natural voices. Raises ConfigError where the network's weights cannot be used, or where the
        accent is not its talker's."""
        if self.lexicon.accent != "us":
            raise ConfigError(
                "accent: natural voices are American; leave out `accent`, or choose `synthesizer: formant`"
            )
        read_weights(weights)
        return replace(self, natural=True)

    def speaker_in(self, voice: Voice) -> Speaker:
        """Speaks with that voice, as nobody in particular."""
        return Speaker(voice, self.lexicon, self.cache)

    def every_voice(self) -> tuple[Voice, ...]:
        """The eight voices by the team's synthesizer."""
        return tuple(map(self.said_by, VOICES))

    def speaker_of(self, name: str, rate: float = 1.0) -> Speaker:
        """Speaks as that robot; `rate` below 1 is slower, which recordings cannot be."""
        voice = self.voice_of(name)
        recorded = self.recorded.get(name.lower())
        return recorded or self.speaker_in(replace(voice, rate=rate * voice.rate))


def make_sound(lexicon: Path | None = None, cache_folder: Path | None = None, accent: Accent = "us") -> Sound:
    """Pronunciations (with a lexicon file of the user's own, if any) in that accent, and a cache of rendered units on
    disk.

    Raises ConfigError with every fault of the lexicon file.
    """
    return Sound(Lexicon.load(lexicon, accent), UnitCache(cache_folder) if cache_folder is not None else None)


def user_cache_folder() -> Path | None:
    """Where a person's commands keep rendered units, by the XDG base directories; None without a home."""
    try:
        return (xdg_folder("XDG_CACHE_HOME") or Path.home() / ".cache") / "hvcpd" / "units"
    except RuntimeError:
        return None


_phrasebook = lru_cache(1)(Phrasebook)
"""A start asks for the same one five times."""


def make_phrasebook(
    names: Sequence[str], teams: Iterable[str], tasks: TaskRepository, sealed: bool = False, encrypted: bool = False
) -> Phrasebook:
    """The phrasebook of a team, `sealed` if it has a key, `encrypted` if it encrypts its statements. Raises PhraseError
    when its words clash."""
    return _phrasebook(
        Vocabulary(
            names=tuple(dict.fromkeys(names)),
            teams=tuple(dict.fromkeys(team.lower() for team in teams)),
            tasks=(*(task.name for task in tasks.tasks), *tasks.other_tasks),
            numbers=tuple(task.number for task in tasks.tasks),
            remarks=tasks.remarks,
            failures=tasks.failures,
            places=tuple(place.name for place in tasks.places),
            alternatives=tasks.alternatives,
            kinds=frozenset(Kind) if encrypted else SEALED_KINDS if sealed else OPEN_KINDS,
        )
    )
