"""rich's console for what follows a robot."""

from __future__ import annotations

from rich.console import Console


class Terminal(Console):
    """A console that raises BrokenPipeError where its reader has gone: rich's own ends the process with status 1, as if
    something had failed."""

    def on_broken_pipe(self) -> None:
        """Called by rich while it handles the error."""
        raise BrokenPipeError
