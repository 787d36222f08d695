"""Beyond the table: a record that claims walls which this machine does not have.

Defence: a first worker tries each as a submission would. Here the kernel's filters are switched off, as on an older
system, and everything they alone gave is gone from the record.
"""

import os

from muslin.grading import fork_server, sandbox

BY_FILTERS = {"no other processes or programs", "nothing shared between workers", "memory limit"}
BY_FILTERS_OR_A_SPACE = {"no network", "no signals to others", "solution and hidden data out of sight"}
ALWAYS = {"deadlines from outside", "left-over processes killed", "file size limit"}


def _given(name):
    with sandbox.Sandbox(name) as opened:
        defences = opened.safety.defences
    return {name for name, there in defences.items() if there}, set(defences)


def test_a_record_claims_what_a_worker_has_tried(level, monkeypatch):
    given, known = _given(level)
    assert known == BY_FILTERS | BY_FILTERS_OR_A_SPACE | ALWAYS | {
        "own user", "own disk", "own process space", "process and thread limit",
    }  # fmt: skip
    assert given >= ALWAYS
    assert ("own user" in given) == (level != "process" and os.geteuid() == 0)
    assert ("own process space" in given) == ("own disk" in given) == (level == "namespace")
    monkeypatch.setattr(fork_server, "FILTERS", False)
    bare, _ = _given(level)
    assert bare >= ALWAYS
    assert not bare & BY_FILTERS
    if level != "namespace":
        assert not bare & BY_FILTERS_OR_A_SPACE
    assert bare <= given
