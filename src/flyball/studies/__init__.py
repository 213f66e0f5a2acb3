"""Studies: many runs of one model, grids and Monte Carlo samples, and comparison of formulations.

`sampling` makes the points, `run_analyses` says what one run computes and what is read from it, `study` runs them
on threads or an executor and keeps the file. Each run is the single run, to the last bit: runs share structures and
caches as any two calls do, and whether code is made for the mechanism is decided once. A study imports every analysis
that a run may ask for; no analysis imports a study. A new analysis of a study is a subclass of
`run_analyses.RunAnalysis`, listed in `study.ANALYSES`.
"""
