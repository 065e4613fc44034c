"""Makes the checkout importable before any folder of tests is, whatever pytest is started with."""
