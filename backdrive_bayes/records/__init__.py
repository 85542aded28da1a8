"""From files to records: reading, judging, cutting into branches, noise, reduction to blocks."""
