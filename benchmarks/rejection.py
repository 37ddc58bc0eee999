"""False alarms: counts commands recognised in talk and noise while nobody speaks to a robot. There should be none.

    python -m benchmarks.rejection --data DIR [--names Rob,Bot;Max,Ann] [--gain-db 0,-12,12] [--minutes 60]
        [--acquainted]

Every WAV below DIR is heard, one after the other in one stream, at each gain, by a robot of each team. With
--acquainted it has heard each robot of the team before, and so knows the responses from their voices.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.hearing.material import make_team
from benchmarks.hearing.worlds.trials import hear
from benchmarks.own_voice import way
from benchmarks.stop import SPEECH_DBFS, at_level, room
from hil_fakes.loudspeakers import SMALL
from hvcpd.assembly.make import make_speech_recogniser
from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.hardware.soundfile import read_wav
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised
from hvcpd.recognition.stages import SpeechRecogniser

BLOCK = 1600
RT60_S = 0.4


def meet(recogniser: SpeechRecogniser, names: Sequence[str]) -> None:
    """Let a recogniser hear each robot say who it is, through a small loudspeaker in a room."""
    for k, (name, speaker) in enumerate(make_team(names).speakers().items()):
        said = np.pad(speaker.render([["hi", "all", "i", "am", name.lower()]]), 2 * SAMPLE_RATE_HZ)
        through = way(RT60_S, 1.0 + k, np.random.default_rng(k))
        echoing = np.convolve(SMALL.play(said), through)[: len(said)]
        arrived = at_level(np.asarray(echoing, np.float32), SPEECH_DBFS)
        events, _ = hear(recogniser, arrived + room(len(arrived), k))
        print(f"  {name}: {'heard' if any(isinstance(e, Recognised) for e in events) else 'not heard'}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--names", default="Rob,Bot")
    parser.add_argument("--gain-db", default="0")
    parser.add_argument("--minutes", type=float, default=60.0, help="most minutes of DIR for each team and gain")
    parser.add_argument("--acquainted", action="store_true", help="the robots of the team were heard before")
    o = parser.parse_args()
    sound = make_sound(None, user_cache_folder())
    heard_min, commands, garbled, spent_s = 0.0, 0, 0, 0.0
    for names in (team.split(",") for team in o.names.split(";")):
        book = make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        for gain_db in (float(g) for g in o.gain_db.split(",")):
            recogniser = make_speech_recogniser(book, names, sound)
            if o.acquainted:
                meet(recogniser, names)
            minutes = 0.0
            for path in sorted(o.data.rglob("*.wav")):
                samples = np.asarray(read_wav(path) * 10.0 ** (gain_db / 20.0), np.float32)
                began_s = time.process_time()
                for start in range(0, len(samples), BLOCK):
                    for event in recogniser.push(samples[start : start + BLOCK]):
                        if isinstance(event, Recognised):
                            commands += 1
                            print(f"  {path.name} {gain_db:+.0f} dB: {' '.join(event.words)} ({event.confidence:.2f})")
                        else:
                            garbled += 1
                spent_s += time.process_time() - began_s
                minutes += len(samples) / SAMPLE_RATE_HZ / 60.0
                if minutes > o.minutes:
                    break
            heard_min += minutes
    print(
        f"{heard_min:.0f} minutes that address nobody: {commands} commands, {garbled} stretches noticed as speech, "
        f"{spent_s / (heard_min * 60.0):.3f} of real time"
    )


if __name__ == "__main__":
    main()
