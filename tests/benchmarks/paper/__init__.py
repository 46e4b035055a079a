"""The paper's figures and what it left open, on simulated truths and a reference solver's pours."""
