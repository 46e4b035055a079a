"""General purpose registers, the mailbox between client and script, and inputs of the I/O."""

REGISTER_COUNT = 48

INPUT_TYPES = {
    "speed_slider_mask": "UINT32",
    "speed_slider_fraction": "DOUBLE",
    "standard_digital_output_mask": "UINT8",
    "standard_digital_output": "UINT8",
    "configurable_digital_output_mask": "UINT8",
    "configurable_digital_output": "UINT8",
    "tool_digital_output_mask": "UINT8",
    "tool_digital_output": "UINT8",
    "standard_analog_output_mask": "UINT8",
    "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE",
    "standard_analog_output_1": "DOUBLE",
    "external_force_torque": "VECTOR6D",
    **{f"input_int_register_{i}": "INT32" for i in range(REGISTER_COUNT)},
    **{f"input_double_register_{i}": "DOUBLE" for i in range(REGISTER_COUNT)},
}

# digital outputs of `actual_digital_output_bits`: standard, configurable, tool
_BITS = {"standard": 0, "configurable": 8, "tool": 16}


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
        self.digital_outputs = 0
        self.analog_outputs = [0.0, 0.0]
        self.slider = 1.0

    def write(self, values: dict[str, float | int]) -> None:
        """Take over one data package of a client."""
        self.inputs.update(values)
        if values.get("speed_slider_mask"):
            self.slider = min(1.0, max(0.0, float(values["speed_slider_fraction"])))
        for name, shift in _BITS.items():
            mask = int(values.get(f"{name}_digital_output_mask", 0)) << shift
            level = int(values.get(f"{name}_digital_output", 0)) << shift
            self.digital_outputs = (self.digital_outputs & ~mask) | (level & mask)
        for index in range(2):
            if int(values.get("standard_analog_output_mask", 0)) >> index & 1:
                self.analog_outputs[index] = float(values[f"standard_analog_output_{index}"])

    def integer(self, index: int) -> int:
        return int(self.inputs[f"input_int_register_{index}"])

    def doubles(self, first: int, count: int) -> list[float]:
        return [
            float(self.inputs[f"input_double_register_{i}"]) for i in range(first, first + count)
        ]
