"""The report page: whole, offline, harmless whatever the names are, and true to the record."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile

from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.reporting.events import Heard, MissionRecord, Performed, Said, Started, Summary
from hvcpd.reporting.html import SPEEDS, page, write_report
from tests.reporting.example import example, pitch_of
from tests.reporting.shown import Page

pytestmark = pytest.mark.slow

HOSTILE = '</script><img src=x onerror=alert(1)>" onload="x" \' & \x1b[31m \u202e \ud800'


@pytest.fixture(scope="module")
def record() -> MissionRecord:
    return example()


@pytest.fixture(scope="module")
def text(record: MissionRecord) -> str:
    return page(record)


@pytest.fixture(scope="module")
def parsed(text: str) -> Page:
    return Page(text)


def sound_of(parsed: Page) -> np.ndarray:
    (audio,) = parsed.all("audio")
    flac = base64.b64decode((audio["src"] or "").removeprefix("data:audio/flac;base64,"))
    samples, rate_hz = soundfile.read(io.BytesIO(flac))
    assert (rate_hz, samples.ndim) == (SAMPLE_RATE_HZ, 1)
    return samples


def test_needs_nothing_from_outside(parsed: Page, text: str) -> None:
    for element in parsed.elements:
        attributes = element.attributes
        for name in ("src", "href", "srcset", "action", "data", "poster", "xlink:href", "background"):
            if attributes.get(name) is not None:
                assert (attributes[name] or "").startswith(("data:", "#")), (element.tag, name)
    without_sound = re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    assert not re.search(r"[\w:'\"(=]//\w|//\w+\.", without_sound)
    assert "@import" not in without_sound
    assert "url(" not in without_sound
    assert [a for a in parsed.all("meta") if "default-src 'none'" in (a.get("content") or "")]
    assert parsed.all("link") == []


def test_says_what_happened(parsed: Page, record: MissionRecord) -> None:
    said = "".join(parsed.text)
    assert "All 5 tasks done, each exactly once" in said
    utterances = [e for e in record.events if isinstance(e, Said)]
    for utterance in utterances:
        assert utterance.text in said
    buttons = parsed.of_class("play")
    assert len(buttons) == len(utterances)
    assert all(button["aria-label"] for button in buttons)
    assert len(parsed.of_class("trail")) == 2
    assert len(parsed.of_class("place")) == 5
    assert len(parsed.of_class("start")) == len(parsed.of_class("end")) == 2
    assert len(parsed.of_class("carried-out")) == 5
    assert "collided with another voice" in said


def test_tells_a_bad_end(record: MissionRecord) -> None:
    events = [e for e in record.events if not (isinstance(e, Performed) and e.task == 2)]
    last = events.pop()
    assert isinstance(last, Summary)
    twice = next(e for e in events if isinstance(e, Performed) and e.task == 3)
    events += [
        replace(twice, at_s=twice.at_s + 9.0, robot="Rob"),
        replace(last, lost=1, duplicates=1, undone=(2,), repeated=(3,)),
    ]
    parsed = Page(page(replace(record, events=tuple(events))))
    said = "".join(parsed.text)
    assert "Of 5 tasks, 1 not done and 1 done more than once" in said
    assert "nobody" in said
    assert "2 times" in said
    assert len(parsed.of_class("undone")) == 1


def test_shows_the_distance_from_the_plant(record: MissionRecord) -> None:
    first = next(e for e in record.events if isinstance(e, Performed))
    plant = next(p for p in record.events[0].plants if p.task == first.task)  # type: ignore[union-attr]
    moved = replace(first, x_m=plant.x_m + 0.03, y_m=plant.y_m - 0.04)
    events = tuple(moved if e is first else e for e in record.events)
    assert "0.050" in "".join(Page(page(replace(record, events=events))).text)


def test_a_place_that_only_one_robot_fits_in_is_on_the_map_and_in_its_legend(
    parsed: Page, record: MissionRecord
) -> None:
    assert len(parsed.of_class("area")) == len(parsed.of_class("wait")) == len(parsed.of_class("area-key")) == 1
    (started, *events) = record.events
    assert isinstance(started, Started)
    without = Page(page(replace(record, events=(replace(started, places=()), *events), sound=record.sound[:0])))
    assert without.of_class("area") == without.of_class("area-key") == []


def test_the_sound_holds_every_utterance_at_its_time(parsed: Page, record: MissionRecord) -> None:
    samples = sound_of(parsed)
    assert len(samples) == len(record.sound)
    items = parsed.of_class("said")
    spoken = sorted((e for e in record.events if isinstance(e, Said)), key=lambda e: e.at_s)
    for item, said in zip(items, spoken, strict=True):
        first, last = (round(float(item[key] or "nan") * SAMPLE_RATE_HZ) for key in ("data-from", "data-to"))
        part = samples[first:last]
        loudest_hz = np.argmax(np.abs(np.fft.rfft(part))) * SAMPLE_RATE_HZ / len(part)
        assert abs(loudest_hz - pitch_of(("Rob", "Rob1").index(said.speaker))) < 5.0
        assert np.std(part) > 2.5 * np.std(samples[: round(0.9 * SAMPLE_RATE_HZ)])  # before the first utterance
    assert np.mean(np.abs(samples) >= 126 / 128) < 0.001


def test_pictures_are_whole(parsed: Page) -> None:
    images = parsed.all("image")
    assert 1 <= len(images) <= 6
    assert sum(1 for a in parsed.all("figure") if "hidden" not in a) == 1
    for image in images:
        png = base64.b64decode((image["href"] or "").removeprefix("data:image/png;base64,"))
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
    assert len(parsed.all("option")) == len(images) + len(SPEEDS)


def test_hostile_names_do_no_harm() -> None:
    tasks = tuple(f"{HOSTILE} {k}" for k in range(5))
    record = example(names=(HOSTILE, "Bot"), task_names=tasks, title=HOSTILE)
    text = page(record)
    parsed = Page(text)
    assert len(parsed.all("script")) == 1
    assert len(parsed.all("img")) == 0
    assert not [name for each in parsed.elements for name in each.attributes if name.startswith("on")]
    assert "</script><img src=x onerror=alert(1)>" in "".join(parsed.text)
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u202e\ud800]", text)


def test_same_record_same_bytes(record: MissionRecord, text: str, tmp_path: Path) -> None:
    write_report(record, tmp_path / "report.html")
    assert (tmp_path / "report.html").read_bytes() == text.encode("utf-8")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_three_minutes_fit_six_megabytes(record: MissionRecord, text: str) -> None:
    assert len(record.sound) / SAMPLE_RATE_HZ > 170
    assert len(text.encode()) < 6_000_000


def test_a_long_mission_of_a_big_team() -> None:
    record = example(12, 40, task_names=tuple(f"water the {k}th rose" for k in range(40)))
    text = page(record)
    parsed = Page(text)
    assert len(sound_of(parsed)) == len(record.sound)
    assert len(text) < 1_200_000 * len(record.sound) / SAMPLE_RATE_HZ / 60.0
    assert len(parsed.all("image")) <= 6
    points = sum(len((trail["points"] or "").split()) for trail in parsed.of_class("trail"))
    assert points < 500 < sum(len(trail.t_s) for trail in record.trails)
    for trail in parsed.of_class("trail"):
        assert len((trail["points"] or "").split()) == len((trail["data-times"] or "").split())


def test_a_mission_without_anything() -> None:
    parsed = Page(page(MissionRecord((), (), np.zeros(0, np.float32))))
    assert parsed.all("audio") == []
    assert "did not end" in "".join(parsed.text)


def test_no_sound_no_buttons() -> None:
    parsed = Page(page(example(sound=False)))
    assert parsed.of_class("play") == parsed.all("audio") == []


def test_seals_are_shown_with_what_they_are_worth(record: MissionRecord) -> None:
    seals = {"Rob": "sealed", "Rob1": "not trusted"}
    events = tuple(
        replace(event, seal="sealed")
        if isinstance(event, Said)
        else replace(event, seal=seals.get(event.listener, ""))
        if isinstance(event, Heard)
        else event
        for event in record.events
    )
    shown = "".join(Page(page(replace(record, events=events))).text)
    assert "sealed ✓" in shown
    listeners = {event.listener for event in events if isinstance(event, Heard) and event.seal == "not trusted"}
    assert listeners
    for listener in listeners:
        assert f"not trusted by {listener}" in shown
    assert "sealed" not in "".join(Page(page(record)).text)
