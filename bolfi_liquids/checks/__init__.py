"""The commands `check sbc` and `check physics`."""
