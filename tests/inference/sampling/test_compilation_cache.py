"""What JAX compiles is kept for the next process."""

import os
import subprocess
import sys

import pytest

COMPILING = """
import jax, jax.numpy as jnp
from bolfi_liquids.inference.sampling.compilation_cache import kept_compilations
hits = []
jax.monitoring.register_event_listener(lambda event, **_: hits.append(event))
settings = "jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs"
before = [getattr(jax.config, name) for name in settings]
jax.jit(lambda x: x + 1)(1)  # JAX has looked at its settings
with kept_compilations():
    print(float(jax.jit(lambda x: jnp.sin(x).sum())(jnp.arange(5.0))))
print(hits.count("/jax/compilation_cache/cache_hits"))
assert [getattr(jax.config, name) for name in settings] == before
jax.jit(lambda x: x + 2)(1)
"""


def elsewhere(home):
    """An environment in which nothing was compiled yet."""
    return {k: v for k, v in os.environ.items() if "CACHE" not in k} | {"HOME": str(home)}


def compiled(home, **environment):
    """What is computed, and how many compilations were found."""
    own = elsewhere(home) | environment
    run = subprocess.run(
        [sys.executable, "-c", COMPILING], env=own, capture_output=True, text=True, check=True
    )
    assert run.stderr == ""
    value, hits = run.stdout.split()
    return value, int(hits)


def test_the_next_command_finds_what_was_compiled_within_and_nothing_else(tmp_path):
    first, none = compiled(tmp_path)
    kept = list(tmp_path.rglob("*-cache"))
    assert (none, len(kept) > 0) == (0, True)
    assert compiled(tmp_path) == (first, len(kept))


def test_the_environment_has_the_last_word(tmp_path):
    chosen = tmp_path / "chosen"
    places = {
        "JAX_COMPILATION_CACHE_DIR": str(chosen),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
    compiled(tmp_path / "home", **places)
    assert list(chosen.iterdir())
    assert not (tmp_path / "home").exists()


@pytest.mark.slow
@pytest.mark.parametrize("home", ["a file", "cut short"])
def test_a_cache_that_cannot_be_used_is_done_without(tmp_path, home):
    usual, _ = compiled(tmp_path / "usual")
    if home == "a file":
        (tmp_path / home).touch()
    else:
        compiled(tmp_path / home)
        for entry in (tmp_path / home).rglob("*-cache"):
            entry.write_bytes(entry.read_bytes()[:20])
    # without a home directory that of temporary files takes the cache
    value, found = compiled(tmp_path / home, TMPDIR=str(tmp_path))
    assert (value, found) == (usual, 0)
