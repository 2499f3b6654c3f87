"""Studies: one file per question that is asked of a vehicle on a track at a speed."""
