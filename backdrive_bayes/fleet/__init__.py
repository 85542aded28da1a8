"""Fleets: one function over every unit below a folder on dask.distributed, one result file a unit, one Parquet table of all.

What is done with a unit is handed in; this room finds units, runs them, keeps what comes, and says what the fleet looks like.
"""
