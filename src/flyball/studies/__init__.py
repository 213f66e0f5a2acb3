"""Studies: many runs of one model, grids and Monte Carlo samples, and comparison of formulations.

`sampling` creates the points, `run_analyses` defines what one run computes and which quantities are read from its
result, `study` runs them on threads or an executor and stores them in a file. A study imports every analysis that a run
can perform; no analysis imports a study. A new analysis of a study is a subclass of `run_analyses.RunAnalysis`, listed
in `study.ANALYSES`. If it has output times it is a subclass of `run_analyses.TimedAnalysis`, and the option with these
times is listed in `results.study.TIME_OPTIONS`, which `Study.question` needs. No test finds a missing entry there.
"""
