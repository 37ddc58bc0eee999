"""The worth of each mechanism of the ear: run `python -m benchmarks.ablation --help`."""
