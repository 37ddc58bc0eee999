"""Recognition of robots by robots, compared with PocketSphinx: run `python -m benchmarks.hearing --help`."""
