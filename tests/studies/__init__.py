"""Seeded studies behind the figures in docs/; the tests run a small share of each."""
