"""`hvcpctl playground`: a page in which robots say what is typed; it needs no server and no network."""

from __future__ import annotations

import argparse
import sys

from hvcpd.config.files import require_place, write_whole
from hvcpd.control.simulate.team import load_team, robots_of
from hvcpd.errors import AudioFileError, ConfigError, writing
from hvcpd.reporting.playground import make_scenes, page

MOST_ROBOTS = 4
"""Most robots; each adds 1.3 MB to the page."""


def run(options: argparse.Namespace) -> None:
    """Write the page."""
    robots: tuple[str, ...] = options.robots or robots_of(options)[:MOST_ROBOTS]
    if not 2 <= len(robots) <= MOST_ROBOTS:
        raise ConfigError(f"--robots: name 2 to {MOST_ROBOTS}; each adds 1.3 MB to the page")
    with writing(options.output, AudioFileError):
        require_place(options.output)  # before words are rendered, perhaps for minutes
    team = load_team(options, robots)
    scenes = make_scenes(team.phrasebook, robots, [task.number for task in team.tasks.tasks])
    text = page(robots, [team.sound.speaker_of(name) for name in robots], team.phrasebook.graph, scenes)
    with writing(options.output, AudioFileError):
        write_whole(options.output, text.encode("utf-8"))
    sys.stdout.write(f"Open {options.output} in a browser.\n")
