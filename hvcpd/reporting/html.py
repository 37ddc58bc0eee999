"""The mission's report: one HTML page that needs nothing but a browser."""

from __future__ import annotations

import base64
import math
from pathlib import Path
from string import Template

from markupsafe import Markup

from hvcpd.config.files import write_whole
from hvcpd.ports import Samples
from hvcpd.reporting.audio_clip import KEPT_BITS, Clip, make_clip
from hvcpd.reporting.conversation import draw_conversation, utterance_options
from hvcpd.reporting.events import MissionRecord, Trail
from hvcpd.reporting.icons import badge
from hvcpd.reporting.map_svg import draw_map
from hvcpd.reporting.markup import Child, document, escaped, figure_list, joined, row, table, tag
from hvcpd.reporting.palette import own_file, robot_slot, style_sheet
from hvcpd.reporting.simplify import length_m, simplified
from hvcpd.reporting.spectrogram import choose, figure
from hvcpd.reporting.story import Story, TaskStory, all_went_well, outcome, tell
from hvcpd.reporting.text import clock, listed, number
from hvcpd.reporting.timeline_svg import draw_timeline

SWITCHED = Markup(' <span><i class="swatch switched-key"></i> pump (or another switched device) on</span>')
"""In the timeline's legend."""
ROOM_FOR_ONE = Markup('<span><i class="swatch area-key"></i> room for one robot; others wait at the dotted line</span>')
"""In the map's legend."""
MAX_NAMED_DRIVES = 3
"""Of more robots the headline gives the sum of their ways: it has one row."""


SPEEDS = ("0.5", "1", "1.5", "2", "4")
"""Of the player: slow to listen closely, fast to get through the driving."""


def write_report(record: MissionRecord, path: Path) -> None:
    """Write the report of a mission. The same record gives the same bytes. Raises OSError."""
    write_whole(path, page(record).encode("utf-8"))


def page(record: MissionRecord) -> str:
    """The report as HTML: sound, pictures, style and script are all inside."""
    story = tell(record)
    trails = [simplified(trail) for trail in record.trails]
    clip = None
    if len(record.sound):
        clip = make_clip(record.sound, [(line.said.at_s, line.said.end_s) for line in story.lines])
    body = Template(own_file("report.html")).substitute(
        heading=escaped(record.title),
        verdict=_verdict(story),
        setting=_setting(story),
        figures=_figures(story, trails),
        map=draw_map(story, trails),
        legend=_legend(story),
        conversation=draw_conversation(story, playable=clip is not None),
        timeline=draw_timeline(story, trails),
        switched=SWITCHED if story.switched else "",
        spectrograms=_spectrograms(story, record.sound),
        tasks=_task_table(story),
        skip=tag("a", "To the player", href="#whole", class_="skip") if clip is not None else "",
        player=_player(clip),
        notes=_notes(clip),
    )
    style, script = style_sheet("theme.css", "report.css"), own_file("report.js")
    loads = "img-src data:; media-src data: blob:; "
    return document(record.title, style, Markup(body), script=script, loads=loads)


def _verdict(story: Story) -> Markup:
    summary = story.summary
    if summary is None:
        return tag("p", "The mission did not end", class_="verdict bad")
    return tag("p", outcome(summary), class_="verdict good" if all_went_well(summary) else "verdict bad")


def _setting(story: Story) -> Markup:
    started = story.started
    mode = {"volunteer": "every robot picks its own tasks", "coordinate": "one robot gives the orders"}
    parts = [listed(story.robots), mode.get(started.mode, started.mode)]
    if math.isfinite(started.noise_db_spl):
        parts.append(f"ambient noise {number(started.noise_db_spl, 0)} dB SPL")
    parts.append(f"seed {started.seed}")
    return tag("p", " · ".join(parts), class_="setting")


def _figures(story: Story, trails: list[Trail]) -> Markup:
    figures: list[tuple[str, str]] = []
    summary = story.summary
    if summary is not None:
        figures.append((f"{summary.tasks - summary.lost} of {summary.tasks}", "tasks done"))
    figures.append((clock(story.end_s), "minutes of mission"))
    if summary is not None:
        if len(story.robots) > 1:
            understood = f"{summary.utterances_understood} of {summary.utterances_sent}"
            figures.append((understood, "utterances understood"))
        else:
            figures.append((str(summary.utterances_sent), "utterances, with no other robot to hear them"))
        figures.append((str(summary.collisions), "collision" if summary.collisions == 1 else "collisions"))
    if len(trails) <= MAX_NAMED_DRIVES:
        figures += [(f"{length_m(trail):.1f} m", f"driven by {trail.robot}") for trail in trails]
    else:
        figures.append((f"{sum(map(length_m, trails)):.1f} m", f"driven by {len(trails)} robots"))
    if summary is not None:
        figures.append((f"{summary.realtime_factor:.1f} ×", "as fast as real time"))
    return figure_list(figures)


