"""One stir or one pour by numbers."""
