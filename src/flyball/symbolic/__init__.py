"""Equations of motion as expressions: shown, solved, made linear, written as code."""
