"""What may be asked at the doors, by number: of the engine (see `engine.motion_kernel`) and of the residuals."""

from __future__ import annotations

POSITION, MOTION, INTEGRATE, FOLLOW, ARRIVE, REPORT, RESIDUAL, SOLVE, TANGENT, INSPECT, COMPLETE = range(11)
SLOPES, WATCH = 11, 12
STEPS, ALONG, GAPS, PARTS, PUSHES = range(5)
