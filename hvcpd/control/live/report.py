"""`hvcpctl report`: a shift, printed and drawn, from a robot's transcript."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from contextlib import closing

from hvcpd.control.live.transcript import AskedRows, open_transcript, since_wall_s
from hvcpd.control.simulate.team import load_team
from hvcpd.errors import EX_OK, ConfigError, writing
from hvcpd.reporting.shift import read_shift
from hvcpd.reporting.shift_page import as_json, as_text, write_shift


def run(options: argparse.Namespace, now_s: Callable[[], float] = time.time) -> int:
    """Print the shift, and with --html draw it."""
    end_s = now_s()
    since_s = since_wall_s(options.since, end_s)
    with closing(open_transcript(options)) as reader:
        rows = reader.rows(since_wall_s=since_s)
        own_tasks = reader.tasks() if isinstance(reader, AskedRows) else None
    speakers = {row.record.speaker for row in rows if row.record.speaker}
    team = load_team(options, more=tuple(sorted(speakers)), sealed=True)
    shift = read_shift(rows, team.phrasebook, own_tasks or team.tasks.tasks, (since_s, end_s))
    if options.html is not None:
        with writing(options.html, ConfigError, "--html: "):
            write_shift(shift, options.html)
    sys.stdout.write(json.dumps(as_json(shift)) + "\n" if options.json else as_text(shift))
    return EX_OK
