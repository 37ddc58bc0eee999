"""The motion of a fake motor's shaft: a first-order lag to the wanted speed, and friction that ends every stop.

Solved exactly for any time step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

VELOCITY_UNIT_RAD_S = 0.229 * 2.0 * math.pi / 60.0
"""One unit of the velocity items: 0.229 rev/min (e-Manual, xl430-w250)."""

ACCELERATION_UNIT_RAD_S2 = 214.577 * 2.0 * math.pi / 3600.0
"""One unit of profile acceleration: 214.577 rev/min² (e-Manual)."""

TICKS_PER_TURN = 4096

NO_LOAD_RAD_S_PER_V = 57.0 * 2.0 * math.pi / 60.0 / 11.1
"""No-load speed of 57 rev/min at 11.1 V (e-Manual, specifications), taken as proportional to the voltage."""


@dataclass(frozen=True)
class ShaftSettings:
    """The fake's mechanics."""

    time_constant_s: float = 0.1
    """Lag of the velocity loop with a Burger's wheel; an assumption of the right order, not a measurement."""
    stop_time_constant_s: float = 0.05
    """Lag of a stop, with torque or without: the 258:1 gear brakes the wheel by itself; assumption."""
    friction_rad_s2: float = 2.0
    """Dry friction of the gear, as deceleration: a stop ends, it does not fade out for ever; assumption."""
    encoder_noise_ticks: float = 0.5
    """Standard deviation of the encoder's reading; assumption: the last bit flickers."""


@dataclass
class Shaft:
    """Angle (rad, unbounded) and speed (rad/s) of the output shaft, positive counter-clockwise seen at the horn."""

    settings: ShaftSettings = field(default_factory=ShaftSettings)
    angle_rad: float = 0.0
    speed_rad_s: float = 0.0
    setpoint_rad_s: float = 0.0
    """The speed that the velocity profile asks for just now."""
    blocked: bool = False
    """True while something holds the wheel."""

    def drive(self, goal_rad_s: float, acceleration_rad_s2: float, dt_s: float) -> None:
        """Move for `dt_s` under torque; `acceleration_rad_s2` 0 means no profile (the setpoint jumps)."""
        if acceleration_rad_s2 > 0.0:
            step = acceleration_rad_s2 * dt_s
            self.setpoint_rad_s += min(max(goal_rad_s - self.setpoint_rad_s, -step), step)
        else:
            self.setpoint_rad_s = goal_rad_s
        if self.setpoint_rad_s == 0.0:
            self._stop(dt_s)
        else:
            self._approach(self.setpoint_rad_s, dt_s)

    def coast(self, dt_s: float) -> None:
        """Move for `dt_s` without torque."""
        self.setpoint_rad_s = 0.0
        self._stop(dt_s)

    def _approach(self, target_rad_s: float, dt_s: float) -> None:
        if self.blocked:
            self.speed_rad_s = 0.0
            return
        tau_s = self.settings.time_constant_s
        decay = math.exp(-dt_s / tau_s)
        self.angle_rad += target_rad_s * dt_s + (self.speed_rad_s - target_rad_s) * tau_s * (1.0 - decay)
        self.speed_rad_s = target_rad_s + (self.speed_rad_s - target_rad_s) * decay

    def _stop(self, dt_s: float) -> None:
        """Solves speed' = -speed/tau - friction, until the shaft stands."""
        if self.blocked or self.speed_rad_s == 0.0:
            self.speed_rad_s = 0.0
            return
        tau_s = self.settings.stop_time_constant_s
        held_rad_s = self.settings.friction_rad_s2 * tau_s  # the speed that friction takes away in one time constant
        start_rad_s = abs(self.speed_rad_s)
        until_s = min(dt_s, tau_s * math.log1p(start_rad_s / held_rad_s))
        decay = math.exp(-until_s / tau_s)
        way_rad = (start_rad_s + held_rad_s) * tau_s * (1.0 - decay) - held_rad_s * until_s
        self.angle_rad += math.copysign(way_rad, self.speed_rad_s)
        left_rad_s = (start_rad_s + held_rad_s) * decay - held_rad_s if until_s == dt_s else 0.0
        self.speed_rad_s = math.copysign(max(left_rad_s, 0.0), self.speed_rad_s)
