"""Parameters of a numpyro model, one after the other."""

from collections.abc import Callable
from threading import RLock
from typing import Any

from numpyro.primitives import Message, Messenger

Choose = Callable[[str, Any], Any]

_LOCK = RLock()  # handlers of numpyro stand on one stack, which all threads share


def visit(model: Callable[[], object], choose: Choose) -> None:
    """Call a model, in which each parameter takes the value that is chosen for it.

    Args:
        choose: Function (name, distribution) -> value.

    Raises:
        ValueError: the model has other sites than parameters.
    """
    with _LOCK:
        _Chooser(model, choose)()


class _Chooser(Messenger):
    def __init__(self, model: Callable[[], object], choose: Choose):
        super().__init__(model)
        self.choose = choose

    def process_message(self, msg: Message) -> None:
        if msg["type"] == "deterministic":
            return
        plain = msg["type"] == "sample" and msg["value"] is None and msg["scale"] is None
        if not plain or msg["kwargs"]["sample_shape"]:
            raise ValueError(
                f"the model of a prior must have scalar parameters alone, got the {msg['type']} "
                f"{msg.get('name')!r}: a loop of `numpyro.sample` stands for a plate or a shape, a "
                "conditional or truncated distribution for a factor or a scale, a number for a "
                "parameter whose value is set, and what was observed is for `fit`"
            )
        msg["value"], msg["stop"] = self.choose(msg["name"], msg["fn"]), True
