"""Uncertainty of the parameters and of the tool: law of propagation and Monte Carlo."""
