"""How well robots hear robots, beside PocketSphinx: run `python -m benchmarks.hearing --help`."""
