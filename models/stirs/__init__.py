"""Stirs of many liquids, each with a stick that hangs in it."""
