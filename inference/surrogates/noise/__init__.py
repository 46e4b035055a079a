"""Measurement noise that users give."""
