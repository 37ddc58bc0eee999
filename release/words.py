"""The words that come with the package, rendered: all that the default phrasebook says and names that are
common, in each of the eight voices.

python -m release.words FOLDER

Written while the package is built and never kept in the repository; the form is `hvcpd/synthesis/shipped.py`'s.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import soundfile

from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_NAMES, DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.synthesis.shipped import INDEX, in_steps
from hvcpd.synthesis.voices import VOICES

COMPRESSION = 1.0
"""libsndfile's most: 3 % smaller than its usual, and no slower to read."""


COMMON_NAMES = ("Anna", "Max")
"""Names that the documentation's teams have, beside the default ones: 0.11 MB each. A robot renders others itself."""


def default_words() -> tuple[str, ...]:
    """What robots with the default and the common names, the default teams and tasks say."""
    names = (*DEFAULT_NAMES, *COMMON_NAMES)
    return make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path())).marked_graph.words


def write_words(words: Iterable[str], folder: Path) -> int:
    """Write the units by which these words are heard, in all voices, into `folder`; their size in bytes.

    The pitch is the voice's own: that of templates, and of the middle of sentences. Raises OSError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sound, index = make_sound(None, user_cache_folder()), {}
    for voice in VOICES:
        speaker = sound.speaker_in(voice)
        units = dict(unit for word in sorted(words) for unit in speaker.keyed(word))
        index[voice.name] = [(key, len(unit)) for key, unit in units.items()]
        steps = in_steps(np.concatenate(list(units.values())))
        path = folder / f"{voice.name}.flac"
        soundfile.write(str(path), steps, SAMPLE_RATE_HZ, subtype="PCM_16", compression_level=COMPRESSION)
    (folder / INDEX).write_text(json.dumps(index), encoding="ascii")
    return sum(path.stat().st_size for path in folder.iterdir())


def main(arguments: Sequence[str]) -> int:
    """Write them; returns the exit status."""
    parser = argparse.ArgumentParser(prog="release.words", description="Render the words that come with the package.")
    parser.add_argument("folder", type=Path)
    sys.stdout.write(f"{write_words(default_words(), parser.parse_args(arguments).folder) / 1e6:.1f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
