"""SQLite files that several processes open at once."""

import sqlite3
import threading

import pytest
from bolfi_liquids.inference.simulations import database


@pytest.fixture
def writer(tmp_path):
    """A connection that has begun to write a file that is not yet in WAL mode."""
    options = {"isolation_level": None, "check_same_thread": False}
    with sqlite3.connect(tmp_path / "bank.sqlite", **options) as connection:
        connection.execute("CREATE TABLE simulation (seed INTEGER)")
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("INSERT INTO simulation VALUES (1)")
        yield connection
    connection.close()


def test_the_mode_changes_when_another_connection_has_written(tmp_path, writer):
    committed = threading.Timer(0.3, writer.execute, ["COMMIT"])
    connection = sqlite3.connect(tmp_path / "bank.sqlite", timeout=60.0)
    committed.start()
    database.write_ahead(connection)
    committed.join()
    assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert connection.execute("SELECT seed FROM simulation").fetchall() == [(1,)]
    connection.close()


def test_a_connection_that_never_ends_its_write_is_told(tmp_path, writer, monkeypatch):
    monkeypatch.setattr(database, "BUSY_MS", 50)
    connection = sqlite3.connect(tmp_path / "bank.sqlite", timeout=60.0)
    with pytest.raises(sqlite3.OperationalError, match="locked"):
        database.write_ahead(connection)
    connection.close()
