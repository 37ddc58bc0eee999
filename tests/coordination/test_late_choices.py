"""What a robot says is chosen when it has the floor, by what it knows then."""

import pytest

from hvcpd.coordination.floor import Intent, Urgency
from tests.coordination.mission import Mission, plants


@pytest.mark.parametrize("seed", range(1, 6))
def test_a_task_that_a_listener_does_not_know_is_done_after_one_claim(seed: int) -> None:
    """The claim is joined to a report of a task that it does know."""
    tasks = plants(4)
    mission = Mission(("Rob", "Bot"), tasks, seed=seed, nearest_first=True)
    mission.robots["Bot"].retask(tasks[:3], 0.0)
    mission.air.run_until(400.0)
    claims = [text for text in mission.written() if "I will complete task four" in text]
    assert any("I do not know task four" in text for text in mission.written())
    assert len(claims) == 1
    assert mission.watered[4] == 1


def test_a_choice_is_made_at_the_time_of_speaking() -> None:
    mission = Mission(("Rob",), plants(1), coordinator="Nobody")
    mission.air.run_until(60.0)
    rob, times = mission.robots["Rob"], list[float]()
    rob.channel(True, 60.0)
    rob.knowledge.floor.want(Intent(Urgency.TURN, "test", lambda: None, decide=times.append), 60.0)
    rob.channel(False, 70.0)
    while not times:
        rob.tick(rob.next_deadline())
    assert 70.0 < times[0] < 80.0
