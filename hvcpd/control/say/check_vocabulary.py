"""`hvcpctl check-vocabulary`: finds words and phrases of a team that sound alike, and suggests others."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from hvcpd.assembly.vocabulary import LIMIT_NOISE, LIMIT_QUIET, Confusion, as_dict, check, describe
from hvcpd.control.output import show
from hvcpd.control.simulate.team import load_team, vocabulary_cache
from hvcpd.errors import EX_FAILURE, EX_OK
from hvcpd.reporting.text import listed

SHOWN = 10
"""Rows of the table when nothing is confusable: the nearest pairs."""


def run(options: argparse.Namespace) -> int:
    """Print the pairs, worst first; returns 1 if a team's own words would be confused."""
    team = load_team(options, options.names or (), allow_confusable=True)
    found = check(team.phrasebook, team.names, team.sound, vocabulary_cache())
    refused = [c for c in found if c.confusable and not c.fixed]
    if options.json:
        for confusion in found:
            show(True, as_dict(confusion) | {"confusable": confusion.confusable})
    else:
        sys.stdout.write(as_table(found))
    return EX_FAILURE if refused else EX_OK


HEADING = "confused pair"


def as_table(found: Sequence[Confusion]) -> str:
    """Return the confusable pairs, or else the nearest few, as a table; below it one sentence for each pair to be
    changed."""
    shown = [c for n, c in enumerate(found) if c.confusable or n < SHOWN]
    pairs = [f"{c.first} | {c.second}" for c in shown]
    width = max(map(len, (HEADING, *pairs)))
    lines = [f"{HEADING:{width}}  voice       quiet    0 dB   -5 dB"]
    for pair, c in zip(pairs, shown, strict=True):
        remark = "" if not c.confusable else "  same sound" if c.same_sound else "  confusable"
        remark += ", the phrasebook's own words" if c.confusable and c.fixed else ""
        rates = f"{c.quiet:7.2%} {c.at_0_db:7.2%} {c.at_minus_5_db:7.2%}"
        lines.append(f"{pair:{width}}  {c.voice:9} {rates}{remark}")
    wrong = [c for c in found if c.confusable and not c.fixed]
    limits = f"{LIMIT_QUIET:.1%} in quiet or {LIMIT_NOISE:.0%} in noise at 0 dB"
    lines += ["", *(describe(c) for c in wrong)]
    if not wrong:
        lines.append(f"No words of this team are predicted to be confused more often than {limits}.")
        if own := [f"{c.first} and {c.second}" for c in found if c.confusable]:
            lines.append(f"Of the phrasebook's own words, which no team can change, these are: {listed(own)}.")
    else:
        lines.append(f"The limit is {limits}.")
    return "\n".join(lines) + "\n"
