"""Measurements of speed and size. `python -m benchmarks` runs them and writes `bench.json`."""
