"""The fluid against what is known: truths, analysis of simulations, and the cases that compare.

A case is a module of `cases` that defines `CASE`; it is found by being there.
"""

from .case import Case, CaseResult, Curve, Panel, Progress, Row
from .registry import discover

__all__ = ["Case", "CaseResult", "Curve", "Panel", "Progress", "Row", "discover"]
