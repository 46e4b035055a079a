"""Where a fresh process's first results come from: seconds of each phase, and what JAX compiled.

    first_result.py own [--surrogate signal|discrepancy] [--sampler nuts|emcee] [--parameters 1|4]
    first_result.py demo

`own` fits and samples README's own simulator, twice; `demo` calibrates, criticises and pours on the
demo's recordings. `--cache DIR` keeps JAX's compilations there; without it the cache is empty.
"""

import argparse
import os
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files

COUNTED = {
    "/jax/core/compile/jaxpr_trace_duration": "traced",
    "/jax/core/compile/jaxpr_to_mlir_module_duration": "lowered",
    "/jax/core/compile/backend_compile_duration": "compiled",
}
HIT = "/jax/compilation_cache/cache_hits"
counts: dict[str, Counter[str]] = defaultdict(Counter)
seconds: Counter[str] = Counter()


@contextmanager
def phase(name: str) -> Iterator[None]:
    began, spent = time.perf_counter(), time.process_time()
    yield
    wall, cpu = time.perf_counter() - began, time.process_time() - spent
    print(f"{name:14} {wall:8.2f} s {cpu:8.2f} CPU s", flush=True)


def listen() -> None:
    import jax

    hits: list[str] = []

    def count(event: str, duration: float, fun_name: str = "?", **_: object) -> None:
        if what := COUNTED.get(event):
            if what == "compiled" and hits:
                hits.clear()
                what = "loaded"  # from the cache
            counts[fun_name.removeprefix("jit_").removeprefix("jit(").rstrip(")")][what] += 1
            seconds[what] += duration

    jax.monitoring.register_event_duration_secs_listener(count)
    jax.monitoring.register_event_listener(
        lambda event, **_: hits.append(event) if event == HIT else None
    )


def own(given: argparse.Namespace) -> None:
    with phase("import"):
        listen()
        import numpy as np
        import numpyro.distributions as dist

        from bolfi_liquids import inference

    points = np.linspace(0.0, 5.0, 50)

    def simulate(theta, seeds):
        decay, high, low, slope = (
            np.asarray(theta.get(name, usual))[..., None]
            for name, usual in (("decay", 2.0), ("high", 1.0), ("low", 0.0), ("slope", 0.0))
        )
        noise = [np.random.default_rng(seed).normal(0.0, 0.05, points.size) for seed in seeds]
        return low + high * np.exp(-points / decay) + slope * points + noise

    priors = {
        "decay": dist.LogUniform(0.1, 10.0),
        "high": dist.Uniform(0.5, 2.0),
        "low": dist.Uniform(-0.5, 0.5),
        "slope": dist.Uniform(-0.1, 0.1),
    }
    prior = inference.Prior(dict(list(priors.items())[: given.parameters]))
    observed = simulate({}, [123])[0]
    noise = {"noise": 0} if given.surrogate == "signal" else {}
    for turn, seed in (("", 0), ("second ", 1)):
        with phase(f"{turn}fit"):
            fit = inference.fit(
                simulate,
                prior,
                observed,
                budget=20,
                seed=seed,
                surrogate=given.surrogate,
                progress=False,
                warn=False,
                **noise,
            )
        with phase(f"{turn}sample"):
            fit.sample(given.sampler, chains=4, draws=1000, seed=seed)


def demo(_: argparse.Namespace) -> None:
    with phase("import"):
        listen()
        import bolfi_liquids as bl
    from bolfi_liquids.demo import CLEAN, HELD_OUT, POURS, RECORDING

    data = files("bolfi_liquids.data")
    with tempfile.TemporaryDirectory() as out:
        with phase("calibrate"):
            fitted = bl.calibrate(str(data / RECORDING), out=out, resume=True, progress=False)
        with phase("criticise"):
            others = {"held_out": str(data / HELD_OUT), "baseline": str(data / CLEAN)}
            found = bl.criticise(fitted, **others, progress=False)
        with phase("pour"):
            bl.choose_pour(found, budget=POURS, progress=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("own", "demo"))
    parser.add_argument("--surrogate", choices=("signal", "discrepancy"), default="signal")
    parser.add_argument("--sampler", choices=("nuts", "emcee"), default="nuts")
    parser.add_argument("--parameters", type=int, choices=(1, 4), default=1)
    parser.add_argument("--cache")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as empty:
        os.environ["JAX_COMPILATION_CACHE_DIR"] = given.cache or empty
        os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
        {"own": own, "demo": demo}[given.what](given)
    kinds = (*COUNTED.values(), "loaded")
    print(f"{'function':40}", *(f"{kind:>9}" for kind in kinds))
    total = sum(counts.values(), Counter())
    rows = sorted(counts.items(), key=lambda row: (-row[1].total(), row[0]))
    for name, of in (*rows, ("all", total), ("seconds", seconds)):
        print(f"{name:40.40}", *(f"{of[kind]:9.4g}" for kind in kinds))


if __name__ == "__main__":
    main()
