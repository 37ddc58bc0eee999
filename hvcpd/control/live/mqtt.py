"""`hvcpctl mqtt`: a running robot at an MQTT broker, as Home Assistant finds it. The daemon itself has no network.

Messages and topics: docs/integrations.md. Discovery: Home Assistant's documentation, "MQTT",
"Device discovery payload".
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from hvcpd import __version__
from hvcpd.control.live.daemon_client import DaemonClient, find_daemon
from hvcpd.control.live.follow import watch
from hvcpd.control.output import print_note
from hvcpd.errors import ConfigError, HvcpdError, NotDoneError, NotRunningError, how_to_install
from hvcpd.reporting.text import plural

RESTING = ("wall_s", "now_s", "uptime_s", "pid", "sound", "peers", "pose", "counts")
"""Fields of a status that change without an event; they alone are not a reason to send the status again."""
STATUS_EVERY = 30
"""Seconds after which the status is sent in any case, so that levels and counts are no older."""
WILDCARDS = frozenset("+#\0")
"""Not allowed in a topic that is published to (MQTT 3.1.1, section 4.7)."""
MOST_UNSENT = 1000
"""Messages that wait while the broker takes none, about 0.5 MB; further ones are dropped and counted."""
AT_LEAST_ONCE = 1
"""MQTT's quality of service of all that is sent."""


class Broker:
    """A connection to an MQTT broker, kept up by paho's own thread. A context manager; says "offline" at its end."""

    def __init__(self, options: argparse.Namespace, name: str, obey: Callable[[str], None]) -> None:
        """`obey` is called with each command, in paho's thread; it is to let no exception out.

        Raises ConfigError without the library, and for a topic or password that cannot be used.
        """
        try:
            from paho.mqtt import client as mqtt
        except ImportError:
            remedy = how_to_install("paho-mqtt", "python3-paho-mqtt")
            raise ConfigError(f"the MQTT library is missing: {remedy}") from None
        for option, topic in (("--prefix", options.prefix), ("--discovery", options.discovery)):
            if not topic or set(topic) & WILDCARDS:
                raise ConfigError(f"{option} {topic!r} is not a topic that can be published to")
        if options.password_file is not None and not options.user:
            raise ConfigError("--password-file: whose password is it? add --user NAME")
        self.topic = f"{options.prefix}/{name.lower()}"
        self._address = options.host, options.port or (8883 if options.tls else 1883)
        version: dict[str, Any] = {}
        if hasattr(mqtt, "CallbackAPIVersion"):  # from paho 2 on; Debian 12 has 1.6
            version["callback_api_version"] = mqtt.CallbackAPIVersion.VERSION2
        # Of two with one identifier the broker disconnects each when the other connects, and a stop may reach neither.
        identifier = f"{f'hvcpd-{name.lower()}'[:16]}-{secrets.token_hex(3)}"  # 23 characters: MQTT 3.1.1, 3.1.3
        self._client = mqtt.Client(client_id=identifier, **version)
        self._client.max_queued_messages_set(MOST_UNSENT)
        self._client.will_set(f"{self.topic}/available", "offline", AT_LEAST_ONCE, retain=True)
        if options.user:
            self._client.username_pw_set(options.user, _password(options.password_file))
        if options.tls:
            self._client.tls_set()
        self._client.on_connect = lambda _client, _data, _flags, code, *_: self._answered(code)
        self._client.on_disconnect = lambda *_: self._lost()
        self._client.on_message = lambda _client, _data, message: self._command(message, obey)
        self._at_connect: dict[str, str] = {}
        self._n_dropped = 0
        self._is_there = False

    def __enter__(self) -> Broker:
        try:
            self._client.connect(*self._address)
        except (OSError, ValueError) as error:  # ValueError: a host or port that cannot be
            host, port = self._address
            reason = getattr(error, "strerror", None) or error
            raise NotDoneError(f"no MQTT broker answers at {host}, port {port}: {reason}") from None
        self._client.loop_start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._is_there = False
        with suppress(ValueError, RuntimeError):  # paho's, of a message that the broker never took
            self._client.publish(f"{self.topic}/available", "offline", AT_LEAST_ONCE, retain=True).wait_for_publish(2.0)
        self._client.disconnect()
        self._client.loop_stop()

    def keep(self, topic: str, text: str) -> None:
        """Publish a retained message, which later subscribers see too, and again after each connection."""
        self._at_connect[topic] = text
        self.tell(topic, text, retain=True)

    def tell(self, topic: str, text: str, retain: bool = False) -> None:
        """Publish a message, which is dropped while there is no connection."""
        if not self._client.is_connected():
            self._n_dropped += not retain  # the others are sent at the next connection
        elif self._client.publish(topic, text, AT_LEAST_ONCE, retain=retain).rc != 0:
            self._n_dropped += 1

    def _command(self, message: Any, obey: Callable[[str], None]) -> None:
        """Obey, except retained commands, which would be carried out again after each connection."""
        if message.retain:
            print_note("MQTT: retained commands are ignored; send them without `retain`")
        else:
            obey(message.payload.decode(errors="replace"))

    def _lost(self) -> None:
        if self._is_there:
            host, port = self._address
            print_note(f"MQTT: the broker at {host}, port {port}, is gone; trying again")
        self._is_there = False

    def _answered(self, code: Any) -> None:
        """The broker has taken or refused the connection; paho tries again by itself."""
        if code != 0:
            print_note(f"MQTT: the broker refuses us ({code}); see --user and --password-file")
            return
        self._is_there = True
        if self._n_dropped:
            print_note(f"MQTT: connected again, without {plural(self._n_dropped, 'message')}")
            self._n_dropped = 0
        self._client.subscribe(f"{self.topic}/command", AT_LEAST_ONCE)
        for topic, text in list(self._at_connect.items()):
            self._client.publish(topic, text, AT_LEAST_ONCE, retain=True)


