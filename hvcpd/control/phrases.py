"""`hvcpctl phrases`: the card of all that can be said."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict

from hvcpd.control.team import load_team
from hvcpd.language.card import as_html, as_markdown, as_text, make_card


def run(options: argparse.Namespace) -> int:
    """Print the card in the wanted format."""
    card = make_card(load_team(options, options.names or ()).phrasebook)
    write = {"text": as_text, "markdown": as_markdown, "html": as_html}[options.format]
    sys.stdout.write(json.dumps(asdict(card)) + "\n" if options.json else write(card))
    return 0
