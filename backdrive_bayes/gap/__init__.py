"""Diagnosis: where model and measurement part, which effect causes it, how far the gap shrinks with it."""
