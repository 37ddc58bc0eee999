"""The page in a real browser: what a person sees, presses, and has read out."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from hvcpd.console.app import live_app, replay_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.link import Link
from hvcpd.console.replay import read_recording
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from hvcpd.coordination.states import State
from hvcpd.hardware.soundfile import write_wav
from hvcpd.language.card import make_card
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from hvcpd.reporting.card_page import card_page
from tests.console.asking import heard, status, task
from tests.daemon.running import RunningRobot
from tests.daemon.test_control_service import heard as recognised
from tests.reporting.example import example
from tests.reporting.shift_example import flower_tasks

if TYPE_CHECKING:
    from tests.console import browser
else:
    browser = pytest.importorskip("tests.console.browser", reason="needs selenium and axe-core-python (dev)")

pytestmark = [pytest.mark.slow, pytest.mark.skipif(browser.MISSING, reason=browser.WHY)]


@pytest.fixture(scope="module")
def driver() -> Iterator[browser.webdriver.Chrome]:
    with browser.chromium() as running:
        yield running


@pytest.fixture
def show(driver: browser.webdriver.Chrome) -> Iterator[browser.Show]:
    browser.look_like(driver, 1280, 900)
    with browser.Show().up() as served:
        driver.get(served.url)
        browser.until(lambda: text(driver, "#robots li b") == "Rob")
        yield served
        driver.get("about:blank")


def text(driver: browser.webdriver.Chrome, selector: str) -> str:
    """The shown text of the last element of this kind; empty if there is none."""
    found = driver.find_elements("css selector", selector)
    return str(found[-1].text) if found else ""


def press(driver: browser.webdriver.Chrome, selector: str) -> None:
    driver.find_element("css selector", selector).click()


def complaints(driver: browser.webdriver.Chrome) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser")]


def test_a_sentence_is_shown_with_how_sure_it_was_heard(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    show.do(show.scene.event, heard("Hi all, I am Bot, what is left"))
    browser.until(lambda: text(driver, "#chat li p") == "Hi all, I am Bot, what is left")
    assert "97 % sure" in text(driver, "#chat li .marks")
    announced = driver.find_element("css selector", "#news").get_attribute("textContent")
    assert "Bot: Hi all, I am Bot, what is left" in str(announced), "and read out"
    assert complaints(driver) == []


def test_lines_stand_in_the_order_in_which_they_were_said(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    """A sentence is told seconds after it began, when it was understood; what was said meanwhile is there already."""
    for number, at_s in ((0, 100.0), (2, 104.0), (1, 102.0)):
        show.do(show.scene.event, heard(f"sentence {number}", at_s=at_s))
    said = "return [...document.querySelectorAll('#chat li p')].map((p) => p.textContent)"
    browser.until(lambda: driver.execute_script(said) == ["sentence 0", "sentence 1", "sentence 2"])


def test_the_board_has_the_tasks_own_marks_and_numbers(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    browser.look_like(driver, 390, 844, "light", phone=True)
    show.do(show.scene.tasks, [task(icon="book"), task(2, icon="☕")])
    browser.until(lambda: len(driver.find_elements("css selector", "#board tr")) == 2)
    assert len(driver.find_elements("css selector", "#board th svg.icon")) == 2
    assert [number.text for number in driver.find_elements("css selector", "#board td.no")] == ["1", "2"]
    assert "☕" in str(driver.find_elements("css selector", "#board th")[1].get_attribute("textContent"))


def test_a_task_is_added_by_the_form(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    press(driver, "#add summary")
    for name, value in {"number": "6", "name": "water the red tulip", "x_m": "1.5", "y_m": "-2"}.items():
        driver.find_element("css selector", f"#add [name={name}]").send_keys(value)
    press(driver, "#add [name=on_demand]")
    press(driver, "#add form button")
    browser.until(lambda: "task 6 is taken up" in text(driver, "#told"))
    task = {
        "number": 6,
        "name": "water the red tulip",
        "actions": ["go to place", {"water": 5}],
        "place": {"x_m": 1.5, "y_m": -2},
        "on_demand": True,
    }
    assert show.robot.asked[-1] == ("task", {"do": "add", "task": task})
    assert complaints(driver) == []


def test_what_is_heard_is_never_run(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    evil = "<img src=x onerror=document.title='run'><script>document.title='run'</script>"
    show.do(show.scene.tasks, [task(name=evil, owner=evil, failed_by=[evil])])
    show.do(show.scene.event, heard(evil, speaker=evil))
    show.do(show.scene.status, status(doing=evil, wheels={"fault": evil}))
    browser.until(lambda: evil in text(driver, "#chat li p"))
    browser.until(lambda: evil in text(driver, "#robots"))
    assert driver.find_elements("css selector", "main img, main script") == []
    assert driver.title.startswith("Rob")


def test_the_stop_button_stops_at_once_and_resuming_asks(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    press(driver, "#stop")
    browser.until(lambda: "Rob is stopped" in text(driver, "#told"))
    assert show.robot.asked == [("stop", {}), ("say", {"text": "stop"})]
    show.do(show.scene.status, status(stopped=True))
    browser.until(lambda: "stopped" in text(driver, "#alarms"))
    show.robot.asked.clear()
    press(driver, "#resume")
    press(driver, "dialog button[value=no]")
    assert show.robot.asked == []
    press(driver, "#resume")
    press(driver, "#ask-one")
    browser.until(lambda: show.robot.asked == [("resume", {})])


LATE_REPLY = """
const real = window.fetch;
window.fetch = async (...request) => {
  const answer = await (await real(...request)).json();
  if (answer.told?.includes("take on tasks")) await new Promise((go) => { window.arrive = go; });
  return { json: async () => answer };
};"""
"""The reply to "resume" arrives only when the test lets it."""


def test_a_late_reply_to_resume_does_not_hide_that_the_robot_was_stopped(
    driver: browser.webdriver.Chrome, show: browser.Show
) -> None:
    driver.execute_script(LATE_REPLY)
    show.do(show.scene.status, status(stopped=True))
    browser.until(lambda: driver.find_element("css selector", "#resume").is_displayed())
    press(driver, "#resume")
    press(driver, "#ask-one")
    browser.until(lambda: driver.execute_script("return window.arrive !== undefined"))
    press(driver, "#stop")
    browser.until(lambda: "Rob is stopped" in text(driver, "#told"))
    driver.execute_async_script("window.arrive(); setTimeout(arguments[0], 0)")
    assert "Rob is stopped" in text(driver, "#told")


def test_the_stop_button_is_had_by_keyboard(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    for _ in range(6):
        driver.switch_to.active_element.send_keys(browser.TAB)
        if driver.switch_to.active_element.get_attribute("id") == "stop":
            break
    driver.switch_to.active_element.send_keys(browser.ENTER)
    browser.until(lambda: show.robot.asked[:1] == [("stop", {})])


def test_eight_hours_of_talk_are_shown_a_window_at_a_time(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    def talk() -> None:
        for number in range(6000):
            show.scene.event(heard(f"sentence {number}", at_s=100.0 + 5.0 * number))
        show.scene.link(False, "")
        show.scene.link(True, "Connected to Rob")

    def items() -> int:
        return len(driver.find_elements("css selector", "#chat > li"))

    show.do(talk)
    browser.until(lambda: text(driver, "#chat li p") == "sentence 5999")
    seen: set[int] = set()
    for _ in range(8):
        first = driver.execute_script("chat.scrollTop = 0; return Number(chat.firstChild.dataset.n)")
        browser.until(partial(driver.execute_script, f"return Number(chat.firstChild.dataset.n) < {first}"))
        seen.add(items())
    assert max(seen) <= 600
    press(driver, "#latest")
    # In one step: the page takes away, while it scrolls, what a driver has just found.
    last = "return Array.from(document.querySelectorAll('#chat li p')).pop()?.textContent"
    browser.until(lambda: driver.execute_script(last) == "sentence 5999")


def test_who_reads_further_up_is_not_pulled_away(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    for number in range(60):
        show.do(show.scene.event, heard(f"sentence {number}"))
    browser.until(lambda: text(driver, "#chat li p") == "sentence 59")
    driver.execute_script("chat.scrollTop = 100")
    show.do(show.scene.event, heard("one more"))
    browser.until(lambda: "(1)" in text(driver, "#latest"))
    assert driver.execute_script("return chat.scrollTop") == 100
    press(driver, "#latest")
    browser.until(lambda: driver.execute_script("return chat.scrollHeight - chat.scrollTop - chat.clientHeight") < 2)


def test_nobody_is_kept_out(driver: browser.webdriver.Chrome, show: browser.Show) -> None:
    """Desktop and phone, light and dark, with a hint and with the question before resuming."""
    show.do(show.scene.tasks, [task(), task(2, state="done", owner="Bot"), task(3, failed_by=["Bot"])])
    peer = {"name": "Bot", "team": "plant", "present": False, "heard_ago_s": 9.0, "confidence": 0.9, "snr_db": 20.0}
    show.do(show.scene.status, status(stopped=True, peers=[peer], speaking=True))
    show.do(show.scene.event, heard(confidence=0.8))
    show.do(show.scene.event, {"event": "garbled", "at_s": 101.0, "listener": "Rob"})
    show.do(show.scene.event, {"event": "level", "level_dbfs": -30.0, "floor_dbfs": -50.0})
    browser.until(lambda: text(driver, "#alarms li") and text(driver, "#chat li.act"))
    wide = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
    for asking in (False, True):
        if asking:
            press(driver, "#resume")
        for width, height, phone in ((1280, 900, False), (390, 844, True)):
            for scheme in ("light", "dark"):
                browser.look_like(driver, width, height, scheme, phone)
                assert browser.faults(driver) == [], f"{width} {scheme} {asking}"
                assert driver.execute_script(wide) <= 0, "nothing sticks out sideways"


def test_five_hints_lead_through_the_page_once_by_keyboard(
    driver: browser.webdriver.Chrome, show: browser.Show
) -> None:
    assert text(driver, ".hint b") == "Hint 1 of 5"
    driver.execute_script("document.querySelector('.hint button').focus()")
    for number in range(2, 6):
        driver.switch_to.active_element.send_keys(browser.ENTER)
        assert text(driver, ".hint b") == f"Hint {number} of 5"
        assert driver.switch_to.active_element.is_displayed()
    driver.switch_to.active_element.send_keys(browser.ENTER)
    assert driver.find_elements("css selector", ".hint") == []
    assert driver.switch_to.active_element.get_attribute("id") == "hints", "whoever ended them is not lost"
    driver.refresh()
    browser.until(lambda: text(driver, "#robots li b") == "Rob")
    assert driver.find_elements("css selector", ".hint") == [], "once"
    press(driver, "#hints")
    assert text(driver, ".hint b") == "Hint 1 of 5"
    driver.switch_to.active_element.send_keys(browser.ESCAPE)
    assert driver.find_elements("css selector", ".hint") == []


def test_a_real_robot_is_stopped_lost_and_found_again(driver: browser.webdriver.Chrome, tmp_path: Path) -> None:
    scene = Scene(Viewers())
    link = Link(tmp_path / "state" / "rob.sock", scene)
    app = live_app(scene, link.ask, link.run, PageAccess(key="k"))
    with browser.Served(app, "k", scene.viewers.end).up() as served:
        driver.get(served.url)
        browser.until(lambda: "searching for it again" in text(driver, "#link"))
        with RunningRobot(tmp_path) as robot:
            browser.until(lambda: text(driver, "#link") == "Connected to Rob")
            robot.bench.bench.recogniser.coming.append(recognised())
            browser.until(lambda: "Hi Rob, I am Bot, water the green rose" in text(driver, "#chat"))
            press(driver, "#stop")
            browser.until(lambda: robot.state is State.STOPPED)
            browser.until(lambda: "stopped" in text(driver, "#alarms"))
        browser.until(lambda: "searching for it again" in text(driver, "#link"))
        press(driver, "#stop")
        browser.until(lambda: "by voice" in text(driver, "#told"))
        driver.get("about:blank")


def test_a_recorded_mission_is_played_and_wound_back(driver: browser.webdriver.Chrome, tmp_path: Path) -> None:
    from tests.console.test_replay import recorded

    record = example(sound=False)
    end_s = int(max(trail.t_s[-1] for trail in record.trails)) + 2
    write_wav(tmp_path / "mission.wav", np.zeros(16_000 * end_s, np.float32))
    recording = read_recording(recorded(tmp_path, record))
    browser.look_like(driver, 1280, 900)
    with browser.Served(
        replay_app(recording.messages, str(recording.sound), recording.title, PageAccess())
    ).up() as served:
        complaints(driver)
        driver.get(served.url)
        browser.until(lambda: driver.execute_script("return sound.readyState >= 1"))
        driver.execute_script("sound.currentTime = sound.duration - 1")
        browser.until(lambda: len(driver.find_elements("css selector", ".state-done")) == 5)
        assert "has carried out" in text(driver, "#chat li.act")
        assert "Rob: has" not in text(driver, "#caption")
        driver.execute_script("sound.currentTime = 0")
        browser.until(lambda: not driver.find_elements("css selector", ".state-done"))
        play = driver.find_element("id", "play")
        play.send_keys(browser.ENTER)
        browser.until(lambda: play.get_attribute("aria-pressed") == "true")
        driver.find_element("id", "speed").send_keys("4")
        assert driver.execute_script("return sound.playbackRate") == 4
        play.send_keys(browser.ENTER)
        browser.until(lambda: driver.execute_script("return sound.paused"))
        for width in (1280, 390):
            for scheme in ("light", "dark"):
                browser.look_like(driver, width, 900, scheme, phone=width < 500)
                assert browser.faults(driver) == [], f"{width} {scheme}"
        assert complaints(driver) == []
        driver.get("about:blank")


def test_a_recording_without_sound_is_played_by_the_same_button(
    driver: browser.webdriver.Chrome, tmp_path: Path
) -> None:
    from tests.console.test_replay import recorded

    recording = read_recording(recorded(tmp_path, example(sound=False)))
    with browser.Served(replay_app(recording.messages, None, recording.title, PageAccess())).up() as served:
        driver.get(served.url)
        play = browser.until(lambda: driver.find_element("id", "play"))
        browser.until(play.is_displayed)
        play.send_keys(browser.ENTER)
        browser.until(lambda: driver.find_elements("css selector", "#chat > li"))
        play.send_keys(browser.ENTER)
        assert play.get_attribute("aria-pressed") == "false"
        driver.get("about:blank")


@pytest.mark.parametrize(("n_names", "n_tasks", "sheets"), [(2, 5, 2), (12, 5, 2), (2, 12, 3), (12, 30, 3)])
def test_the_phrase_card_prints_on_whole_sheets(
    n_names: int, n_tasks: int, sheets: int, driver: browser.webdriver.Chrome, tmp_path: Path
) -> None:
    names = "Rob Bot Max Ann Mia Ted Gus Rex Zoe Kim Oda Cal".split()[:n_names]
    tasks = flower_tasks(n_tasks)
    named, numbers = zip(*((task.name, task.number) for task in tasks), strict=True)
    book = Phrasebook(Vocabulary(tuple(names), ("plant", "a", "b"), named, numbers))
    (tmp_path / "card.html").write_text(card_page(make_card(book), tasks), encoding="utf-8")
    driver.get((tmp_path / "card.html").as_uri())
    driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
    printed = driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True, "printBackground": True})
    pdf = base64.b64decode(printed["data"])
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) == sheets
    assert b"595" in pdf, "A4 is 595 points wide"
