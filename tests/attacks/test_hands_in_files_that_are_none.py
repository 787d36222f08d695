"""Attack 31: files that are not UTF-8, 50 MB, empty, broken, missing, extra, doubled, links, devices.

Defence: one clear message each; the other tasks are graded.
"""

import os
import time

from attacking import BYSTANDER, SOLUTION, TASKS, honest, valid, write


def test_each_has_one_message(attack):
    files = {
        "collision.py": b"\xff\xfe\x00not text",
        "stress.py": b"#" * 50_000_000,
        "strain_energy.py": "",
        "stiffness.py": "def broken(:\n",
        "shape_functions.py": "\0" * 100,
        "extra.py": "print(1)",
    }
    spoiled = tuple(name for name, task in TASKS.items() if task.file in files)
    record = attack(files, spoils=spoiled, instead_of={})
    assert {record[name].status for name in spoiled} == {"error"}
    for name, words in {"sphere_contact": "not UTF-8", "dpsi_dF": "larger than", "psi": "has no function",
                        "eigensystem": "line 1", "phi": "null bytes", "dn_dx": "is missing"}.items():  # fmt: skip
        assert words in record[name].message, record[name].message


def test_links_pipes_folders_and_doubles(attack, tmp_path):
    folder = write(
        tmp_path / "odd",
        {"a/stress.py": honest("stress.py"), "b/stress.py": honest("stress.py") + "# other\n"},
    )
    (folder / "collision.py").symlink_to(SOLUTION / "collision.py")
    os.mkfifo(folder / "stiffness.py")
    (folder / "strain_energy.py").mkdir()
    (folder / "Shape_Functions.py").write_text(honest("shape_functions.py"))
    (folder / "loop").symlink_to(folder)
    (folder / BYSTANDER).write_text(honest(BYSTANDER))
    link = tmp_path / "link"
    link.symlink_to(folder)
    began = time.monotonic()
    record = attack.grade(link)
    assert time.monotonic() - began < 60
    valid(record)
    for name, words in {"sphere_contact": "is a link", "eigensystem": "is a link or a device", "psi": "is missing",
                        "dpsi_dF": "There are 2 files"}.items():  # fmt: skip
        assert words in record[name].message, record[name].message
    assert record["phi"].status == "passed", "the one file of nearly the right name is taken"
    assert record["mass_block"].status == "passed"


def test_a_function_python_cannot_read_costs_only_itself(attack):
    text = honest()
    line = next(k for k, row in enumerate(text.split("\n"), 1) if row.startswith("def sphere_contact")) + 1
    broken = text.replace("def sphere_contact(x, c, r):\n", "def sphere_contact(x, c, r):\n    d = 2 x\n")
    record = attack({"collision.py": broken}, spoils=("sphere_contact",))
    assert record["sphere_contact"].status == "error"
    assert f"line {line}: Python cannot read this" in record["sphere_contact"].message
    assert record["filter_velocity"].status == "passed"
