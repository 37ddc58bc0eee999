"""What each mechanism of the ear is worth: run `python -m benchmarks.ablation --help`."""
