"""Options that name extensions of your own: each contract's tests take them beside ours."""

OPTIONS = {
    "family": "module:Class, a surrogate's `Family` without arguments",
    "rule": "module:Class, an acquisition without arguments",
    "effect": "module:NAME, a `models.Effect`",
    "camera": "module:Class, a `FrameSource` that is called with a camera's section of a rig",
    "arm": "module:Class, a `Controller` that is called with joints at the start and a clock",
}


def pytest_addoption(parser):
    for name, what in OPTIONS.items():
        parser.addoption(f"--{name}", default="", help=what)
