"""The page on the protocol shows the table that the code runs on."""

from pathlib import Path

from hvcpd.coordination.table import TRANSITIONS
from release.diagram import FROM_EVERYWHERE, diagram, legend

PAGE = Path(__file__).parents[2] / "docs" / "protocol.md"


def test_the_page_is_in_step_with_the_table() -> None:
    text = PAGE.read_text(encoding="utf-8")
    remedy = "run: python -m release.diagram, and put its output at the end of docs/protocol.md"
    assert diagram() in text, remedy
    assert legend() in text, remedy


def test_every_transition_is_an_arrow() -> None:
    arrows = diagram()
    for (state, trigger), (following, _) in TRANSITIONS.items():
        if trigger not in FROM_EVERYWHERE:
            line = next(a for a in arrows.splitlines() if a.startswith(f"    {state.name} --> {following.name}: "))
            assert trigger.name.lower().replace("_", " ") in line.split(": ")[1].split(", ")
