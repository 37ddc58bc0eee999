"""A clock that is moved by hand."""


class Clock:
    """Its time, s, is `now_s`."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s
