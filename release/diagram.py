"""Prints the table of a robot's conversation as docs/protocol.md ends with it: `python -m release.diagram`."""

from __future__ import annotations

import sys

from hvcpd.coordination.states import State, Trigger
from hvcpd.coordination.table import TRANSITIONS

FROM_EVERYWHERE = (Trigger.STOP, Trigger.LEAVE)
"""Triggers left out of the diagram."""


def diagram() -> str:
    """All transitions but "stop" and "leave", which lead from every other state to STOPPED and LEAVING; parallel ones
    share an arrow."""
    lines = ["stateDiagram-v2", f"    [*] --> {State.WAKING.name}"]
    arrows: dict[tuple[State, State], list[str]] = {}
    for (state, trigger), (following, _) in TRANSITIONS.items():
        if trigger not in FROM_EVERYWHERE:
            arrows.setdefault((state, following), []).append(trigger.name.lower().replace("_", " "))
    lines += [f"    {a.name} --> {b.name}: {', '.join(triggers)}" for (a, b), triggers in arrows.items()]
    lines += [f"    {State.STOPPED.name}: STOPPED (by stop, from every state but LEAVING and GONE)"]
    lines += [f"    {State.LEAVING.name}: LEAVING (by leave, from every state but GONE)"]
    return "\n".join(lines) + "\n"


def legend() -> str:
    """What the states and the triggers mean, as two Markdown tables."""
    out = ["| state | the robot |", "|---|---|"]
    out += [f"| {state.name} | {state.value} |" for state in State]
    out += ["", "| trigger | when |", "|---|---|"]
    out += [f"| {trigger.name.lower().replace('_', ' ')} | {trigger.value} |" for trigger in Trigger]
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    sys.stdout.write(f"```mermaid\n{diagram()}```\n\n{legend()}")
