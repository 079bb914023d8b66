# SPDX-License-Identifier: MIT
"""Memory for eight channels in a window of a large MDF 4 file; fails above 500 MB.

Run with `python benchmarks/large_mdf.py [GIGABYTES]`; the stated limit is for 2 GB, the default is
a file of 0.3 GB, because writing takes longer than reading.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import asammdf
import numpy as np

from drivetwin.logs.formats import open_recording

LIMIT = 500e6
CHANNELS, BLOCK, STEP = 58, 200_000, 1e-3
RECORD = 8 + 4 * CHANNELS
WANTED, WINDOW = range(3, 11), (100.0, 120.0)


def write(path: Path, gigabytes: float) -> None:
    """A file of 58 channels at 1 kHz, written block by block."""
    with asammdf.MDF(version="4.10") as mdf:
        for block in range(max(1, round(gigabytes * 1e9 / (BLOCK * RECORD)))):
            time = (block * BLOCK + np.arange(BLOCK)) * STEP
            values = [np.sin(time + k).astype(np.float32) for k in range(CHANNELS)]
            if block:
                mdf.extend(0, [(time, None), *((one, None) for one in values)])
                continue
            mdf.append(
                [
                    asammdf.Signal(samples=one, timestamps=time, name=f"ch{k}", unit="Nm")
                    for k, one in enumerate(values)
                ]
            )
        mdf.save(path, overwrite=True)


def read(path: Path) -> int:
    """Read channels in a window and print the most memory that it took; 1 above the limit."""
    with open_recording(path) as recording:
        samples = sum(recording.load(index, WINDOW).time.size for index in WANTED)
    most = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    size = path.stat().st_size
    print(f"{samples} samples of a {size / 1e9:.2f} GB file: {most / 1e6:.0f} MB, limit 500 MB")
    return int(most > LIMIT)


def main() -> int:
    """Write the file and read it in a process of its own, whose memory is only the reader's."""
    if sys.argv[1:2] == ["--read"]:
        return read(Path(sys.argv[2]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.mf4"
        write(path, float(sys.argv[1]) if len(sys.argv) > 1 else 0.3)
        return subprocess.run(
            [sys.executable, __file__, "--read", str(path)], check=False
        ).returncode


if __name__ == "__main__":
    sys.exit(main())
