"""Equations written as code: functions of a mechanism in C, Python, CasADi or Numba."""
