"""Programs that speak the instruments own wires: each is its own process, imported by nobody."""
