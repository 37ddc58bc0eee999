"""Whole missions by seed: every plant watered exactly once? And how many times faster than real time?

    python -m benchmarks.missions [--seeds 1-20] [--modes volunteer,coordinate] [--robots Rob,Bot]

Each mission is one `hvcpctl simulate --json` of its own; the figures are those of its last line.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from typing import Any


def fly(seed: int, mode: str, robots: str, more: list[str]) -> tuple[int, dict[str, Any]]:
    """Run one mission; its exit status and its summary."""
    command = [sys.executable, "-m", "hvcpd.control.cli", "simulate", "--json"]
    command += ["--seed", str(seed), "--mode", mode, "--robots", robots, *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if not done.stdout:
        raise SystemExit(done.stderr)
    return done.returncode, json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1-20")
    parser.add_argument("--modes", default="volunteer,coordinate")
    parser.add_argument("--robots", default="Rob,Bot")
    parser.add_argument("more", nargs="*", help="further options of simulate, after --")
    o = parser.parse_args()
    first, _, last = o.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    print("mode        seed  ok  done  twice  lost  sent  understood  collisions  virtual s  wall s  times real time")
    for mode in o.modes.split(","):
        factors, good = [], 0
        for seed in seeds:
            status, s = fly(seed, mode, o.robots, o.more)
            factors.append(s["realtime_factor"])
            good += status == 0
            print(
                f"{mode:10} {seed:5}  {'yes' if status == 0 else 'NO ':3} {len(s['done']):4} {s['duplicates']:6}"
                f" {s['lost']:5} {s['utterances_sent']:5} {s['utterances_understood']:11} {s['collisions']:11}"
                f" {s['virtual_s']:10.1f} {s['wall_s']:7.1f} {s['realtime_factor']:16.1f}",
                flush=True,
            )
        print(f"{mode}: {good} of {len(factors)} good, {min(factors):.1f} to {max(factors):.1f} times real time\n")


if __name__ == "__main__":
    main()
