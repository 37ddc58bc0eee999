"""Endurance: two daemons talk over real sound for an hour. Memory must not grow, and every lost frame must be accounted
for.

    python -m benchmarks.daemon.hour [--minutes 60] [--ask-every 60]

Two processes with their fake motors, each on its own ALSA devices over a private sound server, with a mixer as the air
(tests/e2e); they share out five plants, and then one asks the other what it is doing, now and then. A line for each
robot every five minutes: processor time as a share of one core, RSS, file descriptors, threads, how far its sample
clock has strayed from the computer's, and what its sound lost.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.daemon.figures import cpu_s
from hvcpd.assembly.sound import user_cache_folder
from hvcpd.control.live.daemon_client import DaemonClient
from tests.e2e.parts import missing
from tests.e2e.robot import RobotProcess
from tests.e2e.stage import Stage, staged

SETTLED_ROW = 1
"""Growth counts from the second row on: by then the plants are watered."""


@dataclass(frozen=True)
class Row:
    """What one daemon needs at one moment."""

    at_s: float
    cpu_s: float
    rss_mb: float
    descriptors: int
    threads: int
    stray_ms: float
    """Of the robot's clock from the computer's, whatever that began with."""
    lost: dict[str, int]

    def told(self, name: str, before: Row | None, first: Row | None) -> str:
        """As a line of the table."""
        share = (self.cpu_s - before.cpu_s) / (self.at_s - before.at_s) if before else float("nan")
        lost = ", ".join(f"{key} {value}" for key, value in self.lost.items() if value) or "nothing"
        return (
            f"{self.at_s / 60:6.1f} min  {name}  {share:6.1%}  {self.rss_mb:6.1f} MB  {self.descriptors:3d} files  "
            f"{self.threads:2d} threads  {self.stray_ms - (first or self).stray_ms:+7.1f} ms  lost: {lost}"
        )


def look(robot: RobotProcess, client: DaemonClient, began_s: float) -> Row:
    """Ask the daemon, and the system about it."""
    assert robot.daemon is not None
    pid = robot.daemon.pid
    status: dict[str, Any] = client.ask("status")
    process = Path(f"/proc/{pid}")
    fields = dict(line.split(":", 1) for line in (process / "status").read_text(encoding="ascii").splitlines())
    return Row(
        time.monotonic() - began_s,
        cpu_s(pid),
        int(fields["VmRSS"].split()[0]) * 1024 / 1e6,
        len(list((process / "fd").iterdir())),
        int(fields["Threads"]),
        1000.0 * (status["now_s"] - time.monotonic()),
        {key: value for key, value in status["sound"]["lost"].items() if isinstance(value, int)},
    )


def watch(stage: Stage[RobotProcess], minutes: float, row_every_s: float, ask_every_s: float) -> bool:
    """Print the table; whether nothing grew."""
    clients = [DaemonClient(robot.control_socket) for robot in stage.robots]
    rows: list[list[Row]] = [[] for _ in clients]
    began_s = time.monotonic()
    next_row_s = next_question_s = 0.0
    while (now_s := time.monotonic() - began_s) <= 60.0 * minutes:
        if now_s >= next_row_s:
            next_row_s += row_every_s
            for robot, client, of_robot in zip(stage.robots, clients, rows, strict=True):
                row = look(robot, client, began_s)
                print(row.told(robot.name, *(of_robot[-1], of_robot[0]) if of_robot else (None, None)), flush=True)
                of_robot.append(row)
        if now_s >= next_question_s:
            next_question_s += ask_every_s
            asker, asked = stage.robots if round(next_question_s / ask_every_s) % 2 else stage.robots[::-1]
            clients[stage.robots.index(asker)].ask(
                "say", text=f"Hi {asked.name}, I am {asker.name}, what are you doing"
            )
        time.sleep(0.5)
    return all(_steady(of_robot[SETTLED_ROW:]) for of_robot in rows)


def _steady(rows: list[Row]) -> bool:
    """Whether the last needs no more than the first, but for 2 MB of the allocator's moods."""
    if len(rows) < 2:
        return True
    first, last = rows[0], rows[-1]
    return last.rss_mb <= first.rss_mb + 2.0 and last.descriptors <= first.descriptors and last.threads <= first.threads


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--row-every", type=float, default=300.0, metavar="S")
    parser.add_argument("--ask-every", type=float, default=60.0, metavar="S")
    options = parser.parse_args()
    if missing():
        raise SystemExit(missing())
    with tempfile.TemporaryDirectory() as folder:
        units = user_cache_folder() or Path(folder) / "units"  # a cold start takes all of the processor
        units.mkdir(parents=True, exist_ok=True)
        (Path(folder) / "stage").mkdir()
        with staged(Path(folder) / "stage", units, RobotProcess) as stage:
            stage.start()
            steady = watch(stage, options.minutes, options.row_every, options.ask_every)
            answers = [text for robot in stage.robots for text in robot.said() if ", I am " in text]
            done = [len([s for s, _ in robot.tasks().values() if s == "done"]) for robot in stage.robots]
    print(f"said to each other: {len(answers)}; tasks known as done: {done}; {'steady' if steady else 'GREW'}")
    raise SystemExit(0 if steady else 1)


if __name__ == "__main__":
    main()
