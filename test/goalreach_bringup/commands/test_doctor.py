import pytest

from goalreach_bringup.cli import main


def test_each_finding_has_a_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', '218')

    assert main(['doctor']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(line.startswith('ok     ') for line in lines)
    assert any('rmw_fastrtps_cpp' in line for line in lines)
    assert any('218, 0 participants' in line for line in lines)


def test_what_is_wrong_is_named_and_sets_the_status(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', 'abc')

    assert main(['doctor']) == 1
    wrong = [line for line in capsys.readouterr().out.splitlines() if line.startswith('wrong')]
    assert len(wrong) == 2
    assert all("ROS_DOMAIN_ID = 'abc': must be a whole number" in line for line in wrong)
