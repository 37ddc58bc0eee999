"""`hvcpctl phrases`: the card of all sentences that can be said."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from operator import attrgetter

from hvcpd.control.simulate.team import load_team
from hvcpd.language.card import as_markdown, as_text, make_card


def run(options: argparse.Namespace) -> None:
    """Print the card in the wanted format."""
    team = load_team(options, options.names or (), sealed=options.key)
    card = make_card(team.phrasebook)
    if options.json:
        text = json.dumps(asdict(card), default=attrgetter("value")) + "\n"
    elif options.format == "html":
        from hvcpd.reporting.card_page import card_page

        text = card_page(card, team.tasks.tasks)
    else:
        text = {"text": as_text, "markdown": as_markdown}[options.format](card)
    sys.stdout.write(text)
