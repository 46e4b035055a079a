"""The guide's examples of noise run as they are printed."""

import re
from importlib.resources import files

from bolfi_liquids import inference

PAGE = (files("bolfi_liquids.guide") / "simulator.md").read_text(encoding="utf-8")
SECTION = re.search(r"^## Noise$(.*?)^## ", PAGE, re.MULTILINE | re.DOTALL)[1]


def test_its_examples_run():
    names, fits = {}, []
    for block in re.findall(r"```python\n(.*?)```", SECTION, re.DOTALL):
        exec(compile(block, "simulator.md", "exec"), names)
        fits.append(names["fit"])
    assert len(fits) == 2
    for fit in fits:
        assert isinstance(fit, inference.Fit)
        assert 1.0 < fit.best["start"] < 6.0
