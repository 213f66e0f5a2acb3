"""Analyses: one file for each question a user can ask."""
