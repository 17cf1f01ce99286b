"""The Python example of the README runs unchanged."""

import re
import subprocess
import sys


def test_the_quickstart_has_twelve_lines_and_runs(root, tmp_path):
    [code] = re.findall(r"```python\n(.*?)```", (root / "README.md").read_text(), re.S)
    lines = [line for line in code.splitlines() if line.strip()]
    assert len(lines) <= 12
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Pose(" in done.stdout and (tmp_path / "desk/desk.pdf").exists()
