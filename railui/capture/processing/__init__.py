"""From recordings to runs: sensor maps, units, alignment, measured track."""
