"""`hvcpctl hear --said TEXT`: how near the sentence that was said came to being understood.

Each stretch that was not understood, or as something else, is heard once more by robots' templates and by the nets for
people, with the confidence asked of a sentence lowered to nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hvcpd.control.hear.heard_sentences import line_at
from hvcpd.control.hear.learn_alternatives import around, bank_of, closest
from hvcpd.control.simulate.team import Team
from hvcpd.language.pattern import Words
from hvcpd.language.wordings import same_meaning
from hvcpd.people.second_pass import MIN_STRANGERS_PROBABILITY, SecondPassRecogniser
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Event, Garbled, Recognised, Urgent
from hvcpd.recognition.stages import Segment
from hvcpd.recognition.template_recogniser import RecogniserSettings


@dataclass(frozen=True)
class Nearness:
    """By one kind of voice in one stretch: the likeliest sentence, and the one that was said."""

    start_s: float
    end_s: float
    voice: str
    """"robot" or "person"."""
    needed: float
    """Confidence from which a sentence counts."""
    confidence: float | None
    """Of what was said; None: less than that of the likeliest."""
    likeliest: str | None
    """None: no sentence at all. What was said itself if that was likeliest."""
    likeliest_confidence: float | None


def understood(events: Sequence[Event], said: Words, team: Team) -> bool:
    """Whether the sentence that was said is among what was heard."""
    stopped = said == ("stop",) and any(isinstance(event, Urgent) for event in events)
    return stopped or any(isinstance(event, Recognised) and _is(event.words, said, team) for event in events)


def nearness(samples: Samples, events: Sequence[Event], said: Words, team: Team) -> Iterator[Nearness]:
    """Yield how near a recording, shape (n,), 16 kHz, in which these events were heard, is to what was said."""
    people = None
    if team.settings.voices == "any":
        people = SecondPassRecogniser(team.phrasebook.people_graph, team.sound.lexicon, team.people, strangers=True)
    stretches = [event for event in events if isinstance(event, Garbled | Recognised)]
    bank = bank_of(team) if stretches else {}
    for stretch in stretches:
        begin, sound = around(samples, stretch)
        near = closest(sound, team.phrasebook.graph, bank)
        yield _told(stretch, "robot", RecogniserSettings().min_confidence, near, None, said, team)
        if people is not None:
            segment = Segment(sound, stretch.start_sample - begin, stretch.start_sample, stretch.end_sample)
            likeliest, own = people.compared(segment, said)
            yield _told(stretch, "person", MIN_STRANGERS_PROBABILITY, likeliest, own, said, team)


def _told(
    stretch: Garbled | Recognised,
    voice: str,
    needed: float,
    near: Recognised | None,
    own: float | None,
    said: Words,
    team: Team,
) -> Nearness:
    text = team.phrasebook.write(team.phrasebook.parse(near.words)) if near is not None else None
    if near is not None and _is(near.words, said, team):
        own = near.confidence
    return Nearness(
        stretch.start_sample / SAMPLE_RATE_HZ,
        stretch.end_sample / SAMPLE_RATE_HZ,
        voice,
        needed,
        own,
        text,
        near.confidence if near is not None else None,
    )


def _is(words: Words, said: Words, team: Team) -> bool:
    return same_meaning(words, said) or team.phrasebook.parse(words) == team.phrasebook.parse(said)


def as_line(near: Nearness, said: str, json_wanted: bool) -> str:
    """It as a JSON object, or as a line beside those of sentences."""
    if json_wanted:
        rounded = {key: round(value, 4) if isinstance(value, float) else value for key, value in vars(near).items()}
        return json.dumps({"said": said} | rounded)
    return line_at(near.start_s, near.end_s, f"as a {near.voice}'s: {_verdict(near, said)}")


def _verdict(near: Nearness, said: str) -> str:
    counts = f"it counts from {near.needed:.0%}"
    sure = near.likeliest_confidence
    if near.likeliest is None or sure is None:
        return "like no sentence"
    if near.likeliest != said:
        own = f"{near.confidence:.0%} sure; " if near.confidence is not None else ""
        return f"{own}likelier, {sure:.0%}, is “{near.likeliest}”; {counts}"
    if sure < near.needed:
        return f"likeliest, but only {sure:.0%} sure; {counts}"
    return f"likeliest, {sure:.0%} sure, but not confirmed (by quiet before it, short pauses, or the speaker's voice)"
