"""The names that packages import on first use."""

import inspect
import re
import subprocess
import sys
from types import ModuleType

import pytest

import goalreach_bags
import goalreach_evaluation
import goalreach_learning
import goalreach_msgs_py
import goalreach_sim

LAZY = (
    goalreach_bags,
    goalreach_evaluation,
    goalreach_learning,
    goalreach_msgs_py,
    goalreach_sim,
)


@pytest.mark.parametrize('package', LAZY)
def test_every_exported_name_is_found_in_its_module(package: ModuleType) -> None:
    imported = re.findall(r'import (\w+) as \1\n', inspect.getsource(package))
    assert imported
    assert sorted(imported) == sorted(package.__all__) == dir(package)
    assert all(getattr(package, name) is not None for name in imported)


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = goalreach_evaluation.nonsense


def test_the_choices_alone_load_no_opencv() -> None:
    code = 'import goalreach_evaluation.choices, sys; print("cv2" in sys.modules)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == 'False'
