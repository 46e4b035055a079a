import pytest
from ur_controller import script

CONTROL = """def rtde_control():
    global reg_offset_int = # int register offset
24
    def exec_move_path():
        # inject move path
{}    end
    thread x():
    end
end
"""


def test_scripts_come_whole_and_one_after_the_other():
    text = CONTROL.format("").encode()
    buffer = bytearray(text[:100])
    assert script.take(buffer) is None
    buffer += text[100:] + b"def other():\nend\nrest"
    assert script.take(buffer) == text.decode()
    assert script.take(buffer) == "def other():\nend\n"
    assert bytes(buffer) == b"rest"


def test_a_path_is_read_from_the_script():
    path = (
        "\tsignal_async_progress(0)\n\tmovel(p[0.1,-2e-05,0.3,0,0,0],a=1.5,v=0.25,r=0)\n"
        "\tsignal_async_progress(1)\n\tmovej([1,2,3,4,5,6],a=3,v=0.5,r=0.01)\n"
    )
    parsed = script.parse(CONTROL.format(path))
    assert parsed.offset == 24
    assert parsed.path == (
        script.Waypoint("movel", True, (0.1, -2e-05, 0.3, 0, 0, 0), 0.25, 1.5, 0),
        script.Waypoint("movej", False, (1, 2, 3, 4, 5, 6), 0.5, 3.0, 1),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def mine():\n\tmovej([0,0,0,0,0,0])\nend\n", "only ur_rtde's control script"),
        (CONTROL.format("\tmovep(p[0,0,0,0,0,0],a=1,v=1,r=0)\n"), "movep.*not emulated"),
    ],
)
def test_other_scripts_are_refused(text, message):
    with pytest.raises(script.ScriptError, match=message):
        script.parse(text)
