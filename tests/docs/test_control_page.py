"""docs/control.md names the commands, events, error codes and bounds that there are."""

from __future__ import annotations

import re
from pathlib import Path

from hvcpd.daemon import control_lobby, control_protocol, control_server, latch_service, request_handler
from hvcpd.daemon.control_events import FREQUENT, KINDS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "control.md").read_text(encoding="utf-8")


def section(head: str) -> str:
    """The text below a heading, up to the next one."""
    return re.split(r"^#+ ", PAGE.partition(f"\n{head}\n")[2], maxsplit=1, flags=re.M)[0]


def first_column(text: str) -> list[str]:
    return re.findall(r"^\| `(\w+)`", text, re.M)


def test_every_command_is_in_the_table() -> None:
    assert set(first_column(section("## Messages"))) == set(request_handler.COMMANDS)
    logged = re.search(r"((?:`\w+`,? (?:and )?)+)are logged", PAGE)
    assert logged is not None
    assert set(re.findall(r"`(\w+)`", logged[1])) == request_handler.CHANGING


def test_every_event_is_in_the_table_and_the_last_come_only_on_request() -> None:
    named = first_column(section("## Events"))
    assert set(named) == set(KINDS)
    assert len(named) == len(KINDS)
    assert set(named[-5:]) == FREQUENT


def test_every_error_code_is_named() -> None:
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "hvcpd" / "daemon").glob("*.py")]
    codes = {code for text in texts for code in re.findall(r'RefusalError\(\s*"(\w+)"', text)}
    told = PAGE.partition("Error codes: ")[2].partition("\n\n")[0]
    assert len(codes) == 10
    assert set(re.findall(r"`(\w+)`", told)) == codes


def test_the_bounds_are_those_of_the_code() -> None:
    limits = section("## Limits")
    assert f"{control_protocol.MAX_LINE_BYTES} bytes;" in limits
    assert f"{control_server.MAX_CLIENTS}, {control_server.MAX_FOLLOWERS} of them with a subscription" in limits
    assert f"one every {control_server.PAUSE_S * 1000:g} ms" in limits
    assert (
        f"{control_server.MAX_UNREAD_BYTES >> 10} KiB of events, or a reply for {control_server.PATIENCE_S:g} s"
        in limits
    )
    assert f"| {control_lobby.MAX_WAITING}; one more" in limits
    per_s = [n / control_lobby.TURN_S for n in (control_lobby.ACCEPTS, control_lobby.ADMISSIONS)]
    assert f"{per_s[0]:g} accepted, {per_s[1]:g} served" in limits
    assert f"in {control_server.STOP_PLACES} places reserved" in " ".join(limits.split())
    assert f"after {latch_service.LATCH_S:g} s at the latest" in PAGE
    assert f"at most {control_protocol.MAX_ID_LENGTH} characters" in PAGE
