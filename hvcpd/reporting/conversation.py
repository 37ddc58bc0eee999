"""The conversation as a chat, every utterance with a button that plays it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from markupsafe import Markup

from hvcpd.reporting.events import Garbled, Heard, Performed
from hvcpd.reporting.icons import badge
from hvcpd.reporting.markup import joined, tag
from hvcpd.reporting.story import Line, Story
from hvcpd.reporting.text import at_least, clock, if_known, listed, plural, seal_words

MAX_NAMED = 3
"""Listeners named in a line; of more the page tells the number, and the names on demand."""


def draw_conversation(story: Story, playable: bool) -> Markup:
    """All utterances, deeds and stray speech in the order of time; with buttons if there is sound to play."""
    entries: list[tuple[float, Markup]] = []
    slots = story.slots
    sides = {name: k % 2 for k, name in enumerate(story.robots)}
    for line in story.lines:
        slot, side = slots[line.said.speaker], sides[line.said.speaker]
        entries.append((line.said.at_s, _utterance(line, slot, side, playable, len(story.robots) - 1)))
    entries += [(act.at_s, _carried_out(act, story)) for act in story.performed]
    entries += [(stray.at_s, _stray(stray)) for stray in story.unplaced]
    entries.sort(key=lambda entry: entry[0])
    return tag("ol", *(item for _, item in entries), class_="chat", id="chat", tabindex="0", aria_label="Conversation")


def _utterance(line: Line, slot: int, side: int, playable: bool, others: int) -> Markup:
    said = line.said
    label = f"Play {said.speaker} at {clock(said.at_s)}: {said.text}"
    button = tag("button", type="button", class_="play", aria_label=label, aria_pressed="false") if playable else None
    seal = tag("span", seal_words(said.seal), class_="seal") if said.seal else None
    head = tag("div", tag("b", said.speaker), tag("time", clock(said.at_s)), seal, class_="who")
    return tag(
        "li",
        button,
        tag("div", head, tag("p", said.text), tag("ul", *_marks(line, others), class_="marks"), class_="bubble"),
        class_=f"said r{slot}{' right' if side else ''}",
        data_utterance=said.utterance,
        data_from=f"{said.at_s:.3f}",
        data_to=f"{said.end_s:.3f}",
    )


def _marks(line: Line, others: int) -> list[Markup]:
    """The robots that heard it, with their confidence, and those that did not."""
    marks = []
    if line.said.collided:
        marks.append(tag("li", "collided with another voice", class_="bad"))
    right = sorted((h for h in line.heard if h.text == line.said.text), key=lambda h: h.listener)
    doubting = [h.listener for h in line.heard if h.seal == "not trusted"]
    if doubting:
        marks.append(tag("li", f"not trusted by {listed(doubting)}", class_="odd"))
    if len(right) > MAX_NAMED:
        named = listed(h.listener + if_known(h.confidence, " {}") for h in right)
        count = f"heard by {len(right)} of {others}" + at_least((h.confidence for h in right), ", confidence {}")
        marks.append(tag("li", tag("details", tag("summary", count), named), class_="good"))
    else:
        marks += [_heard(h) for h in right]
    for heard in line.heard:
        if heard.text != line.said.text:
            marks.append(tag("li", f"{heard.listener} understood: “{heard.text}”", class_="odd"))
    for kind, names in (("garbled at", line.garbled), ("not heard by", line.missed)):
        if names:
            who = listed(names) if len(names) <= MAX_NAMED else plural(len(names), "robot")
            marks.append(tag("li", f"{kind} {who}", class_="bad", title=listed(names)))
    return marks


def _heard(heard: Heard) -> Markup:
    title = f"signal-to-noise ratio {heard.snr_db:.0f} dB" if math.isfinite(heard.snr_db) else None
    text = f"heard by {heard.listener}" + if_known(heard.confidence, ", confidence {}")
    seal = f", {seal_words(heard.seal)}" if heard.seal and heard.seal != "not trusted" else ""
    return tag("li", text + seal, class_="good", title=title)


def _carried_out(act: Performed, story: Story) -> Markup:
    task = next(task for task in story.tasks if task.number == act.task)
    mark = badge(task.icon, task.name)
    text = joined([tag("time", clock(act.at_s)), mark, tag("b", act.robot), f" has done task {act.task}: {task.name}"])
    return tag("li", text, class_="act", data_at=f"{act.at_s:.3f}")


def _stray(event: Garbled | Heard) -> Markup:
    if isinstance(event, Heard):
        sure = if_known(event.confidence, " (confidence {})")
        words = f"{event.listener} heard, from no robot: “{event.text}”{sure}"
    else:
        words = f"{event.listener} heard speech, from no robot, that it could not understand"
    return tag("li", tag("time", clock(event.at_s)), words, class_="act")


def utterance_options(lines: Sequence[Line]) -> list[Markup]:
    """A choice among utterances, for the spectrograms."""
    return [
        tag("option", f"{clock(line.said.at_s)} {line.said.speaker}: {line.said.text}", value=str(k))
        for k, line in enumerate(lines)
    ]
