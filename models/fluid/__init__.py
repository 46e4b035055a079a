"""The particle fluid."""
