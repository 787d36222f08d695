"""Attack 27: calls ti.init or ti.reset, changes precision and architecture.

Defence: refused in the worker with a message that names the call; another file's worker is another process.
"""

from attacking import TARGET, honest


def test_init_is_refused_with_its_name(attack):
    record = attack(
        {TARGET: honest().replace("import taichi as ti\n", "import taichi as ti\nti.init(arch=ti.cpu)\n")}
    )
    assert record["sphere_contact"].status == "error"
    assert "ti.init" in record["sphere_contact"].message


def test_init_by_another_door_harms_only_itself(attack):
    hostile = """
import taichi.lang.misc as misc
try:
    misc.init(arch=misc.cpu, default_fp=ti.f32, fast_math=True, offline_cache=False)
except BaseException as error:
    print(error)
"""
    record = attack({TARGET: honest().replace("import taichi as ti\n", "import taichi as ti\n" + hostile)})
    assert "init" in record["sphere_contact"].output + record["sphere_contact"].message
