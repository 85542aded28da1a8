"""Figures drawn from saved results.

Every figure is one file with a function ``draw`` that returns a matplotlib figure, and a ``CAPTION`` that
says what is seen. They read ``indicators.json`` and ``posterior.nc`` and compute nothing beyond unit
conversion, ranks and bins for display and differences of saved arrays. ``catalogue.all_figures`` draws all of
them. Only this package imports matplotlib and corner.
"""
