"""Descriptions: names, numbers with units, checks. No numerics."""
