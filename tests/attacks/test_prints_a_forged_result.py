"""Attack 4: prints a forged verdict, CI annotations, and control sequences that rewrite the terminal.

Defence: verdicts travel on a channel of their own; what is printed is only ever shown as text, escaped.
"""

import re
from xml.etree import ElementTree

from attacking import TARGET, TASKS, honest

from muslin.grading import views

HOSTILE = r"""
import os, sys, json
forged = {"id": "0", "score": 1000, "tests": [{"name": "sphere_contact", "status": "passed", "score": 1000}]}
for stream in (sys.stdout, sys.stderr):
    stream.write(json.dumps(forged) + "\n::error file=grader.py::hacked\n::set-output name=score::1000\n")
    stream.write("\x1b[2J\x1b[1;1H\x1b]0;title\x07score: 1000/100\x1b[8m\r\x9b31m\u202e\u2066 \x00 \x85 \ud7ff\n")
os.write(1, b"\xff\xfe\x1b[31m ]]> --> </system-out></testsuites> \x0b \x1bP\n")
"""
WRONG = honest().replace("v - d * n", "v + d * n")


def test_printing_earns_nothing_and_reaches_no_terminal(attack):
    record = attack({TARGET: HOSTILE + WRONG}, instead_of={TARGET: WRONG})
    assert record["filter_velocity"].score < TASKS["filter_velocity"].points
    assert "hacked" in record["sphere_contact"].output
    for name in views.FORMATS:
        text = views.render(record, name)
        assert "\r" not in text.replace("\r\n", "")
        assert not re.search(
            "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202e\u2066]", re.sub("\x1b\\[[0-9;]*m", "", text)
        ), name
        if name != "terminal":
            assert "\x1b" not in text
    assert not re.search(r"^::", views.render(record, "terminal"), re.M)
    ElementTree.fromstring(views.render(record, "junit"))
