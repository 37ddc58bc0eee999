"""Journeys under seeded schedules of faults, in virtual time; a thousand of them run in `benchmarks/wheels.py`."""

import pytest

from hil_fakes.fault_schedule import Fault, schedule
from hil_fakes.virtual_robot import Kind
from hil_fakes.wheel_trial import Trial, run_trial
from hvcpd.hardware.motion import MotionState


@pytest.mark.parametrize("kind", ["dynamixel", "opencr"])
@pytest.mark.parametrize("seed", range(1, 9))
def test_no_rule_is_broken(seed: int, kind: Kind) -> None:
    verdict = run_trial(seed, kind)
    assert verdict.broken == []
    assert verdict.state in (MotionState.ARRIVED, MotionState.FAILED)


def test_a_seed_gives_the_same_trial_again() -> None:
    assert run_trial(3) == run_trial(3)
    assert schedule(3) != schedule(4)


def test_the_schedules_hold_every_fault() -> None:
    drawn = [event.fault for seed in range(40) for event in schedule(seed)]
    assert set(drawn) == set(Fault)


def test_wheels_that_do_not_stop_by_themselves_are_found_out() -> None:
    """The judge itself, on motors whose manual was ignored: their watchdog never trips."""
    seed = next(s for s in range(100) if schedule(s)[0].fault is Fault.UNPLUG)
    trial = Trial(seed)
    for motor in trial.robot.motors:
        motor.watchdog_broken = True
    assert any("unplug: the wheels still turn" in rule for rule in trial.run().broken)


def test_a_wheel_that_turns_the_wrong_way_is_found_out() -> None:
    trial = Trial(1)
    trial.robot.motors[0].mounting = -1
    assert any("nobody asked for" in rule for rule in trial.run().broken)
