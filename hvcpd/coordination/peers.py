"""The registry of robots and people within earshot, kept by ear."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import lru_cache

from hvcpd.config.tasks import Place
from hvcpd.language import messages as m


@lru_cache(maxsize=4096)
def name_hash(name: str, salt: int) -> int:
    """A hash of a name, the same on all robots."""
    return zlib.crc32(f"{salt}/{name}".encode())


@dataclass
class Peer:
    """A robot or person who was heard. Times are seconds of the sample clock; -inf: never."""

    name: str
    team: str | None
    last_heard_s: float
    confidence: float = 1.0
    """Of the last sentence that was understood: 0 to 1."""
    snr_db: float | None = None
    """Of the last sentence, if the recogniser measures it."""
    last_said: m.Utterance | None = None
    """Its last sentence that was understood."""
    answered_s: float = float("-inf")
    """When this robot last answered its greeting."""
    silent_until_s: float = float("-inf")
    """It did not answer an order: it is not asked again before then."""
    silent: bool = False
    """It did not answer when all were asked, and was not heard since; or it said that it leaves."""
    told: bool = False
    """This robot was the last to tell it what is left."""
    assigned: int | None = None
    """The task that this robot ordered it to do and that it has not reported yet."""
    met: Place | None = None
    """Where this robot stood when that one last answered it, or, until then, when it was first heard."""
    counted_s: float = 0.0
    """When it was last heard, on the clock by which a peer counts as gone."""
    sought: bool = False
    """This robot has gone back there, and has not been answered since."""
    unable: frozenset[int] = frozenset()
    """The tasks that it said it cannot do."""
    is_person: bool = False
    """It has been heard in no robot's voice, and has named no team: it takes no orders."""


def team_of(u: m.Utterance) -> str | None:
    """The speaker's team, from its introduction, its claim or its greeting."""
    if u.team is None and isinstance(u.addressee, m.ToTeam) and isinstance(u.statement, m.Claim | None):
        return u.addressee.team
    return u.team


QUIET_S = 60.0
"""Longest part of one silence that counts towards a peer being gone, where robots rest for hours: longer than a turn of
the largest team."""


class Peers:
    """All robots and people ever heard. `absent_s`: one that was not heard for this long counts as gone; if the team
    `rests`, only QUIET_S of each silence count, because in a silence nobody could have been heard."""

    def __init__(self, absent_s: float, rests: bool) -> None:
        self._absent_s = absent_s
        self.let_rest(rests)
        self._rested_s = 0.0
        self._peers: dict[str, Peer] = {}
        self.last_heard_s = float("-inf")
        """When a peer was last heard."""

    def let_rest(self, rests: bool) -> None:
        """Whether the team rests from now on, possibly for hours."""
        self._most_s = QUIET_S if rests else float("inf")

    def get(self, name: str | None) -> Peer | None:
        return self._peers.get(name.lower()) if name is not None else None

    def all(self) -> tuple[Peer, ...]:
        return tuple(self._peers.values())

    def people(self) -> frozenset[str]:
        """The names, in lower case, of those that are surely no robots."""
        return frozenset(key for key, peer in self._peers.items() if peer.is_person)

    def robots(self) -> tuple[Peer, ...]:
        """All but those that are surely people: nobody waits for people to confirm anything, or leaves tasks to
        them."""
        return tuple(peer for peer in self._peers.values() if not peer.is_person)

    def present(self, now: float) -> tuple[str, ...]:
        """The names, in lower case and sorted, of the robots that are believed to be within earshot."""
        return tuple(sorted(name for name in self.listening(now) if not self._peers[name].is_person))

    def listening(self, now: float) -> tuple[str, ...]:
        """The names, in lower case, of all robots and people that are believed to be within earshot."""
        return tuple(name for name in self._peers if self.is_present(name, now))

    def is_present(self, name: str, now: float) -> bool:
        peer = self._peers.get(name.lower())
        return peer is not None and not peer.silent and peer.counted_s >= self._counted(now) - self._absent_s

    def _counted(self, now: float) -> float:
        """The time without the uncounted part of each silence."""
        silence_s = now - self.last_heard_s if self.last_heard_s > float("-inf") else 0.0
        return now - self._rested_s - max(silence_s - self._most_s, 0.0)

    def heard(
        self, name: str | None, now: float, team: str | None = None, by_person: bool | None = None
    ) -> Peer | None:
        """Note that a peer spoke; a team once announced is kept. `by_person`: in no robot's voice; None: others told
        it. None without a name, and for FRIEND: nobody waits for somebody who may be anybody, or gives it an order."""
        if name is None or name.lower() == m.FRIEND:
            return None
        peer = self._peers.get(name.lower())
        if peer is None:
            peer = self._peers[name.lower()] = Peer(name, team, now, is_person=by_person is True)
        peer.is_person &= by_person is not False and team is None
        self._rested_s = now - self._counted(now)
        self.last_heard_s = now
        peer.counted_s = self._counted(now)
        peer.last_heard_s, peer.team = now, team or peer.team
        peer.silent, peer.silent_until_s = False, float("-inf")
        return peer

    def has_left(self, name: str) -> None:
        """It said that it leaves."""
        peer = self._peers.get(name.lower())
        if peer is not None:
            peer.silent = True

    def nobody_answered(self, since_s: float) -> bool:
        """All were asked, often. Returns whether no robot was heard since then, so that they count as gone."""
        silent = all(peer.last_heard_s < since_s for peer in self.robots())
        for peer in self.robots() if silent else ():
            peer.silent = True
        return silent
