"""Pairs of kinds with contact formulas of their own, faster or more complete than the generic pair."""
