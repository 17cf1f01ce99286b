"""The programs installed by the package behave like the native ones."""

import os
import signal
import subprocess
import sys
import time

import pytest

from conftest import script, started


def run(name, *arguments, **options):
    return subprocess.run([script(name), *arguments], capture_output=True, text=True, **options)


def test_programs_are_installed(tmp_path):
    for name in ("deltille", "deltag"):
        done = run(name, "--version")
        assert (done.returncode, done.stdout.split()[0], done.stderr) == (0, name, "")
        assert f"Usage: {name}" in run(name, "--help").stdout
    done = run("deltille", "board", "--rows", "4", "--cols", "5", "--name", "a", cwd=tmp_path)
    assert done.returncode == 0 and "verified" in done.stdout and done.stderr == ""
    done = run("deltille", "verify", "a.json", cwd=tmp_path)
    assert done.returncode == 0


def test_errors_have_an_exit_code_and_one_line(tmp_path):
    done = run("deltille", "board", "--rows", "1", "--cols", "5")
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: ")
    (tmp_path / "a.pgm").write_bytes(b"P5 640 480 255\n" + bytes(640 * 480))
    done = run("deltille", "detect", "--grid", "deltille", "a.pgm", cwd=tmp_path)
    assert done.returncode == 1 and "dark" in done.stdout


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
def test_signals_end_the_program_like_the_native_one(tmp_path):
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        command = [script("deltag"), "gen-family", "d36h9", "--time", "60", "--from-scratch", "-o", "a.json"]
        process = started(command, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE)
        time.sleep(3.0)
        start = time.monotonic()
        process.send_signal(number)
        process.communicate(timeout=20)
        assert process.returncode in (0, 128 + number) and time.monotonic() - start < 10
        (tmp_path / "a.json").unlink(missing_ok=True)
    command = [script("deltille"), "detect", "--grid", "deltille", "-"]
    process = started(command, cwd=tmp_path, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(2.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=5) == 130
    process.stdin.close()


@pytest.mark.skipif(os.name == "nt", reason="pipes of Unix")
def test_a_closed_pipe_ends_the_program():
    command = f"'{script('deltag')}' by-rank d36h9 --ranks 0-9999 2>/dev/null | head -1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] in ("0", "141", "2")


def test_programs_start_without_numpy():
    code = "import sys, deltille._programs; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "False"


def test_arguments_that_are_not_text():
    if os.name == "nt":
        pytest.skip("paths of Unix")
    done = subprocess.run([script("deltille"), "detect", b"\xff\xfe.png", "--grid", b"\xff"], capture_output=True)
    assert done.returncode == 2 and b"error" in done.stderr
