"""From the skeleton of a file to a motion: maps, plausibility, known faults."""
