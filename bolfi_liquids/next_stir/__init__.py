"""The next stir: motions that could be made, and the one that tells most of the liquid."""
