"""The registry of who is within earshot, kept by ear."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Peer:
    """A robot or person who was heard. Times are seconds of the sample clock; -inf: never."""

    name: str
    team: str | None
    last_heard_s: float
    answered_s: float = float("-inf")
    """When we last answered its greeting."""
    silent_until_s: float = float("-inf")
    """It did not answer an order: it is not asked again before then."""
    assigned: int | None = None
    """The task that we ordered it to do and that it has not reported yet."""
    unable: frozenset[int] = frozenset()
    """The tasks that it said it cannot do."""


class Peers:
    def __init__(self) -> None:
        self._peers: dict[str, Peer] = {}

    def get(self, name: str) -> Peer | None:
        return self._peers.get(name.lower())

    def all(self) -> tuple[Peer, ...]:
        return tuple(self._peers.values())

    def heard(self, name: str, team: str | None, now: float) -> Peer:
        """Note that somebody spoke; a team once announced is kept."""
        peer = self._peers.get(name.lower()) or Peer(name, team, now)
        peer = replace(peer, last_heard_s=now, team=team or peer.team, silent_until_s=float("-inf"))
        self._peers[name.lower()] = peer
        return peer

    def update(self, name: str, **changes: object) -> None:
        peer = self._peers.get(name.lower())
        if peer is not None:
            self._peers[name.lower()] = replace(peer, **changes)  # type: ignore[arg-type]
