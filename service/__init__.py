"""The service beside the cell: composes the drivers and the numerics, stores, queues and serves."""
