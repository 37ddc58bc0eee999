"""Random acoustic paths ("worlds") between one robot's loudspeaker and another's ears, and a benchmark in them."""
