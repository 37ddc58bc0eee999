"""A process that only listens, so that its cost can be measured: `python -m benchmarks.hearing.listener WHO NAMES WORDS
SPEECH NOISE`.

Prints a `cost.Cost` as JSON. Its `start_s` has the rendering of those words that the cache of units lacked.
"""

from __future__ import annotations

import json
import sys
import time
import wave
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hvcpd.ports import SAMPLE_RATE_HZ, Samples


def blocks(path: Path, n: int) -> Iterator[Samples]:
    """The file in blocks of `n` samples, as 16 bits become floats."""
    with wave.open(str(path)) as file:
        while data := file.readframes(n):
            yield np.asarray(np.frombuffer(data, "<i2") / 32768.0, np.float32)


def peak_mb() -> float:
    """The most memory that this process has had resident since it was started (getrusage tells of its parent's too)."""
    status = Path("/proc/self/status").read_text()
    return float(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024.0


def main() -> None:
    who, names, n_words, speech, noise = sys.argv[1:]
    truth = json.loads(Path(speech).with_suffix(".json").read_text())
    hear = _ours if who == "hvcpd" else _peer
    answer = hear(who, names.split(","), int(n_words), Path(speech), Path(noise), truth)
    sys.stdout.write(json.dumps(answer) + "\n")


def _ours(
    who: str, names: list[str], n_words: int, speech: Path, noise: Path, truth: list[tuple[list[str], int, int]]
) -> dict[str, object]:
    from benchmarks.hearing.material import BLOCK, more_tasks
    from hvcpd.assembly.make import make_speech_recogniser
    from hvcpd.assembly.sound import make_phrasebook, make_sound, user_cache_folder
    from hvcpd.config.settings import DEFAULT_TEAMS
    from hvcpd.config.task_file import load_tasks
    from hvcpd.config.tasks import default_tasks_path
    from hvcpd.recognition.events import Recognised
    from hvcpd.synthesis.voices import voice_for

    began = time.process_time()
    book = make_phrasebook(names, DEFAULT_TEAMS, more_tasks(n_words) or load_tasks(default_tasks_path()))
    recogniser = make_speech_recogniser(book, names, make_sound(None, user_cache_folder()))
    start_s = time.process_time() - began
    heard: list[Recognised] = []
    spent = []
    for path in (speech, noise):
        n, began = 0, time.process_time()
        for block in blocks(path, BLOCK):
            heard += [e for e in recogniser.push(block) if isinstance(e, Recognised)]
            n += len(block)
        spent.append((time.process_time() - began) * SAMPLE_RATE_HZ / n)
    right = sum(
        any(list(e.words) == words and e.start_sample < end and e.end_sample > start for e in heard)
        for words, start, end in truth
    )
    voices = len({voice_for(name).name for name in names})
    n = len(book.graph.words)
    return _answer(who, n, len(names), voices, spent, right, len(truth), start_s)


def _peer(
    who: str, names: list[str], n_words: int, speech: Path, noise: Path, truth: list[tuple[list[str], int, int]]
) -> dict[str, object]:
    from benchmarks.hearing.listeners import PAD_S, Peer
    from benchmarks.hearing.material import make_team, more_tasks
    from hvcpd.evaluation.sphinx import WIDE_BEAMS

    began = time.process_time()
    team = make_team(names, more_tasks(n_words))
    peer = Peer(team, **(WIDE_BEAMS if who.endswith("wide") else {"beam": 1e-48}))
    start_s = time.process_time() - began
    pad = round(PAD_S * SAMPLE_RATE_HZ)
    [sound] = blocks(speech, 1 << 30)
    began, right, heard_s = time.process_time(), 0, 0.0
    for words, start, end in truth:
        piece = sound[start - pad : end + pad]
        heard_s += len(piece) / SAMPLE_RATE_HZ
        right += peer.hear(piece) == " ".join(words)
    spent = [(time.process_time() - began) / heard_s]
    [sound] = blocks(noise, 1 << 30)
    began = time.process_time()
    peer.hear(sound)
    spent.append((time.process_time() - began) / (len(sound) / SAMPLE_RATE_HZ))
    return _answer(who, len(team.book.graph.words), len(names), 0, spent, right, len(truth), start_s)


def _answer(
    who: str, words: int, names: int, voices: int, spent: list[float], right: int, sentences: int, start_s: float
) -> dict[str, object]:
    return {
        "listener": who,
        "words": words,
        "names": names,
        "voices": voices,
        "speech": spent[0],
        "noise": spent[1],
        "peak_mb": peak_mb(),
        "right": right,
        "sentences": sentences,
        "start_s": start_s,
    }


if __name__ == "__main__":
    main()
