#!/usr/bin/env python3
"""Moves a hobby servo on a Raspberry Pi's pin 18 by gpiozero: `grip.py ANGLE`, or `grip.py hold` to leave it as it is.

Where there is no servo, GPIOZERO_PIN_FACTORY=mock GPIOZERO_MOCK_PIN_CLASS=mockpwmpin has it move nothing.
"""

import json
import sys
import time

TURN_S = 0.6
"""For the whole way, of a small servo without a load."""


def main(word: str) -> int:
    if word == "hold":
        return 0
    try:
        from gpiozero import AngularServo

        servo = AngularServo(18, min_angle=-90, max_angle=90)
    except Exception as error:  # whatever it is, somebody wants to hear of it
        sys.stdout.write(json.dumps({"reason": "the gripper is stuck"}) + "\n")
        sys.stderr.write(f"{error}\n")
        return 1
    servo.angle = float(word)
    time.sleep(TURN_S)
    sys.stdout.write(json.dumps({"results": {"angle_deg": float(word)}}) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
