"""Bundled example data; where it comes from is told in README.md beside this file."""
