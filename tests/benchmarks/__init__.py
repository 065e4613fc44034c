"""Benchmarks beside the peers, each in an environment of its own; see docs/benchmarks.md."""
