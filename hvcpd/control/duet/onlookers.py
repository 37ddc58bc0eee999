"""The onlookers of a duet: the terminal, which prints what it hears, a page, and a visitor who types."""

from __future__ import annotations

import asyncio
import json
import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from secrets import token_urlsafe
from threading import Thread
from typing import Any, TextIO

from hvcpd.control.live.console import live_page, missing_parts
from hvcpd.coordination.states import State
from hvcpd.daemon.control_socket import short_address
from hvcpd.daemon.wiring import Wiring
from hvcpd.errors import PhraseError
from hvcpd.language.addressees import FRIEND, ToRobot
from hvcpd.language.messages import Resume, Stop, for_robots
from hvcpd.language.variants import variants
from hvcpd.language.words import strict_words
from hvcpd.ports import Samples
from hvcpd.reporting.text import clean, clock

LOOK_S = 0.05
"""Interval of the attempts to reach a daemon's socket at its start."""
ANSWER_S = 4.0
"""Time after a visitor's sentence within which a robot reports it, including the search for its channel."""
TIMES = 2
"""Attempts of a visitor at one sentence."""
ECHO_S = 1.0
"""Largest difference between the beginnings of a call as it was said and as a robot hears it, or hears it again."""
TYPED_BYTES = 4096
"""A terminal's longest line (termios(3))."""
SOMEBODY = "somebody"
"""The speaker of a sentence without a name, in an event."""
KEYS = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|O.)|[\x00-\x1f\x7f]")
"""What terminals send for arrows and the like (control sequences, ECMA-48): typed by mistake, and no part of a word."""
STOP = "stop"
UNHEARD = "that was not understood; say it again"
LATER = "said once a robot has spoken; until then they obey only “stop”"


class TypedLines:
    """Puts lines together that come in pieces: a terminal hands over whole ones, a pipe whatever has come."""

    def __init__(self) -> None:
        self._begun = b""

    def take(self, data: bytes) -> list[str]:
        """The lines that `data` completes, without empty ones; b"", the end, completes what has begun."""
        *lines, self._begun = (self._begun + (data or b"\n")).split(b"\n")
        if len(self._begun) >= TYPED_BYTES:  # no sentence; it is told as such
            lines, self._begun = [*lines, self._begun], b""
        return [text for line in lines if (text := line.decode(errors="replace")).strip()]


class Visitor:
    """Says sentences of the phrasebook in a voice of its own. `play` plays a sound, in the robots' next pause or at
    once, and returns a function that tells whether it is over."""

    def __init__(self, name: str, wiring: Wiring, play: Callable[[Samples, bool], Callable[[], bool]]) -> None:
        self._name = name
        self.wiring = wiring
        """A robot's in force, whose tasks may have changed."""
        self._speaker = wiring.sound.speaker_of(name)
        self._play = play

    def say(self, text: str) -> Visit:
        """To be said in the robots' next pause, with the visitor's name where robots need one; "stop" at once. Nothing
        with that word is refused, as with words that are spoken. Raises PhraseError."""
        phrasebook, text = self.wiring.phrasebook(), KEYS.sub("", text).strip()
        try:
            typed = phrasebook.parse_text(text)
        except PhraseError:
            if not any((STOP,) in ((word,), *variants(word)) for word in strict_words(text)):
                raise
            typed, text = phrasebook.parse_text(STOP), STOP
        utterance = for_robots(replace(typed, speaker=self._name) if typed.speaker == FRIEND else typed)
        sound = self._speaker.render(phrasebook.phrases(utterance))
        one = utterance.addressee.name if isinstance(utterance.addressee, ToRobot) else ""
        line, is_stop = f"{self._name}: {text}", isinstance(utterance.statement, Stop)
        may_wait = not isinstance(utterance.statement, Stop | Resume)  # said later, "resume" would undo a "stop"
        return Visit(line, lambda: self._play(sound, is_stop), one, may_wait, is_stop)


class Visit:
    """A visitor's sentence, with its `line` for the terminal; `say` says it and returns a function that tells whether
    it is over. `addressee` is the robot that it is for, "" for any; `may_wait`: until a robot has spoken; `is_stop`: it
    takes the place of those that wait."""

    def __init__(
        self,
        line: str,
        say: Callable[[], Callable[[], bool]],
        addressee: str,
        may_wait: bool,
        is_stop: bool,
    ) -> None:
        self.line = line
        self.may_wait = may_wait
        self.is_stop = is_stop
        self._say = say
        self._addressee = addressee
        self._times = 0
        self._said_s: float | None = None

    def again(self) -> None:
        """Say it, or say it once more."""
        self._times += 1
        self._said_s = None
        self._is_said = self._say()

    def concerns(self, robot: str) -> bool:
        """Whether the sentence has reached its addressee if this robot has understood it."""
        return self._addressee in ("", robot)

    def failed(self, now_s: float) -> bool:
        """Whether all attempts failed; repeats the sentence when it is time. Call it regularly."""
        if self._said_s is None:
            self._said_s = now_s if self._is_said() else None
        elif now_s - self._said_s > ANSWER_S:
            if self._times == TIMES:
                return True
            self.again()
        return False


