"""The names that the package re-exports."""

import subprocess
import sys

import pytest

import goalreach_evaluation


def test_every_exported_name_is_found_in_its_module() -> None:
    names = [name for names in goalreach_evaluation._EXPORTS.values() for name in names]
    assert sorted(names) == sorted(goalreach_evaluation.__all__)
    assert all(getattr(goalreach_evaluation, name) is not None for name in names)


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = goalreach_evaluation.nonsense


def test_the_choices_alone_load_no_opencv() -> None:
    code = 'import goalreach_evaluation.choices, sys; print("cv2" in sys.modules)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == 'False'
