"""Sparse systems and how they are solved."""
