"""The simulated room between real sound devices: a process that carries sound from the robots' outputs to their inputs.

python -m hil_fakes.real_air --server SOCKET --robots rob,bot --record FOLDER

For robots that are processes on a `sound_server`: 10 ms at a time it takes what each loudspeaker plays, lets it pass
through `room` (gain, flight time, noise, the own voice) and gives each microphone its mixture. It ends with its
standard input or a SIGTERM, and outlives the sound server.
"""

from __future__ import annotations

import argparse
import signal
import sys
import threading
import time
import wave
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import FrameType

from hil_fakes.pulse_pipe import Direction, PipeError, PulsePipe
from hil_fakes.room import Air, Point, Room
from hil_fakes.sound_server import LOUDSPEAKER, MICROPHONE
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.pcm import pcm_16

BLOCK = 160
"""Samples carried at once, 10 ms: the least delay that each way through a null sink adds."""
LATENCY_S = 0.03
"""Sound that waits in the server at each end: as much as the mixer may be late without a gap."""
MAX_LAG_S = 0.05
"""Lag of a mixer that was held up beyond which its sound is left out as soon as nobody speaks: air has no memory."""
LIMIT_LAG_S = 0.4
"""Lag of a mixer beyond which its sound is left out in the middle of a word, too."""
RETRY_S = 0.1
"""Interval at which a sound server that is gone is looked for."""
SPACING_M = 1.0
"""Distance between neighbours in the row of robots."""


class RealAir:
    """Carries sound between the robots `names` on the server at `socket` until `stop` is called."""

    def __init__(self, socket: str, names: Sequence[str], room: Room, recordings: Sequence[wave.Wave_write]) -> None:
        self._socket = socket
        self._names = names
        self._room = room
        self._recordings = recordings
        self._places: list[Point] = [(SPACING_M * k, 0.0) for k in range(len(names))]
        self._stop = threading.Event()
        self.left_out = 0
        """Samples that were late."""
        self.connections = 0
        """The number of times that the server was found."""

    def stop(self) -> None:
        """Have `run` return."""
        self._stop.set()

    def run(self) -> None:
        """Find the server, carry sound while it lives, find it again."""
        while not self._stop.is_set():
            try:
                with ExitStack() as stack:
                    loudspeakers = [self._open(stack, "record", f"{n}_{LOUDSPEAKER}.monitor") for n in self._names]
                    microphones = [self._open(stack, "play", f"{n}_{MICROPHONE}") for n in self._names]
                    self.connections += 1
                    self._carry(loudspeakers, microphones)
            except PipeError:
                self._stop.wait(RETRY_S)

    def _open(self, stack: ExitStack, direction: Direction, device: str) -> PulsePipe:
        return stack.enter_context(PulsePipe(self._socket, direction, device, LATENCY_S))

    def _carry(self, loudspeakers: Sequence[PulsePipe], microphones: Sequence[PulsePipe]) -> None:
        began_s = time.monotonic()
        taken, least_s = 0, float("inf")
        while not self._stop.is_set():
            played = [loudspeaker.read(BLOCK) for loudspeaker in loudspeakers]
            taken += BLOCK
            behind_s = time.monotonic() - began_s - taken / SAMPLE_RATE_HZ
            least_s = min(least_s, behind_s)
            lag_s = behind_s - least_s
            if lag_s > LIMIT_LAG_S or (lag_s > MAX_LAG_S and not any(block.any() for block in played)):
                self.left_out += BLOCK
                continue
            heard = self._room.advance(played, self._places)
            for microphone, recording, block in zip(microphones, self._recordings, heard, strict=False):
                microphone.write(block)
                recording.writeframes(pcm_16(block))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process."""
    parser = argparse.ArgumentParser(prog="hil_fakes.real_air", description="Air between robots on a sound server.")
    parser.add_argument("--server", required=True, help="the sound server's socket")
    parser.add_argument("--robots", required=True, help="their names, with commas")
    parser.add_argument("--record", type=Path, required=True, help="folder for heard-by-NAME.wav")
    parser.add_argument("--noise-db", type=float, default=Air.noise_db_spl, help="dB SPL (default: %(default)g)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    names = options.robots.split(",")
    room = Room(len(names), Air(noise_db_spl=options.noise_db), options.seed)
    with ExitStack() as stack:
        recordings = [
            stack.enter_context(wave.open(str(options.record / f"heard-by-{name}.wav"), "wb")) for name in names
        ]
        for recording in recordings:
            recording.setparams((1, 2, SAMPLE_RATE_HZ, 0, "NONE", ""))
        air = RealAir(options.server, names, room, recordings)

        def end(_number: int, _frame: FrameType | None) -> None:
            air.stop()

        def end_with_input() -> None:
            sys.stdin.read()
            air.stop()

        signal.signal(signal.SIGTERM, end)
        threading.Thread(target=end_with_input, name="end", daemon=True).start()
        air.run()
    left_out_s = air.left_out / SAMPLE_RATE_HZ
    sys.stderr.write(f"the server was found {air.connections} times; {left_out_s:.2f} s were late and left out\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
