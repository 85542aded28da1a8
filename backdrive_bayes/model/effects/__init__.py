"""Candidate effects: what a reducer or its bench may do beyond the three modules of the baseline, one file each."""