def _legend(story: Story) -> Markup:
    robots = [tag("span", name, class_=f"key r{robot_slot(k)}") for k, name in enumerate(story.robots)]
    pale = [tag("span", "pale: not done")] if story.started.plants else []
    places = [ROOM_FOR_ONE] if story.started.places else []
    return joined([*robots, tag("span", "○ start  □ end  ➤ way"), *pale, *places], " ")


def _spectrograms(story: Story, sound: Samples) -> Markup:
    lines = choose(story, sound)
    if not lines:
        return tag("p", "No utterance was recorded.")
    pictures = []
    for k, line in enumerate(lines):
        caption = tag("figcaption", f"{line.said.speaker}: {line.said.text}")
        drawn = tag("div", figure(line, sound), class_="scroll", tabindex="0", role="group", aria_label="Spectrogram")
        pictures.append(tag("figure", drawn, caption, hidden=k > 0, data_spectrogram=str(k)))
    if len(lines) > 1:
        select = tag("select", *utterance_options(lines), id="which")
        pictures.insert(0, tag("label", "Utterance ", select, class_="chooser"))
    return joined(pictures)


def _task_table(story: Story) -> Markup:
    undone, repeated = story.wrong
    heads = ["No.", "Task", "Place (m)", "Done by", "Claimed", "Done", "Distance from its place (m)"]
    pours = any(span.litres is not None for span in story.skills)
    heads += ["Poured (l)"] * pours + ["Skills"] * bool(story.skills)
    rows = (
        row(heads, _task_cells(task, story, pours), 1, "bad" if task.number in (*undone, *repeated) else None)
        for task in story.tasks
    )
    return table(heads, rows)


def _task_cells(task: TaskStory, story: Story, pours: bool) -> list[Child]:
    _, repeated = story.wrong
    place = f"({task.plant.x_m:.2f}, {task.plant.y_m:.2f})".replace("-", "−") if task.plant else "–"
    doers = listed(dict.fromkeys(act.robot for act in task.performed)) or "nobody"
    if task.number in repeated:
        doers += f", {len(task.performed)} times"
    claimed, done = (clock(at) if at is not None else "–" for at in (task.claimed_s, task.done_s))
    off = f"{task.distance_m:.3f}" if task.distance_m is not None else "–"
    cells: list[Child] = [task.number, joined([badge(task.icon, task.name), task.name]), place, doers]
    cells += [claimed, done, off]
    mine = [span for span in story.skills if span.last.task == task.number]
    if pours:
        cells.append(number(sum(span.litres or 0.0 for span in mine), 3))
    if story.skills:
        cells.append("; ".join(f"{span.last.robot}: {span.words}" for span in mine) or "–")
    return cells


def _player(clip: Clip | None) -> Markup:
    if clip is None:
        return Markup()
    source = "data:audio/flac;base64," + base64.b64encode(clip.flac).decode("ascii")
    sound = tag("audio", id="sound", src=source, controls=True, preload="auto", aria_label="The whole mission")
    whole = tag("button", "▶ Play", type="button", id="whole", aria_pressed="false")
    caption = tag("p", id="caption", aria_live="off")
    return tag("section", whole, sound, _speeds(), caption, class_="player", aria_label="Player")


def _speeds() -> Markup:
    """A choice of how fast the sound is played; pitch stays, as browsers do."""
    options = [tag("option", f"{speed} ×", value=speed, selected=speed == "1") for speed in SPEEDS]
    return tag("label", "Speed ", tag("select", *options, id="speed"), class_="speed")


def _notes(clip: Clip | None) -> Markup:
    notes = []
    if clip is None:
        notes.append("No sound was recorded.")
    else:
        notes.append(
            "The sound is what a microphone in the room recorded, "
            f"raised by {clip.gain_db:.0f} dB for listening, with loud parts limited."
        )
        notes.append(f"It has {KEPT_BITS} bits here, to keep this page small; mission.wav beside it has full quality.")
    notes.append("Trails are simplified, within 2 cm of the true path.")
    notes.append("Spectrograms: 25 ms Hann window, 6 dB/octave pre-emphasis, colours relative to the loudest point.")
    notes.append("The words above a spectrogram are in the places where the most confident listener recognised them.")
    return tag("ul", *(tag("li", note) for note in notes))
