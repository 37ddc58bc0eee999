"""hvcpd: robots that coordinate by speaking English to each other, out loud."""

__version__ = "0.1.0"
