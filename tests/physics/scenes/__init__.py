"""Scenes of the cases alone: the fluid between other walls than cups."""
