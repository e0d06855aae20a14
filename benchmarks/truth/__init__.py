"""How near pictures are to the set that they show, measured by mathematics that knows nothing of the march."""
