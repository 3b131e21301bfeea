"""Delete folders of plugins/ in a clone, and see that the rest stands: `without.py [PLUGIN...]`, or all.

Linters, docs and the tests of the core run there, and those of the plug-ins that are left are imported.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
LIMIT: Final = 45 * 60.0
"""The longest that a step may take, in s."""
STEPS: Final = (
    ("make", "--no-print-directory", "lint"),
    ("make", "--no-print-directory", "docs"),
    (".venv/bin/python", "-m", "pytest", "-q", "-n", "logical", "--dist", "worksteal", "tests"),
    (".venv/bin/python", "-m", "pytest", "-q", "--collect-only", "plugins"),
)


def main(*plug_ins: str) -> int:
    """Run the steps without some plug-ins; return 1 if one failed."""
    there = sorted(path.parent.name for path in ROOT.glob("plugins/*/pyproject.toml"))
    if unknown := sorted(set(plug_ins) - set(there)):
        print(f"error: no plug-ins {', '.join(unknown)}; there are {', '.join(there)}", file=sys.stderr)
        return 2
    failed = []
    with tempfile.TemporaryDirectory(prefix="without-") as name:
        clone = Path(name) / "visualhfsm"
        subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True, timeout=LIMIT)
        for plug_in in plug_ins or there:
            shutil.rmtree(clone / "plugins" / plug_in)
        for step in STEPS:
            print(f"without {', '.join(plug_ins) or 'any plug-in'}: {' '.join(step)}", flush=True)
            done = subprocess.run(step, cwd=clone, check=False, timeout=LIMIT)
            if done.returncode and not (step[-1] == "plugins" and done.returncode == 5):  # there is none left
                failed.append(" ".join(step))
    for each in failed:
        print(f"failed: {each}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
