"""The order in which those who could answer a claim do so: objections first, then confirmations."""

from __future__ import annotations

from hvcpd.coordination.knowledge import Knowledge

DOER_SLOT = 0
"""Who did the task objects at once;"""
OWNER_SLOT = 1
"""then who is at it, or wants it too: in one slot the two would speak at once, over and over;"""
OTHERS_SLOT = 2
"""then somebody else who knows better, in the slot of its rank."""
OTHERS_RANK_MAX = 2
"""Up to this rank each has a slot of its own before all confirmations;"""
SHARED_SLOTS = 2
"""those after it draw one of so many. If two draw the same, nobody understands them and nobody confirms."""
UNSURE_SLOTS = 4
"""Who knows little, a newcomer or one who missed the claim, answers only if the others don't."""


def confirming_slot(me: Knowledge, now: float) -> int:
    """The first slot for confirmations, after all objections; where two are alone no third can object."""
    others = len(me.peers.present(now))
    if others > OTHERS_RANK_MAX + 1:
        others = OTHERS_RANK_MAX + 1 + SHARED_SLOTS
    return OTHERS_SLOT + (others if others > 1 else 0)


def objection_slot(me: Knowledge, other: str, number: int, now: float) -> int:
    """The slot in which this robot objects to `other`'s claim, if it knows better and is neither doer nor owner."""
    rank = me.rank(other, number, now)
    if rank > OTHERS_RANK_MAX:
        rank = OTHERS_RANK_MAX + 1 + int(me.rng.random() * SHARED_SLOTS)
    return OTHERS_SLOT + rank
