"""The computational spring model: curves, exact hysteresis, heat and a viscous branch.

It knows no stand and no recording; its equations stand in ``docs/model.md``.
"""
