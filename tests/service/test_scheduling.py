"""The service asks for real-time priority where it is permitted, and goes on where it is refused."""

from __future__ import annotations

import errno
import logging
import os
import resource
from collections.abc import Callable

import pytest

from logger.service.systemd_notify import PRIORITY, go_first

Asked = list[tuple[int, int, int]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Callable[[int, int], Asked]:
    """Put a kernel in place, by what it permits and the error with which it refuses all the same; gives what it was
    asked for."""
    def put(permitted: int, refuses: int) -> Asked:
        calls: Asked = []

        def answer(pid: int, policy: int, parameters: os.sched_param) -> None:
            calls.append((pid, policy, parameters.sched_priority))
            if refuses:
                raise OSError(refuses, os.strerror(refuses))
        monkeypatch.setattr(resource, "getrlimit", lambda which: (permitted, permitted))
        monkeypatch.setattr(os, "sched_setscheduler", answer)
        return calls
    return put


@pytest.mark.parametrize("permitted", [PRIORITY, 99, resource.RLIM_INFINITY])
def test_it_is_asked_for_where_it_is_permitted(asked: Callable[[int, int], Asked], permitted: int,
                                               caplog: pytest.LogCaptureFixture) -> None:
    calls = asked(permitted, 0)
    go_first()
    assert calls == [(0, os.SCHED_RR, PRIORITY)]
    assert not caplog.records


@pytest.mark.parametrize("reason", [errno.EPERM, errno.EINVAL])
def test_refused_is_said_and_no_more(asked: Callable[[int, int], Asked], reason: int,
                                     caplog: pytest.LogCaptureFixture) -> None:
    calls = asked(PRIORITY, reason)
    with caplog.at_level(logging.WARNING):
        go_first()
    assert len(calls) == 1
    assert "no real-time priority" in caplog.text


@pytest.mark.parametrize("permitted", [0, PRIORITY - 1])
def test_what_is_not_permitted_is_not_asked_for(asked: Callable[[int, int], Asked], permitted: int,
                                                caplog: pytest.LogCaptureFixture) -> None:
    calls = asked(permitted, 0)
    go_first()
    assert not calls
    assert not caplog.records
