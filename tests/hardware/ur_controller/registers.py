"""General purpose registers: the mailbox between client and script."""

REGISTER_COUNT = 48

INPUT_TYPES = {
    "external_force_torque": "VECTOR6D",
    **{f"input_int_register_{i}": "INT32" for i in range(REGISTER_COUNT)},
    **{f"input_double_register_{i}": "DOUBLE" for i in range(REGISTER_COUNT)},
}


class Registers:
    """All that clients write and what the script answers; owned by the controller."""

    def __init__(self):
        self.inputs: dict[str, float | int] = {
            name: 0.0 if kind == "DOUBLE" else 0
            for name, kind in INPUT_TYPES.items()
            if kind != "VECTOR6D"
        }
        self.output_ints = [0] * REGISTER_COUNT
        self.output_doubles = [0.0] * REGISTER_COUNT

    def integer(self, index: int) -> int:
        return int(self.inputs[f"input_int_register_{index}"])

    def doubles(self, first: int, count: int) -> list[float]:
        return [
            float(self.inputs[f"input_double_register_{i}"]) for i in range(first, first + count)
        ]
