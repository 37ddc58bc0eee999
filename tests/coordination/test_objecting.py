"""When robots object to another one's claim: before all confirmations, and rarely at once."""

import random

import pytest

from hil_fakes.word_plans import NAMES
from hvcpd.coordination.actions import Role
from hvcpd.coordination.addressing import OTHERS_SLOT, OWNER_SLOT, confirming_slot, objection_slot
from hvcpd.coordination.coordination import Coordination
from hvcpd.coordination.knowledge import Knowledge
from tests.coordination.mission import plants

TRIALS = 300


def team(size: int, seed: int = 1) -> list[Knowledge]:
    """A team in which nobody has spoken yet; the first one claims."""
    names = NAMES[:size]
    return [
        Coordination(Role(name, "plant", roster=names), plants(8), random.Random(f"{seed} {name}")).knowledge
        for name in names
    ]


@pytest.mark.parametrize("size", range(2, 13))
def test_no_robot_confirms_before_all_others_could_object(size: int) -> None:
    claimant, *others = team(size)
    for number in range(1, 9):
        slots = [objection_slot(me, claimant.role.name, number, 5.0) for me in others]
        assert min(slots) == OTHERS_SLOT > OWNER_SLOT
        assert max(slots) < min(confirming_slot(me, 5.0) for me in others) or size == 2
        assert size > 4 or len(set(slots)) == len(slots), "in a small team each has a slot of its own"


@pytest.mark.parametrize("size", [6, 9, 12])
def test_if_the_first_by_rank_is_missing_one_of_many_others_often_objects_alone(size: int) -> None:
    """They draw anew for each repetition of the claim. Of ten that draw evenly one objects alone once in a hundred
    times."""
    claimant, *others = team(size)
    alone = 0
    for _ in range(TRIALS):
        slots = [objection_slot(me, claimant.role.name, 3, 5.0) for me in others]
        slots.remove(OTHERS_SLOT)
        alone += slots.count(min(slots)) == 1
    assert alone > 0.3 * TRIALS
