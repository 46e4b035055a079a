"""Options that name extensions of your own: each contract's tests take them beside ours."""


def pytest_addoption(parser):
    parser.addoption("--family", default="", help="module:Class, a `Family` without arguments")
    parser.addoption("--rule", default="", help="module:Class, an acquisition without arguments")
    parser.addoption("--effect", default="", help="module:NAME, a `models.Effect`")
