"""Wheels of the MuJoCo robots, with their errors of construction."""

from typing import Any

CLEARANCE_M = 0.0001  # of castors, so that the tyres carry the base


def fit_wheels(spec: Any, solref: float, rng: Any) -> None:
    """Give tyres their radii and slip; castors are a little smaller than the smallest."""
    tyres, castors = (
        [geom for geom in spec.geoms if geom.classname.name == name] for name in ('tyre', 'castor')
    )
    for tyre in tyres:
        tyre.size[0] *= rng.normal(1, 0.004)
        tyre.solref[0] = solref
    for castor in castors:
        castor.size[0] = min(tyre.size[0] for tyre in tyres) - CLEARANCE_M
