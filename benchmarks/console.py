"""Speed and accessibility of the console, measured in a real headless Chromium.

    python -m benchmarks.console [--loads 5] [--sentences 20] [--hours 8]

`paint`: the page's first contentful paint (W3C Paint Timing), with an empty cache, while the conversation of --hours is
there already. `shown`: from when a running robot has understood a sentence, over its control socket, until the
sentence stands in the page; the robot's own block of 25 ms and the browser's drawing are in it. The recogniser itself
waits 0.25 s after the last word (docs/recognition.md), which is not. `long`: what a conversation of --hours costs: how
long a further sentence then takes, elements in the page, and its JavaScript heap. `axe`: serious and critical
violations that axe-core finds, live and replayed, on a desktop and a phone, light and dark.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from selenium import webdriver

from hvcpd.console.app import live_app, replay_app
from hvcpd.console.guard import PageAccess
from hvcpd.console.link import Link
from hvcpd.console.replay import read_recording
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Viewers
from tests.console.asking import heard, status, task
from tests.console.browser import Served, Show, chromium, faults, look_like, until
from tests.console.test_replay import recorded
from tests.daemon.running import RunningRobot
from tests.daemon.test_control_service import heard as recognised
from tests.reporting.example import example

SENTENCE_EVERY_S = 4.0
"""A busy team: one robot or another speaks all the time."""
SCREENS = ((1280, 900, False), (390, 844, True))

WATCH = """
window.shownAt = [];
new MutationObserver((changes) => { for (const change of changes) for (const item of change.addedNodes)
  if (item.textContent.includes(arguments[0])) requestAnimationFrame(() => window.shownAt.push(Date.now() / 1000));
}).observe(document.getElementById("chat"), { childList: true });
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--sentences", type=int, default=20)
    parser.add_argument("--hours", type=float, default=8.0)
    options = parser.parse_args()
    with chromium() as driver:
        look_like(driver, *SCREENS[0][:2])
        with full_of_talk(options.hours) as show:
            paint(driver, show, options.loads)
            long(driver, show, options.sentences)
        shown(driver, options.sentences)
        accessible(driver)


@contextmanager
def full_of_talk(hours: float) -> Iterator[Show]:
    """A page of a robot that has heard a sentence every SENTENCE_EVERY_S for this time."""
    with Show().up() as show:
        count = round(hours * 3600.0 / SENTENCE_EVERY_S)
        for k in range(count):
            show.scene.event(heard(f"Hi Rob, I am Bot, sentence {k}", at_s=SENTENCE_EVERY_S * k))
        print(f"{count} sentences in {hours:g} h")
        yield show


def paint(driver: webdriver.Chrome, show: Show, loads: int) -> None:
    times_s = []
    script = "return performance.getEntriesByName('first-contentful-paint')[0]?.startTime"
    driver.execute_cdp_cmd("Network.enable", {})
    for _ in range(loads):
        driver.execute_cdp_cmd("Network.clearBrowserCache", {})
        driver.get(show.url)
        times_s.append(until(lambda: driver.execute_script(script)) / 1000.0)
    tell("paint", times_s, "goal 1 s")


def long(driver: webdriver.Chrome, show: Show, sentences: int) -> None:
    until(lambda: driver.find_elements("css selector", "#chat > li"))
    times_s = []
    for k in range(sentences):
        mark = f"one more, {k},"
        driver.execute_script(WATCH, mark)
        began_s = time.time()
        show.do(show.scene.event, heard(mark))
        times_s.append(until(lambda: driver.execute_script("return window.shownAt[0]")) - began_s)
    tell("long", times_s, "a further sentence")
    elements = driver.execute_script("return document.getElementsByTagName('*').length")
    heap = driver.execute_script("return performance.memory.usedJSHeapSize")
    print(f"      {elements} elements in the page, JavaScript heap {heap / 1e6:.1f} MB")


def shown(driver: webdriver.Chrome, sentences: int) -> None:
    """From the robot's understanding to the page, over the socket of a daemon."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Scene(Viewers())
        link = Link(Path(folder) / "state" / "rob.sock", scene)
        with RunningRobot(Path(folder)) as robot, served(scene, link).up() as page:
            driver.get(page.url)
            until(lambda: "Connected" in driver.find_element("id", "link").text)
            times_s = []
            for k in range(sentences):
                words = ("rob", "turn", ("left", "right")[k % 2])
                driver.execute_script(WATCH, f"Rob, turn {words[-1]}")
                event = recognised(words)
                now = round(robot.bench.bench.robot.now * 16_000)
                began_s = time.time()
                robot.bench.bench.recogniser.coming.append(replace(event, start_sample=now, end_sample=now + 8000))
                times_s.append(until(lambda: driver.execute_script("return window.shownAt[0]")) - began_s)
            tell("shown", times_s, "goal 0.3 s, of which the recogniser's rest takes 0.25 s")


def served(scene: Scene, link: Link) -> Served:
    return Served(live_app(scene, link.ask, link.run, PageAccess()), ending=scene.viewers.end)


def accessible(driver: webdriver.Chrome) -> None:
    with tempfile.TemporaryDirectory() as folder, Show().up() as show:
        recording = read_recording(recorded(Path(folder), example(sound=False)))
        with Served(replay_app(recording.messages, None, recording.title, PageAccess())).up() as replayed:
            peer = {"name": "Bot", "team": "plant", "present": False, "heard_ago_s": 9.0, "confidence": 0.9}
            show.do(show.scene.tasks, [task(), task(2, state="done", owner="Bot"), task(3, state="failed")])
            show.do(show.scene.status, status(stopped=True, peers=[peer], speaking=True))
            show.do(show.scene.event, heard(confidence=0.8))
            show.do(show.scene.event, {"event": "level", "level_dbfs": -30.0, "floor_dbfs": -50.0})
            for what, url in (("live", show.url), ("replay", replayed.url)):
                for width, height, phone in SCREENS:
                    for scheme in ("light", "dark"):
                        look_like(driver, width, height, scheme, phone)
                        driver.get(url)
                        until(lambda: driver.find_elements("css selector", "#robots li"))
                        found = faults(driver)
                        print(f"axe   {what}, {width} by {height}, {scheme}: {found or 'no serious violation'}")


def tell(row: str, times_s: list[float], what: str) -> None:
    worst, middle = max(times_s), statistics.median(times_s)
    print(f"{row:6}median {middle:.3f} s, worst {worst:.3f} s of {len(times_s)} ({what})")


if __name__ == "__main__":
    main()
