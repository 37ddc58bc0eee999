"""The playground: one HTML page that says any sentence of the phrasebook in robots' voices, with nothing but a browser.

Every word of every robot is in the page as sound (FLAC), and the word network with its pauses. A script finds a
sentence's way through the network and joins the words as `hvcpd.synthesis.speaker` does, but at one pitch.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from string import Template
from typing import Any

import numpy as np
from markupsafe import Markup

from hvcpd.language.graph import WordGraph
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.audio_clip import flac
from hvcpd.reporting.markup import document, joined, tag
from hvcpd.reporting.palette import own_file, robot_slot, style_sheet
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.speaker import joined as joint

KEPT_BITS = 12
"""Of each sample: quantization noise 72 dB below full scale, and a page of a third less."""


@dataclass(frozen=True)
class Says:
    """One line of a scene: the robot by its place in the team, and its sentence."""

    robot: int
    text: str


@dataclass(frozen=True)
class Scene:
    """An idea of the conversation and a dialogue that shows it."""

    title: str
    explained: str
    lines: tuple[Says, ...]


def make_scenes(phrasebook: Phrasebook, robots: Sequence[str], tasks: Sequence[int]) -> tuple[Scene, ...]:
    """Claim, confirmation, both at once and stop, between the first two robots. Raises PhraseError.

    `tasks` are the numbers of at least one task; it takes two to show a confirmation with a claim.
    """
    a, b = robots[:2]
    task, *others = tasks

    def says(robot: int, text: str) -> Says:
        return Says(robot, phrasebook.write(phrasebook.parse_text(text)))

    claim = says(0, f"Hi all, I am {a}, I will complete task {task}")
    return (
        Scene(
            "Claim",
            f"{a} says which task it will do, before it moves. Every robot that hears it leaves that task alone. If "
            "two robots claim the same task, the one at work keeps it, or else the first name in the alphabet. A robot "
            "that has not yet said its name introduces itself by its claim.",
            (claim,),
        ),
        Scene(
            "Confirmation",
            f"{b} repeats the number. Now {a} knows that it was understood. Without a confirmation {a} says the "
            "claim again, and finally goes alone.",
            (claim, says(1, f"Hi {a}, I am {b}, confirmed {task}")),
        ),
        *(
            Scene(
                "Both at once",
                f"Often {b} has something to say too: its own next claim. It puts both into one sentence. The "
                f"confirmation is for {a}, the claim for everybody.",
                (
                    claim,
                    says(1, f"Hi {a}, I am {b}, confirmed {task}, I will complete task {other}"),
                    says(0, f"Hi {b}, I am {a}, confirmed {other}"),
                ),
            )
            for other in others[:1]
        ),
        Scene(
            "Stop",
            f"Anybody may say “stop”, at any time, without a greeting. Every robot that hears it halts at once, and "
            f"stays halted until somebody says “resume”. With a name before it, “stop” is meant for {b} alone; "
            "in doubt, all halt.",
            (says(0, f"{b} stop"), says(1, f"Hi all, I am {b}, I have stopped"), says(0, f"{b} resume")),
        ),
    )


def page(robots: Sequence[str], speakers: Sequence[Speaker], graph: WordGraph, scenes: Sequence[Scene]) -> str:
    """The page as HTML: sound, style and script are all inside. `speakers` are the robots'."""
    words = list(graph.words)
    data = {
        "rate": SAMPLE_RATE_HZ,
        "words": words,
        "graph": _network(graph, words),
        "robots": [
            {"name": name, "slot": robot_slot(k), **_voice(speaker, words)}
            for k, (name, speaker) in enumerate(zip(robots, speakers, strict=True))
        ],
        "scenes": [asdict(scene) for scene in scenes],
    }
    body = Template(own_file("playground.html")).substitute(
        data=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        robots=joined([_panel(k, name) for k, name in enumerate(robots)]),
        scenes=joined([_scene(k, scene, robots) for k, scene in enumerate(scenes)]),
    )
    style, script = style_sheet("theme.css", "playground.css"), own_file("playground.js")
    return document("Robots' sentences: a playground", style, Markup(body), script=script)


def _network(graph: WordGraph, words: Sequence[str]) -> dict[str, Any]:
    number = {word: k for k, word in enumerate(words)}
    return {
        "start": graph.start,
        "finals": sorted(graph.finals),
        "pauses": sorted(graph.pauses),
        "arcs": [(arc.source, arc.target, number[arc.word]) for arc in graph.arcs],
    }


def _voice(speaker: Speaker, words: Sequence[str]) -> dict[str, Any]:
    """A robot's words one after the other as FLAC, and for each, medial and final: begin, length, lead and advance, in
    samples."""
    units, table, at = [], [], 0
    for word in words:
        for position in UnitPosition:
            unit = speaker.unit(word, position)
            join = joint(unit, position is UnitPosition.FINAL)
            table.append((at, len(unit), join.lead, join.advance))
            units.append(unit)
            at += len(unit)
    return {"units": table, "flac": base64.b64encode(flac(np.concatenate(units), KEPT_BITS)).decode("ascii")}


def _panel(k: int, name: str) -> str:
    canvas = tag("canvas", width=960, height=160, role="img", aria_label=f"Spectrogram of {name}'s sentence")
    return tag(
        "section",
        tag("div", tag("h3", name), tag("button", "▶ Play", class_="say", type="button", data_robot=k), class_="who"),
        tag("div", canvas, tag("div", class_="words"), tag("div", class_="cursor"), class_="picture"),
        class_=f"robot r{robot_slot(k)}",
        aria_label=name,
    )


def _scene(k: int, scene: Scene, robots: Sequence[str]) -> str:
    lines = [
        tag("li", tag("b", robots[line.robot], class_=f"r{robot_slot(line.robot)}"), f": “{line.text}”")
        for line in scene.lines
    ]
    button = tag("button", f"▶ Play {scene.title.lower()}", class_="scene", type="button", data_scene=k)
    return tag("section", tag("h3", scene.title), tag("p", scene.explained), tag("ol", *lines), button, class_="idea")
