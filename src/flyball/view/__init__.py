"""Plots, the animation page, and what they are made from."""
