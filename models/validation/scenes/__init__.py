"""Scenes for validation alone: the fluid between other walls than cups."""
