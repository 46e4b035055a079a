"""`pytest tests/extensions --family your_module:YourFamily` checks a surrogate of your own."""


def pytest_addoption(parser):
    parser.addoption("--family", default="", help="module:Class, a `Family` without arguments")
