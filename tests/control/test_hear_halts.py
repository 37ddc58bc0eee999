"""`hvcpctl hear` shows where a robot would halt, too."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hvcpd.assembly.sound import make_sound, user_cache_folder
from hvcpd.control.cli import main, make_parser
from hvcpd.control.hear.hear import BLOCK, events_in
from hvcpd.control.hear.heard_sentences import Teller, listening_team
from hvcpd.hardware.soundfile import write_wav
from hvcpd.recognition.events import Held, Released, Urgent
from tests.control.conftest import Ran
from tests.recognition.signals import in_noise


@pytest.mark.slow
@pytest.mark.parametrize("around_s", [0.0, 2.0])
@pytest.mark.parametrize("caller", ["Ada", "Pia"])
def test_a_call_is_shown_with_the_halt_before_it(
    caller: str, around_s: float, capsys: pytest.CaptureFixture[str], ran: Ran, tmp_path: Path
) -> None:
    """Also where the recording begins and ends with it: `hear` heard nothing in what `say` had written."""
    speaker = make_sound(None, user_cache_folder()).speaker_of(caller)
    write_wav(tmp_path / "call.wav", in_noise(0.2 * speaker.render([["stop"]]), around_s, around_s))
    hear = ["hear", str(tmp_path / "call.wav"), "--names", "Rob,Bot"]
    told = [json.loads(line) for line in ran(*hear, "--json").splitlines()]
    assert [each.get("event") or each["text"] for each in told] == ["hold", "Stop", "release"]
    assert all(0.0 <= each["start_s"] - around_s < each["end_s"] - around_s < 0.7 for each in told)
    assert main(hear) == 0
    shown = capsys.readouterr().out
    assert 's        [a robot stands still: this may be "stop"]' in shown
    assert "the word alone counts no more: the sentence around it does" in shown, "it said that the word is no stop"


@pytest.mark.slow
def test_nothing_is_heard_beyond_the_ends_of_a_recording() -> None:
    """What `hear` puts around it is quiet: a piece of it, repeated, passed for speech."""
    team, _ = listening_team(make_parser().parse_args(["hear", "x.wav"]))
    sound = team.sound.speaker_of("Bot", 0.9).render([["hi", "rob"], ["i", "am", "bot"], ["what", "is", "left"]])
    heard = list(events_in(sound, team))
    assert heard
    assert all(0 <= event.start_sample < event.end_sample <= len(sound) + BLOCK for event in heard)


def test_of_several_holds_in_a_row_the_first_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    options = make_parser().parse_args(["hear", "x.wav", "--json"])
    team, sealing = listening_team(options)
    teller = Teller(team, sealing, options)
    for event in (Held(0, 7_200), Held(16_000, 23_200), Released(16_000, 23_200), Held(32_000, 39_200), Urgent(0, 1)):
        teller.tell(event)
    assert [json.loads(line)["event"] for line in capsys.readouterr().out.splitlines()] == [
        "hold",
        "release",
        "hold",
        "stop",
    ]