class Onlooker:
    """Writes what robots say and what they hear from people, and has a visitor repeat what its addressee missed."""

    def __init__(self, robots: Sequence[str], out: TextIO) -> None:
        self._robots = frozenset(robots)
        self._out = out
        self._latest_s = 0.0
        self._said: dict[tuple[str, str], float] = {}
        """When each text was last said by a robot, or heard by the robot of that name."""
        self._visit: Visit | None = None
        self._held: list[Visit] | None = []
        """Visits that wait for the first sentence of a robot, as robots that are new answer nobody; None after it."""
        self.fault: OSError | None = None
        """Why nothing more can be written: the reader has gone, or the disk is full."""

    async def follow(self, socket: Path, robot: str) -> None:
        """Write a robot's events until its daemon ends."""
        reader, writer = await _connected(socket)
        try:
            writer.write(b'{"command": "subscribe", "events": ["said", "heard", "held", "statechanged"]}\n')
            async for line in reader:
                self.tell(json.loads(line), robot)
        finally:
            writer.close()

    def note(self, text: str) -> None:
        """Write a message, which may repeat what was typed."""
        self.write(f"      ({clean(text)})")

    def visited(self, visit: Visit, now_s: float) -> None:
        """A visitor wants to say this."""
        self._write_at(now_s, visit.line)
        if self._held is not None and visit.may_wait:
            self._held.append(visit)
            self.note(LATER)
            return
        if self._held is not None and visit.is_stop:
            self._held.clear()
        self._admit(visit)

    def _admit(self, visit: Visit) -> None:
        visit.again()
        self._visit = visit

    def look(self, now_s: float) -> None:
        """Have a visitor repeat what nobody understood; after the last attempt write UNHEARD."""
        if self._visit is not None and self._visit.failed(now_s):
            self._visit = None
            self.note(UNHEARD)

    def tell(self, event: dict[str, Any], robot: str) -> None:
        """Write a robot's event if it is news to people in the room."""
        match event.get("event"):
            case "said":
                self._said["", event["text"]] = event["at_s"]
                self._write_at(event["at_s"], f"{robot}: {event['text']}")
                held, self._held = self._held or (), None
                for visit in held:
                    self._admit(visit)
            case "heard" if event["speaker"] not in self._robots and not self._is_known(event, robot):
                self._has_reached(robot)
                self._said[robot, event["text"]] = event["at_s"]
                who = "you" if event["speaker"] == SOMEBODY else event["speaker"]
                self._write_at(event["at_s"], f"{robot} heard {who}: {event['text']}")
            case "statechanged" if event["state"] == State.STOPPED.name.lower():
                self._has_reached(robot)  # it may obey a call without its sentence
            case "held":
                self._has_reached(robot)
                self._write_at(event["at_s"], f"{robot} stood still for what sounded like “stop”")

    def _has_reached(self, robot: str) -> None:
        """A visitor's sentence need not be repeated once its addressee has reacted to it."""
        if self._visit is not None and self._visit.concerns(robot):
            self._visit = None

    def _is_known(self, event: dict[str, Any], robot: str) -> bool:
        """Whether it was written already: a robot's call, as robots pass "stop" on without a name, or a call that this
        robot obeyed at its first word and has now understood as a whole."""
        before = (self._said.get((who, event["text"]), -math.inf) for who in ("", robot))
        return any(abs(event["at_s"] - at_s) < ECHO_S for at_s in before)

    def _write_at(self, at_s: float, text: str) -> None:
        """Write a line with its time, which never goes back: robots tell of what they heard once it is over."""
        self._latest_s = max(self._latest_s, at_s)
        self.write(f"{clock(self._latest_s):>5}  {clean(text)}")

    def write(self, text: str) -> None:
        """Write a line at once, or note the `fault`: events and signals bring most lines, which must not fail."""
        try:
            self._out.write(f"{text}\n")
            self._out.flush()
        except OSError as error:
            self.fault = self.fault or error


async def _connected(path: Path) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A connection to a daemon, as soon as it listens."""
    while True:
        with suppress(OSError), short_address(path) as address:
            return await asyncio.open_unix_connection(address)
        await asyncio.sleep(LOOK_S)


@contextmanager
def page(socket: Path, port: int) -> Iterator[str]:
    """The console of the robot at that socket, on a port of this computer; its address, "" where parts are missing.

    Raises ConfigError if the port cannot be opened.
    """
    if missing_parts():
        yield ""
        return
    from hvcpd.console.guard import KEY_BYTES, PageAccess
    from hvcpd.console.serve import PageServer, open_port

    key = token_urlsafe(KEY_BYTES)
    with open_port("127.0.0.1", port) as listener:
        address = f"127.0.0.1:{listener.getsockname()[1]}"
        app, end = live_page(socket, PageAccess(frozenset({address}), key))
        server = PageServer(app, lambda: None, end)
        thread = Thread(target=server.serve_on, args=(listener,), name="console", daemon=True)
        thread.start()
        try:
            yield f"http://{address}/?key={key}"
        finally:
            server.should_exit = True
            with suppress(RuntimeError):
                thread.join(GRACE_S)


GRACE_S = 3.0
"""Time for open pages to end."""
