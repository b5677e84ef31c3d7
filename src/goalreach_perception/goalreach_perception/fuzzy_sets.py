"""The fuzzy sets of the state: shared, since the learner's environment knows them too."""

from __future__ import annotations

from goalreach_msgs_py.fuzzy_sets import memberships

__all__ = ['memberships']
