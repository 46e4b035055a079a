import struct

import pytest
from ur_controller import fields, wire
from ur_controller.program import take_script
from ur_controller.snapshot import Snapshot

SNAPSHOT = Snapshot(
    time=1.25,
    host=0.0,
    joints=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
    pose=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
    velocity=(0.0,) * 6,
    force=(0.0,) * 6,
    runtime_state=2,
    safety_bits=1,
    robot_bits=3,
    payload=0.5,
    payload_centre=(0.0, 0.0, 0.1),
    output_ints=tuple(range(48)),
    output_doubles=tuple(0.5 * i for i in range(48)),
    resting=True,
)


def test_packages_come_back_whole_however_they_were_cut():
    sent = [wire.Package(86, b"\x00\x02"), wire.Package(118, b""), wire.Package(85, bytes(500))]
    stream = b"".join(wire.pack(*package) for package in sent)
    assert stream[:5] == b"\x00\x05V\x00\x02"
    buffer, seen = bytearray(), []
    for byte in stream:
        buffer.append(byte)
        while (package := wire.take(buffer)) is not None:
            seen.append(package)
    assert seen == sent
    assert not buffer


def test_a_size_that_no_package_has_is_an_error():
    with pytest.raises(wire.WireError, match="2 bytes"):
        wire.take(bytearray(b"\x00\x02V"))


def test_every_output_packs_as_its_type_says():
    for name, field in fields.FIELDS.items():
        data = fields.Recipe([field]).pack(SNAPSHOT)
        assert len(data) == wire.layout([field.type]).size, name


def test_a_recipe_keeps_the_client_s_order():
    wanted = ["actual_TCP_pose", "timestamp", "output_int_register_2", "output_double_register_47"]
    found = [fields.find(name, (3, 15)) for name in wanted]
    data = fields.Recipe([field for field in found if field is not None]).pack(SNAPSHOT)
    assert struct.unpack(">B6ddid", data) == (1, *SNAPSHOT.pose, 1.25, 2, 23.5)


def test_fields_depend_on_the_controller():
    assert fields.find("payload_cog", (3, 15)) is not None
    assert fields.find("payload_cog", (5, 5)) is None
    assert fields.find("payload_cog", (5, 11)) is not None
    assert fields.find("no_such_field", (5, 11)) is None


def test_scripts_come_whole_and_one_after_the_other():
    text = b"def rtde_control():\n# int register offset\n24\n    thread x():\n    end\nend\n"
    buffer = bytearray(text[:40])
    assert take_script(buffer) is None
    buffer += text[40:] + b"def other():\nend\nrest"
    assert take_script(buffer) == text.decode()
    assert take_script(buffer) == "def other():\nend\n"
    assert bytes(buffer) == b"rest"
