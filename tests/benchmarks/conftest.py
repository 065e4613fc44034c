"""The peers' programs import what only the peers' own environments hold."""

collect_ignore = ["peers"]
