"""Any valid settings survive being written and read; any other YAML is one error."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import settings as examples
from hypothesis import strategies as st

from hvcpd.config.names import VoiceName
from hvcpd.config.quiet_hours import QuietSettings
from hvcpd.config.settings import (
    MAX_KNOWN_NAMES,
    VOICE_FACTORS,
    AudioSettings,
    ClipSettings,
    ControlSettings,
    PeerSettings,
    SecuritySettings,
    Settings,
    SpeechSettings,
    StartSettings,
    WaitSettings,
    WheelSettings,
)
from hvcpd.config.settings_file import load_settings
from hvcpd.config.skill_settings import PinSettings, SkillSettings, StopButtonSettings
from hvcpd.errors import ConfigError


def _plain(value: object) -> Any:
    match value:
        case Path():
            return str(value)
        case dict():
            return {key: _plain(part) for key, part in value.items()}
        case tuple():
            return [_plain(part) for part in value]
        case _ if dataclasses.is_dataclass(value):
            return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        case _:
            return value


def _of(type_: Any, **fixed: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Any valid value of a group of settings, its choices and bounds read from the dataclass itself."""
    hints = get_type_hints(type_)
    parts = dict(fixed)
    for field in dataclasses.fields(type_):
        if field.name not in parts:
            parts[field.name] = st.sampled_from(get_args(hints[field.name]))
    return st.builds(type_, **parts)


names = st.from_regex(r"[A-Za-z][A-Za-z0-9]{0,15}", fullmatch=True)
voices = st.none() | st.sampled_from(get_args(VoiceName))
teams = st.from_regex(r"[a-z]{1,16}", fullmatch=True)
texts = st.text(min_size=1, max_size=20)
paths = st.from_regex(r"/[A-Za-z0-9 _:#.-]{1,20}", fullmatch=True).map(Path)
starts = st.builds(
    StartSettings, st.floats(-50, 50), st.floats(-50, 50), st.floats(-360, 360).map(lambda degrees: degrees + 0.0)
)
words = st.lists(st.text("abc/.{}-", min_size=1, max_size=9).filter(lambda w: not w.startswith(".")), min_size=1)
pins = st.builds(
    PinSettings,
    pin=st.integers(0, 27),
    amount=st.sampled_from(["seconds", "litres"]),
    per_s=st.floats(0.001, 100),
    active_high=st.booleans(),
)
skills = st.one_of(
    st.builds(SkillSettings, run=words.map(tuple), safe=words.map(tuple), gpio=st.none()),
    st.builds(SkillSettings, run=st.just(()), safe=st.just(()), gpio=pins),
)
audios = st.builds(
    AudioSettings,
    input_device=st.none() | texts,
    output_device=st.none() | texts,
    input_channel=st.integers(1, 32),
    block_ms=st.integers(5, 100),
    queue_s=st.floats(0.1, 30),
    watchdog_s=st.floats(0.1, 10),
)
wheels = _of(
    WheelSettings,
    port=texts,
    left_id=st.integers(0, 252),
    right_id=st.integers(0, 252),
    wheel_radius_m=st.floats(0.01, 0.2),
    radius_ratio=st.floats(0.8, 1.25),
    separation_m=st.floats(0.05, 1.0),
)


factors = st.floats(*VOICE_FACTORS)


@st.composite
def all_settings(draw: st.DrawFn) -> Settings:
    team = draw(teams)
    made = draw(
        _of(
            Settings,
            name=names,
            team=st.just(team),
            teams=st.lists(teams.filter(lambda t: t != team), max_size=11, unique=True).map(lambda t: (*t, team)),
            lexicon=st.none() | paths,
            voice=voices,
            voice_folder=st.none() | paths,
            pitch=factors,
            rate=factors,
            peers=st.just({}),
            skills=st.dictionaries(st.sampled_from(["look", "pour", "grip_2"]), skills, max_size=3),
            tasks=paths,
            names=st.lists(names, max_size=MAX_KNOWN_NAMES, unique_by=str.casefold).map(tuple),
            state_dir=paths,
            unable=st.lists(st.integers(1, 99), max_size=5).map(tuple),
            clock=st.booleans(),
            learn_voices=st.booleans(),
            start=starts,
            speech=_of(SpeechSettings),
            quiet=_of(
                QuietSettings, hours=st.sampled_from((None, "22:00-07:00", "9:00-9:30")), level_db=st.floats(-30, 0)
            ),
            waits=_of(
                WaitSettings, absent_s=st.floats(120, 86400), lease_s=st.floats(120, 86400), answer_s=st.floats(2, 60)
            ),
            audio=audios,
            wheels=wheels,
            stop_button=_of(StopButtonSettings, pin=st.none() | st.integers(0, 27), normally_closed=st.booleans()),
            control=_of(ControlSettings, enabled=st.booleans(), socket=st.none() | paths, sound=st.booleans()),
            security=_of(SecuritySettings, key=st.none() | paths, encrypted=st.booleans()),
            clips=_of(ClipSettings, folder=st.none() | paths, keep=st.integers(1, 99), keep_mb=st.floats(1, 99)),
            seed=st.none() | st.integers(0, 2**32 - 1),
        )
    )
    assert isinstance(made, Settings)
    others = [name for name in made.names if name.casefold() != made.name.casefold()]
    speak = _of(PeerSettings, voice=voices, voice_folder=st.none() | paths, pitch=factors, rate=factors)
    return dataclasses.replace(made, peers={name: draw(speak) for name in others[:3]})


@given(all_settings())
@examples(max_examples=40)
def test_whatever_is_valid_survives_being_written_and_read(settings: Settings) -> None:
    assume(settings.wheels.left_id != settings.wheels.right_id)
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "hvcpd.yaml"
        path.write_text(yaml.safe_dump(_plain(settings)), encoding="utf-8")
        assert load_settings(path) == settings


@given(
    st.dictionaries(
        st.text(max_size=8),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | texts,
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
            max_leaves=6,
        ),
        max_size=5,
    )
)
@examples(max_examples=40)
def test_any_other_yaml_is_a_config_error_and_nothing_else(content: dict[str, Any]) -> None:
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "hvcpd.yaml"
        path.write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
        if set(content) <= {field.name for field in dataclasses.fields(Settings)}:
            return  # may be valid by chance
        with pytest.raises(ConfigError):
            load_settings(path)
