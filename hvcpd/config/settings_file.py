"""Reads the settings of one robot: defaults, a YAML file, the environment and options, the later over the earlier."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hvcpd.config.document import Document, KeyPath, Place, parse, read_bytes
from hvcpd.config.loading import Parts, structure
from hvcpd.config.names import NameCheck, NameCheckBy, repeated_names
from hvcpd.config.settings import DEFAULT_NAMES, Settings
from hvcpd.config.skill_settings import SkillSettings, runnable
from hvcpd.config.sources import Sourced, overlay_environment, sources_of
from hvcpd.config.whereabouts import STAND_IN_NAME, SYSTEM_SETTINGS_PATH, absolute, settings_file
from hvcpd.errors import did_you_mean

DEFAULT = object()
"""In place of an option's value: the setting has its default, whatever the file and the environment say."""


@dataclass(frozen=True)
class Loaded:
    """Settings, and every key of them with its source, in the order of etc/hvcpd.yaml."""

    settings: Settings
    sources: tuple[Sourced, ...]
    file: Path | None = None
    skill_places: Mapping[str, str] = field(default_factory=dict)
    """Where each skill is written, as "FILE:LINE"."""

    @property
    def name(self) -> str | None:
        """The robot's name, or None where STAND_IN_NAME takes its place."""
        source = next(each.source for each in self.sources if each.key == "name")
        return None if source == "default" else self.settings.name


def load_with_sources(
    path: Path | None = None,
    overrides: Mapping[str, object] | None = None,
    *,
    name_needed: bool = True,
    reserved: NameCheckBy | None = None,
    system_path: Path = SYSTEM_SETTINGS_PATH,
    environment: Mapping[str, str] = os.environ,
) -> Loaded:
    """The settings in the file `path`, with the environment's variables and then a command's options over them.

    Without `path` the file that FILE_VARIABLE names is read, or else `system_path` if there is one. `overrides` maps
    a key such as `name` or `audio.input_device` to an option's value, or to DEFAULT; None means that the option was not
    given. With `name_needed` false (commands that are no robot) STAND_IN_NAME takes the place of a missing name.
    `reserved` is the phrasebook's check of names. File names in the file are relative to its directory. Raises
    ConfigError with every fault.
    """
    path = settings_file(path, environment, system_path)
    document = parse(read_bytes(path), str(path)) if path is not None else Document(Place("settings"))
    overlay_environment(document, Settings, environment)
    for key, value in (overrides or {}).items():
        if value is DEFAULT:
            document.drop(key)
        elif value is not None:
            plain = list(value) if isinstance(value, tuple) else value
            document.overlay(tuple(key.split(".")), plain, f"--{key.replace('.', '-').replace('_', '-')}")
    if not document.has(("name",)):
        if name_needed:
            document.fault(("name",), "the robot has no name; give --name NAME, or write `name: NAME` in the file")
        else:
            document.overlay(("name",), STAND_IN_NAME, "default")

    def check(parts: Parts) -> None:
        if reserved is not None:
            lexicon = parts.plain(("lexicon",))
            file = absolute(Path(lexicon), document, ("lexicon",), path) if isinstance(lexicon, str) else None
            _check_reserved(parts, reserved(file, "gb" if parts.plain(("accent",)) == "gb" else "us"))
        _check_peers(parts)
        _check_wheels(parts)

    settings = _with_whole_paths(structure(document, Settings, check), document, path)
    skill_places = {name: str(document.place(("skills", name))) for name in settings.skills}
    return Loaded(settings, tuple(sources_of(settings, document)), path, skill_places)


def load_settings(path: Path | None = None, overrides: Mapping[str, object] | None = None, **options: Any) -> Settings:
    """The settings of `load_with_sources` alone."""
    return load_with_sources(path, overrides, **options).settings


def commented_settings() -> str:
    """The commented settings, etc/hvcpd.yaml, which the package has beside this module."""
    return Path(__file__).with_name("example.yaml").read_text(encoding="utf-8")


def _check_wheels(parts: Parts) -> None:
    """Two motors on one bus have two identifiers."""
    sides: tuple[tuple[KeyPath, int], ...] = (("wheels", "left_id"), 1), (("wheels", "right_id"), 2)
    given = [(path, parts.get(path, int) if parts.has(path) else usual) for path, usual in sides]
    (left, left_id), (right, right_id) = given
    if left_id is not None and left_id == right_id:
        text = f"both wheels have the identifier {left_id}; give each motor its own"
        parts.fault(right if parts.has(right) else left, text)


def _with_whole_paths(settings: Settings, document: Document, path: Path | None) -> Settings:
    """The settings with absolute file names, and with their own team among the teams."""

    def whole(value: Any, key: KeyPath) -> Any:
        match value:
            case Path():
                return absolute(value, document, key, path)
            case SkillSettings():
                return runnable(value, path)
            case Mapping():
                return {name: whole(each, (*key, name)) for name, each in value.items()}
            case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
                parts = {name: whole(each, (*key, name)) for name, each in vars(value).items()}
                return dataclasses.replace(value, **parts)
            case _:
                return value

    teams = settings.teams if settings.team in settings.teams else (*settings.teams, settings.team)
    found: Settings = whole(settings, ())
    return dataclasses.replace(found, teams=teams)


def _check_reserved(parts: Parts, reserved: NameCheck) -> None:
    """No name is, or sounds like, a word of the phrasebook."""
    for path in [("name",), *parts.elements(("names",))]:
        name = parts.get(path, str)
        if name is not None and (text := reserved(name)) is not None:
            parts.fault(path, text)


def _check_peers(parts: Parts) -> None:
    """Each peer is another robot among those that are known."""
    names = parts.get(("names",), tuple[str, ...]) if parts.has(("names",)) else DEFAULT_NAMES
    own = parts.get(("name",), str) or ""
    peers = parts.plain(("peers",))
    if names is None or not isinstance(peers, dict):
        return
    known = {name.casefold() for name in names}
    checked: list[str] = []
    for peer in peers:
        checked.append(peer)
        if (text := repeated_names(tuple(checked))) is not None:
            checked.pop()
        if peer.casefold() == own.casefold():
            text = f"{peer!r} is this robot itself; set its own `voice`, `pitch` and so on instead"
        elif text is None and peer.casefold() not in known:
            text = f"{peer[:40]!r} is not one of `names`; {did_you_mean(peer[:40], names)}"
        if text is not None:
            parts.fault(("peers", peer), text)