class MqttShow:
    """Sends what a robot says, hears and does; calls `make_good` once its daemon is there."""

    def __init__(self, broker: Broker, make_good: Callable[[], None]) -> None:
        self._broker = broker
        self._make_good = make_good
        self._sent: dict[str, Any] = {}
        self._looks = 0

    def event(self, event: dict[str, Any], wall_s: float) -> None:
        """Each event under its kind."""
        text = json.dumps({**event, "wall_s": round(wall_s, 3)})
        self._broker.tell(f"{self._broker.topic}/{event['event']}", text)

    def state(self, status: dict[str, Any], tasks: list[dict[str, Any]]) -> None:
        """The status with the tasks, if something has changed or it is old."""
        self._make_good()
        lasting = {key: value for key, value in status.items() if key not in RESTING}
        lasting["board"] = [{key: value for key, value in task.items() if key != "lease_s"} for task in tasks]
        self._looks += 1
        if lasting == self._sent and self._looks < STATUS_EVERY:
            return
        self._sent, self._looks = lasting, 0
        self._broker.keep(f"{self._broker.topic}/status", json.dumps({**status, "board": tasks}))
        self._broker.keep(f"{self._broker.topic}/available", "online")

    def note(self, text: str) -> None:
        """The daemon has ended or does not answer, or is back; then its status is sent at once."""
        self._sent = {}
        print_note(text)
        self._broker.keep(f"{self._broker.topic}/available", "offline")


def run(options: argparse.Namespace) -> None:
    """Bridge until interrupted; wait for a daemon that has ended or does not answer."""
    with closing(find_daemon(options)) as daemon:
        name, path = daemon.name, daemon.path
    commands = Commands(path, options.commands)
    with Broker(options, name, commands.obey) as broker:
        broker.keep(
            f"{options.discovery}/device/hvcpd_{name.lower()}/config", json.dumps(discovery(name, broker.topic))
        )
        watch(options, MqttShow(broker, commands.make_good))


class Commands:
    """Carries out `stop`, and with `all_commands` also `resume` and `say SENTENCE`; errors are one line each."""

    def __init__(self, path: Path, all_commands: bool) -> None:
        self._path = path
        self._all_commands = all_commands
        self._owes_stop = False
        """No daemon was there to be stopped: the next one is."""

    def obey(self, text: str) -> None:
        """Carry out a command."""
        command, _, sentence = text.strip().partition(" ")
        command = command.lower()  # whoever writes "Stop" means it
        try:
            if command not in ("stop", "resume", "say"):  # the rest of the text may have a person's code in it
                raise ConfigError(f"MQTT: {command[:40]!r} is not obeyed; see hvcpctl mqtt --help")
            if command != "stop" and not self._all_commands:
                raise ConfigError(f"MQTT: {command!r} is obeyed only with --commands")
            self._owes_stop = command == "stop" or (self._owes_stop and command == "say")
            with closing(DaemonClient(self._path)) as daemon:
                daemon.ask(command, **({"text": sentence} if command == "say" else {}))
            self._owes_stop = False
        except NotRunningError as error:
            print_note(f"{error}{'; it is stopped once it runs' * self._owes_stop}")
        except HvcpdError as error:
            print_note(str(error))

    def make_good(self) -> None:
        """A daemon is there."""
        if self._owes_stop:
            self.obey("stop")


def discovery(name: str, topic: str) -> dict[str, Any]:
    """Return the message by which Home Assistant (2024.11 or newer) makes a device with its entities of the robot."""
    own = f"hvcpd_{name.lower()}"

    def entity(platform: str, key: str, text: str, **more: str) -> dict[str, str]:
        payload = {"p": platform, "unique_id": f"{own}_{key}", "name": text, **more}
        return payload if platform == "button" else {"state_topic": f"{topic}/status", **payload}

    stopped = "{{ 'ON' if value_json.stopped else 'OFF' }}"
    heard = {"state_topic": f"{topic}/heard", "value_template": "{{ value_json.text }}"}
    return {
        "dev": {"ids": [own], "name": name, "mf": "hvcpd", "sw": __version__},
        "o": {"name": "hvcpd", "sw": __version__},
        "availability_topic": f"{topic}/available",
        "cmps": {
            "doing": entity("sensor", "doing", "Doing", value_template="{{ value_json.doing }}"),
            "open": entity("sensor", "open", "Open tasks", value_template="{{ value_json.tasks.open | default(0) }}"),
            "done": entity("sensor", "done", "Done tasks", value_template="{{ value_json.tasks.done | default(0) }}"),
            "battery": entity(
                "sensor",
                "battery",
                "Battery",
                device_class="voltage",
                unit_of_measurement="V",
                value_template="{{ value_json.battery_v }}",
            ),
            "heard": {**entity("sensor", "heard", "Heard"), **heard},
            "stopped": entity("binary_sensor", "stopped", "Stopped", value_template=stopped),
            "stop": entity("button", "stop", "Stop", command_topic=f"{topic}/command", payload_press="stop"),
        },
    }


def _password(path: Path | None) -> str | None:
    if path is None:
        return None
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"--password-file {path}: {getattr(error, 'strerror', None) or error}") from None
