"""Fake DYNAMIXEL motors on a pseudo-terminal, for any Dynamixel Protocol 2.0 software.

Start at `hil_fakes.dynamixel.bus.FakeBus` and `hil_fakes.dynamixel.motor.FakeMotor`.
"""
