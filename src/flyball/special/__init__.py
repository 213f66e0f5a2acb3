"""Code made for one mechanism: what the engine does for it, written out, compiled and called by address."""
