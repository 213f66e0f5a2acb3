"""Loops that close in closed form, recognised by the form of their equations."""
