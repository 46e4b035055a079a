"""Pours: half a cup of liquid, in the cup's frame, that turns about its lip."""
