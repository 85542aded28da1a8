"""Where model and measurement part, which unmodelled effect causes it, and how far the gap shrinks once it is added."""
