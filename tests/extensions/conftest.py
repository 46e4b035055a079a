"""`pytest tests/extensions --family your_module:YourFamily` checks a surrogate of your own.

`--camera module:YourCamera` does so for a camera, `--arm module:YourController` for an arm.
"""


def pytest_addoption(parser):
    parser.addoption("--family", default="", help="module:Class, a `Family` without arguments")
    parser.addoption(
        "--camera",
        default="",
        help="module:Class, a `FrameSource` that is called with a camera's section of a rig",
    )
    parser.addoption(
        "--arm",
        default="",
        help="module:Class, a `Controller` that is called with joints at the start and a clock",
    )
