"""Where one robot stands in the other's base, by touching the cups of a sensing stage."""
