"""The `run` command: one run after another, as the page asks for them."""

from __future__ import annotations

import os
from unittest.mock import Mock

import pytest

from goalreach_bringup.commands import run
from goalreach_bringup.launch import session


@pytest.mark.parametrize('fails', [False, True])
def test_runs_follow_each_other_with_one_page_and_the_same_variables(
    fails: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, wanted = Mock(), [run.Options(seed=2), run.Options(seed=3), None]
    made: list[tuple[int, object]] = []

    class Session:
        def __init__(self, options: run.Options, given: object) -> None:
            made.append((options.seed, given))
            self.page, self.next_options = page, wanted[len(made) - 1]

        def execute(self) -> int:
            assert 'OF_A_RUN' not in os.environ
            os.environ['OF_A_RUN'] = 'x'
            assert not page.stop.called
            if fails and len(made) == 2:
                raise KeyboardInterrupt
            return len(made)

    monkeypatch.setattr(session, 'RunSession', Session)
    before = dict(os.environ)
    if fails:
        with pytest.raises(KeyboardInterrupt):
            run.execute(run.Options(seed=1))
    else:
        assert run.execute(run.Options(seed=1)) == 3
    assert made == [(1, None), (2, page), (3, page)][: 2 if fails else 3]
    assert page.stop.call_count == 1
    assert dict(os.environ) == before


def test_a_run_without_a_page_ends_with_its_status(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = Mock(page=None, next_options=None)
    ended.execute.return_value = 5
    monkeypatch.setattr(session, 'RunSession', lambda *_: ended)
    assert run.execute(run.Options()) == 5
