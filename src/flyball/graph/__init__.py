"""Expressions as a graph: a kind of number that every formula of the house takes, and what is made of it."""
