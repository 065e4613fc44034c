"""Tests. A package, so that its shared modules have a name and no folder here hides a package."""
