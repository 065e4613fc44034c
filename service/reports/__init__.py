"""Templates of documents for people."""
