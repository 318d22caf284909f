"""Scratch folders: removed with their process, or at the next start after a kill."""

import signal
import subprocess
import sys
import textwrap

import pytest

from scenenet.core.errors import OutputError
from scenenet.core.files import atomic
from scenenet.core.scratch import PREFIX, scratch_folder


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    return folder


def killed(program):
    """Run a program that prints a line when it is ready, and kill it there."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()


HOLD_FOLDER = """
    import time
    from scenenet.core.scratch import scratch_folder
    with scratch_folder() as folder:
        (folder / "spool").write_bytes(b"x")
        print("ready", flush=True)
        time.sleep(60)
"""


def test_a_scratch_folder_is_empty_and_goes_at_the_end(temporary):
    with scratch_folder() as folder:
        assert temporary in folder.parents
        assert list(folder.iterdir()) == []
        (folder / "spool").touch()
    assert list(temporary.iterdir()) == []


def test_the_folder_of_a_killed_process_goes_at_the_next_start(temporary):
    killed(HOLD_FOLDER)
    assert len(list(temporary.iterdir())) == 1
    with scratch_folder():
        assert len(list(temporary.iterdir())) == 1
    assert list(temporary.iterdir()) == []


def test_the_folder_of_a_live_process_stays(temporary):
    with scratch_folder() as first, scratch_folder() as second:
        assert first.is_dir()
        assert second.is_dir()


def test_a_folder_without_a_lock_is_not_ours(temporary):
    other = temporary / f"{PREFIX}abcdefgh"
    other.mkdir()
    with scratch_folder():
        pass
    assert other.is_dir()


def test_what_a_killed_writer_left_goes_when_the_file_is_written_next(tmp_path):
    target = tmp_path / "result.json"
    killed(f"""
        import time
        from scenenet.core.files import atomic
        with atomic({str(target)!r}) as partial:
            partial.write_text("half")
            print("ready", flush=True)
            time.sleep(60)
    """)
    assert [path.name.startswith(".result.json.") for path in tmp_path.iterdir()] == [True]
    with atomic(target) as partial:
        partial.write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["result.json"]


def test_a_missing_tmpdir_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path / "missing"))
    with pytest.raises(OutputError, match="missing: TMPDIR names this directory"), scratch_folder():
        pass


def test_a_scratch_folder_that_was_removed_meanwhile_is_named(temporary):
    message = "temporary files cannot be written: its folder was removed"
    with pytest.raises(OutputError, match=message), scratch_folder() as folder:
        (folder.parent / ".lock").unlink()
        folder.rmdir()
        folder.parent.rmdir()
        (folder / "spool").write_bytes(b"x")


def test_an_error_about_another_file_passes_unchanged(temporary, tmp_path):
    with pytest.raises(FileNotFoundError), scratch_folder():
        (tmp_path / "survey.laz").stat()
