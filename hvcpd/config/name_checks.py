"""Checks of the names in settings that concern several keys."""

from __future__ import annotations

from typing import Any, cast

from hvcpd.config.document import KeyPath
from hvcpd.config.loading import Parts
from hvcpd.config.names import NameCheck, repeated_names
from hvcpd.errors import did_you_mean


def check_reserved(parts: Parts, reserved: NameCheck | None) -> None:
    """No name is, or sounds like, a word of the phrasebook."""
    if reserved is None:
        return
    paths: list[KeyPath] = [("name",), *(("names", index) for index in range(parts.length(("names",))))]
    for path in paths:
        name = parts.get(path, str)
        text = reserved(name) if name is not None else None
        if text is not None:
            parts.fault(path, text)


def check_peers(parts: Parts, default_names: tuple[str, ...]) -> None:
    """Each peer is another robot among those that are known."""
    names = parts.get(("names",), tuple[str, ...]) if parts.has(("names",)) else default_names
    own = parts.get(("name",), str) or ""
    peers = parts.get(("peers",), cast(type[Any], Any))
    if names is None or not isinstance(peers, dict):
        return
    known = {name.casefold() for name in names}
    told: list[str] = []
    for peer in (peer for peer in peers if isinstance(peer, str)):
        told.append(peer)
        text = repeated_names(tuple(told))
        if peer.casefold() == own.casefold():
            text = f"{peer!r} is this robot itself; set its own `voice` or `voice_folder` instead"
        elif text is None and peer.casefold() not in known:
            text = f"{peer[:40]!r} is not one of `names`; {did_you_mean(peer[:40], names)}"
        if text is not None:
            parts.fault(("peers", peer), text)
