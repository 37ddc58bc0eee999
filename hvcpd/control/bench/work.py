"""Work that `hvcpctl bench` times and `benchmarks/pi.py` counts: one piece of a robot's work in a process of its own.

python -m hvcpd.control.bench.work NAME FOLDER AMOUNT

FOLDER keeps what the robot keeps between starts. With AMOUNT 0 only what precedes the work is done, so that the
difference is the work's own. The last line of the output is a JSON object: the processor time of the whole process, and
the share of one core that the blocks of the busiest second took, where the work listens.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.stages import SynchronousWorker

if TYPE_CHECKING:
    from hvcpd.daemon.wiring import Wiring
    from hvcpd.robot.robot import Robot

NAME, PEER = "Rob", "Bot"
"""The listener and the speaker: the paper's two robots."""
BLOCK = SAMPLE_RATE_HZ // 40
"""25 ms, as the daemon has them of a sound card."""
NOISE_RMS, SPEECH_RMS = 1e-3, 0.05
"""-60 dBFS, a quiet room; and a peer at one metre (benchmarks/daemon/figures.py)."""
GAP_S = 1.0
"""Between two sentences of the peer."""


def main(arguments: Sequence[str]) -> int:
    """Do one piece of work; returns the exit status. Raises KeyError for an unknown one."""
    name, folder, amount = arguments
    busiest = WORKS[name](Path(folder), int(amount))
    used = resource.getrusage(resource.RUSAGE_SELF)
    sys.stdout.write(json.dumps({"cpu_s": used.ru_utime + used.ru_stime, "busiest": busiest}) + "\n")
    return 0


def _wiring(folder: Path) -> Wiring:
    """Read everything that `hvcpd` reads before it looks for its devices."""
    from hvcpd.config.settings import Settings
    from hvcpd.daemon.wiring import wire_up

    (folder / "state").mkdir(parents=True, exist_ok=True)
    settings = Settings(name=NAME, state_dir=folder / "state", names=(NAME, PEER))
    return wire_up(replace(settings, wheels=replace(settings.wheels, driver="none")))


class Apart(SynchronousWorker[Any, Any]):
    """Runs the second pass, for which the daemon has threads, in this thread and counts its time."""

    def __init__(self) -> None:
        super().__init__()
        self.spent_s = 0.0

    def submit(self, job: Any, search: Callable[[Any], Any]) -> bool:
        """As `Worker.submit`."""
        began_s = time.process_time()
        taken = super().submit(job, search)
        self.spent_s += time.process_time() - began_s
        return taken


def _robot(wiring: Wiring, channel: Apart | None = None, second: Apart | None = None) -> Robot:
    """A robot as it stands at READY, and what looks again for it."""
    from hvcpd.assembly.make import make_robot
    from hvcpd.daemon.cache_warm_up import CacheWarmUp
    from hvcpd.daemon.preflight import find_confusable

    find_confusable(wiring)
    plan = wiring.plan(channel=channel, second=second)
    CacheWarmUp(plan, wiring.sound).before_listening()
    return make_robot(plan, wiring.sound)


def _start(folder: Path, _: int) -> None:
    """Start as far as READY, without devices but with all modules of the daemon."""
    from hvcpd.daemon import main_loop  # noqa: F401  # for its own imports

    _robot(_wiring(folder))


def _say(folder: Path, sentences: int) -> None:
    """Render a number of sentences, none of whose words is in the cache."""
    wiring = _wiring(folder)
    for _ in range(sentences):
        _sentence(replace(wiring, sound=replace(wiring.sound, cache=None)), 4)


def _waveforms(folder: Path, words: int) -> None:
    """Render a number of words of one peer, as its waveforms need them: at every pitch, usual and slow."""
    from hvcpd.assembly.make import SLOW
    from hvcpd.synthesis.speaker import PITCH_STEPS

    wiring = _wiring(folder)
    sound = replace(wiring.sound, cache=None)
    spoken = wiring.phrasebook().marked_graph.words[:words]
    for speaker in (sound.speaker_of(PEER), sound.speaker_of(PEER, SLOW)):
        for word in spoken:
            for pitch in PITCH_STEPS:
                speaker.joined(word, pitch)


def _quiet(folder: Path, seconds: int) -> float:
    """Listen to a quiet room for this time."""
    return _listen(folder, seconds, lambda _: iter(()))


def _speech(folder: Path, seconds: int) -> float:
    """Listen for this time to a peer who speaks with pauses of a second."""

    def sentences(wiring: Wiring) -> Iterator[Samples]:
        for number in range(1, sys.maxsize):
            yield _sentence(wiring, 1 + number % 5)

    return _listen(folder, seconds, sentences)


def _sentence(wiring: Wiring, number: int) -> Samples:
    """The peer's claim of a task, shape (n,), float32, `SPEECH_RMS`."""
    import numpy as np

    from hvcpd.language.messages import Claim, TaskByNumber, ToAll, Utterance

    said = Utterance(PEER, ToAll(), statement=Claim(TaskByNumber(number)))
    speech = wiring.sound.speaker_of(PEER).render(wiring.phrasebook().phrases(said))
    return np.asarray(speech * (SPEECH_RMS / np.sqrt(np.mean(speech**2))), np.float32)


def _listen(folder: Path, seconds: int, sentences: Callable[[Wiring], Iterator[Samples]]) -> float:
    """Feed the robot with blocks; returns the share of one core that the blocks of the busiest second took."""
    import numpy as np

    wiring = _wiring(folder)
    workers = Apart(), Apart()
    robot = _robot(wiring, *workers)
    robot.prepare(lambda: True)
    noise = np.random.default_rng(1).standard_normal(seconds * SAMPLE_RATE_HZ)
    heard, at = (NOISE_RMS * noise).astype(np.float32), SAMPLE_RATE_HZ
    for speech in sentences(wiring):
        if at + len(speech) > len(heard):
            break
        heard[at : at + len(speech)] += speech
        at += len(speech) + samples_in(GAP_S)
    busiest = 0.0
    for second in heard.reshape(-1, SAMPLE_RATE_HZ):
        began_s = time.process_time() - sum(worker.spent_s for worker in workers)
        for block in second.reshape(-1, BLOCK):
            robot.step(block, None)
        busiest = max(busiest, time.process_time() - sum(worker.spent_s for worker in workers) - began_s)
    return busiest


WORKS: dict[str, Callable[[Path, int], float | None]] = {
    "start": _start,
    "say": _say,
    "waveforms": _waveforms,
    "quiet": _quiet,
    "speech": _speech,
}

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
