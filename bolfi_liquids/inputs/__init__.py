"""What a person gives: recordings, tables, cups, rigs, priors, settings."""
