"""Attack 30: a submission whose name, file names, docstrings and messages carry HTML, scripts, formulas and ANSI.

Defence: every view escapes all text; cells never start a formula.
"""

import csv
import io
import os
from pathlib import Path
from xml.etree import ElementTree

from attacking import TARGET, honest, write

from muslin.grading import views

NAME = "=cmd|' !A0 <script>alert(1)</script> \x1b[2J ]]> ::error::x"
HOSTILE = """
raise ValueError("</script><script>alert('muslin')</script><img src=x onerror=alert(2)> =1+1 \\x1b[2J ]]>")
"""


def test_no_view_lets_it_through(attack, tmp_path):
    files = {
        TARGET: HOSTILE + honest(),
        "a<script>alert(3)</script>.py": "",
        "\udcff\udcfe.py".encode("utf-8", "surrogateescape").decode("latin-1"): "",
    }
    record = attack(files)
    folder = write(tmp_path / NAME.replace("/", "|"), {TARGET: HOSTILE})
    (Path(os.fsdecode(os.fsencode(folder) + b"/\xff\xfe.py"))).write_text("")  # a name that is no UTF-8
    for graded in (record, attack.grade(folder)):
        assert "<script>alert" not in views.render(graded, "html")
        assert "<img src=x" not in views.render(graded, "html")
        ElementTree.fromstring(views.render(graded, "junit"))
        cells = [c for row in csv.reader(io.StringIO(views.render(graded, "csv"))) for c in row]
        assert not [cell for cell in cells if cell[:1] in tuple("=+-@\t\r")]
        for name in views.FORMATS:
            assert "\x1b[2J" not in views.render(graded, name)
            views.write(graded, name, tmp_path / "out")
