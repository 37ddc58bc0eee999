"""The registers of OpenCR with the TurtleBot3 firmware that we use, as data.

Sources: ROBOTIS-GIT turtlebot3 `turtlebot3_node/include/turtlebot3_node/control_table.hpp` and ROBOTIS-GIT OpenCR
`turtlebot3_ros2/src/turtlebot3/turtlebot3.cpp`. The controller knows ping, read and write only: no broadcast, no sync.
"""

from __future__ import annotations

from hvcpd.hardware.registers import Register

DEVICE_ID = 200
MODEL_NUMBER = 0x5000
"""What OpenCR answers to a ping (MODEL_NUM_DXL_SLAVE)."""

MODEL_INFORMATION = Register("model information", 2, 4)
BURGER_MODEL = 1
"""Model information of a Burger; 2 is a Waffle, whose wheels stand further apart."""

MILLIS = Register("millis", 10, 4)
DEBUG_MODE = Register("debug mode", 14, 1)
DEVICE_STATUS = Register("device status", 18, 1, signed=True)
HEARTBEAT = Register("heartbeat", 19, 1)
BATTERY_VOLTAGE = Register("battery voltage", 42, 4)
PRESENT_CURRENT_LEFT = Register("present current left", 120, 4, signed=True)
PRESENT_CURRENT_RIGHT = Register("present current right", 124, 4, signed=True)
PRESENT_VELOCITY_LEFT = Register("present velocity left", 128, 4, signed=True)
PRESENT_VELOCITY_RIGHT = Register("present velocity right", 132, 4, signed=True)
PRESENT_POSITION_LEFT = Register("present position left", 136, 4, signed=True)
PRESENT_POSITION_RIGHT = Register("present position right", 140, 4, signed=True)
MOTOR_TORQUE = Register("motor torque", 149, 1)
LINEAR_X = Register("linear x", 150, 4, signed=True)
ANGULAR_Z = Register("angular z", 170, 4, signed=True)
PROFILE_ACCELERATION_LEFT = Register("profile acceleration left", 174, 4)
PROFILE_ACCELERATION_RIGHT = Register("profile acceleration right", 178, 4)

COMMAND_SIZE = ANGULAR_Z.address + ANGULAR_Z.size - LINEAR_X.address
"""The six command words are written at once, 24 bytes from `LINEAR_X` on, as ROBOTIS's node does."""

COMMAND_PER_UNIT = 100
"""Command words count 0.01 m/s and 0.01 rad/s."""

BATTERY_UNIT_V = 0.01
EFFORT_UNIT = 0.001
"""Unit of the "present current": a Burger's motors have no current sensor, the firmware reads its load (0.1 %)
instead."""

MOTOR_VELOCITY_LIMIT = 265
"""A Burger's motors refuse faster goals, in `registers.VELOCITY_UNIT_RAD_S`: 6.35 rad/s (e-Manual, xl430-w250)."""

NO_MOTORS = -1
"""Device status when the motors did not answer the controller at its start."""

HEARTBEAT_TIMEOUT_S = 0.5
"""HEARTBEAT_TIMEOUT_MS: the time without a changed heartbeat after which the commands become zero."""


def command_block(linear: int, angular: int) -> bytes:
    """The six command words: forward speed and turning rate in units of 0.01, the others zero."""
    middle = bytes(COMMAND_SIZE - LINEAR_X.size - ANGULAR_Z.size)
    return LINEAR_X.encode(linear) + middle + ANGULAR_Z.encode(angular)
