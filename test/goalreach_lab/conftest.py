"""Lets the processes that these tests start import the laboratory."""

import os
from pathlib import Path

LAB = Path(__file__).resolve().parents[2] / 'lab'

os.environ['PYTHONPATH'] = os.pathsep.join(
    [str(LAB), *filter(None, [os.environ.get('PYTHONPATH')])]
)
