"""Draw scene.html in a Chromium without a window: python3 scene.py LIBRARY [ARGUMENT].

LIBRARY is the renderer's JavaScript. Writes picture.ppm, 16 bit, top row first: the page's red values.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

library, argument = Path(sys.argv[1]).resolve(), sys.argv[2] if len(sys.argv) > 2 else "0"
browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
text = Path(__file__).with_name("scene.html").read_text("utf-8")
page = Path("page.html").resolve()
page.write_text(text.replace("LIBRARY", library.as_uri()).replace("ARGUMENT", argument), "utf-8")
words = ["--headless=new", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
words += ["--allow-file-access-from-files", "--dump-dom", "--virtual-time-budget=60000", "--log-level=3"]
words += ["--disable-dev-shm-usage"]
words += ["--no-sandbox"] if os.geteuid() == 0 else []  # Chromium's sandbox does not work for root
with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
    shown = subprocess.run(
        [browser, *words, f"--user-data-dir={profile}", page.as_uri()], stdout=subprocess.PIPE, text=True, check=True
    ).stdout
found = re.search("PIXELS ([0-9 ]*) END", shown)
if found is None:
    sys.exit(f"the page drew nothing: {shown}")
side, *values = map(int, found[1].split())
rows = [values[row * side : (row + 1) * side] for row in reversed(range(side))]
data = b"".join((value * 257).to_bytes(2, "big") * 3 for row in rows for value in row)
Path("picture.ppm").write_bytes(f"P6 {side} {side} 65535\n".encode() + data)
middle = rows[side // 2][side // 2] / 255
print(f"DEFECT the floor is {middle:.4f}; see README.md for what is expected")
