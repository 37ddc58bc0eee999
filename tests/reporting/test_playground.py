"""The playground: what is in the page, and that a browser says what is typed."""

from __future__ import annotations

import base64
import io
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from hvcpd.control.cli import main
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.reporting.playground import KEPT_BITS, make_scenes, page
from hvcpd.synthesis.speaker import UnitPosition
from tests.console.browser import ENTER, MISSING, TAB, WHY, chromium, faults, look_like, until

ROBOTS = ("Rob", "Bot")
STICKS_OUT = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
FOCUSED = "return document.activeElement.textContent"


@pytest.fixture(scope="module")
def team() -> Team:
    from hvcpd.control.cli import make_parser

    return load_team(make_parser().parse_args(["playground"]), ROBOTS)


@pytest.fixture(scope="module")
def html(team: Team) -> str:
    scenes = make_scenes(team.phrasebook, ROBOTS, [task.number for task in team.tasks.tasks])
    return page(ROBOTS, [team.sound.speaker_of(name) for name in ROBOTS], team.phrasebook.graph, scenes)


@pytest.fixture(scope="module")
def data(html: str) -> dict[str, Any]:
    found = re.search(r'id="data">(.*?)</script>', html, re.S)
    assert found
    return dict(json.loads(found[1]))


def test_each_robots_words_are_in_the_page_as_it_says_them(data: dict[str, Any], team: Team) -> None:
    for robot in data["robots"]:
        sound, rate_hz = soundfile.read(io.BytesIO(base64.b64decode(robot["flac"])), dtype="float32")
        assert rate_hz == data["rate"]
        speaker = team.sound.speaker_of(robot["name"])
        for k, word in enumerate(data["words"]):
            for final, position in enumerate(UnitPosition):
                begin, length, _, _ = robot["units"][2 * k + final]
                unit = speaker.unit(word, position)
                assert length == len(unit)
                assert np.max(np.abs(sound[begin : begin + length] - unit), initial=0.0) < 2 * 2.0 ** (1 - KEPT_BITS)


def test_every_sentence_of_a_scene_is_in_the_phrasebook(data: dict[str, Any], team: Team) -> None:
    lines = [line["text"] for scene in data["scenes"] for line in scene["lines"]]
    assert [team.phrasebook.write(team.phrasebook.parse_text(line)) for line in lines] == lines
    assert len(data["scenes"]) == 4
    assert any(", I will complete task" in line and "confirmed" in line for line in lines)


def test_a_team_with_one_task_has_no_scene_with_two(team: Team) -> None:
    titles = [scene.title for scene in make_scenes(team.phrasebook, ROBOTS, [1])]
    assert titles == ["Claim", "Confirmation", "Stop"]


def test_the_page_loads_nothing_and_is_not_large(html: str) -> None:
    assert "http" not in re.sub(r'id="data">.*?</script>', "", html, flags=re.S).replace("http-equiv", "")
    assert len(html) < 3_200_000


@pytest.mark.parametrize(("robots", "fault"), [("Rob", "name 2 to 4"), ("Rob,Bot,Mia,Ted,Ada", "name 2 to 4")])
def test_too_few_or_too_many_robots_are_refused(robots: str, fault: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["playground", "--robots", robots]) == 2
    assert fault in capsys.readouterr().err


def test_a_page_that_cannot_be_written_is_told_before_words_are_rendered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told after minutes of work."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert main(["playground", "--robots", "Zed,Ida", "-o", str(tmp_path / "none" / "page.html")]) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert not (tmp_path / "cache").exists()


def test_the_robots_are_those_of_the_settings(tmp_path: Path) -> None:
    """They were Rob, Bot and Mia, whoever the team was."""
    (tmp_path / "hvcpd.yaml").write_text("name: Bot\nnames: [Bot, Rob]\n")
    written = tmp_path / "page.html"
    assert main(["playground", "--config", str(tmp_path / "hvcpd.yaml"), "-o", str(written)]) == 0
    found = re.search(r'id="data">(.*?)</script>', written.read_text(), re.S)
    assert found
    assert [robot["name"] for robot in json.loads(found[1])["robots"]] == ["Bot", "Rob"]


def test_while_sound_is_packed_a_signal_is_not_lost(team: Team) -> None:
    """Ctrl-C that came in a callback of the library was shown as "ignored", and so it was."""
    called: set[str] = set()
    sys.setprofile(lambda frame, _event, _argument: called.add(frame.f_code.co_name))
    try:
        page(ROBOTS[:1], [team.sound.speaker_of(ROBOTS[0])], team.phrasebook.graph, [])
    finally:
        sys.setprofile(None)
    assert "flac" in called
    assert not any(name.startswith("vio_") for name in called)


def test_a_folder_that_is_not_there_is_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["playground", "--robots", "Rob,Bot", "-o", str(tmp_path / "none" / "p.html")]) == 2
    assert "there is no folder" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(MISSING, reason=WHY)
def test_a_browser_says_what_is_typed_with_the_keyboard_alone(html: str, tmp_path: Path) -> None:
    file = tmp_path / "playground.html"
    file.write_text(html, encoding="utf-8")
    with chromium() as driver:
        for scheme, width in (("light", 1280), ("dark", 390)):
            look_like(driver, width, 1200, scheme, phone=width < 500)
            driver.get(file.as_uri())
            until(lambda: len(driver.find_elements("css selector", ".words span")) == 2 * 10)
            assert faults(driver) == []
            assert driver.execute_script(STICKS_OUT) <= 0
        type_into(driver)
        assert driver.get_log("browser") == []


def type_into(driver: Any) -> None:
    """Tab to the field, type, choose a word, play, stop."""
    driver.switch_to.active_element.send_keys(TAB)
    field = driver.switch_to.active_element
    field.clear()
    field.send_keys("bot stpo")
    assert "“stpo” cannot come here" in driver.find_element("id", "verdict").text
    assert not driver.find_element("css selector", ".say").is_enabled()
    for _ in "stpo":
        field.send_keys("\ue003")  # backspace
    field.send_keys(TAB)
    while driver.execute_script(FOCUSED) != "stop":
        driver.switch_to.active_element.send_keys(TAB)
    driver.switch_to.active_element.send_keys(ENTER)
    assert field.get_attribute("value") == "Bot stop"
    field.send_keys(ENTER)
    spoken = "return [...document.querySelectorAll('.playing .words span')].map((word) => word.textContent)"
    until(lambda: driver.execute_script(spoken) == ["Bot", "stop"])  # in one look: the robots play one after the other
    field.send_keys("\ue00c")  # escape
    assert driver.find_elements("css selector", ".playing") == []
