"""Steps by impulses: what touches, what joints hold, and how velocities change, over one step of time."""
