"""What a prediction loads: to import a large library takes longer than to predict a small file, and
takes memory that stays taken."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("pandas", "pyarrow", "geopandas", "sklearn", "matplotlib", "mlflow", "safetensors")

SCRIPT = """
import sys, traceback
from scenenet.cli.app import main

# Who loads the library of GeoPackages: 40 MB, which no earlier stage should have beside it.
asked_by = []

def hook(event, args):
    if event == "import" and args[0] == "pyogrio" and not asked_by:
        asked_by.extend(frame.name for frame in traceback.extract_stack())

sys.addaudithook(hook)
try:
    main({call!r})
except SystemExit as end:
    assert not end.code
print([name for name in {heavy!r} if name in sys.modules])
print(asked_by)
"""


def test_a_prediction_loads_what_it_uses_and_when_it_does(pole_survey, pole_model, tmp_path):
    out = tmp_path / "out"
    call = ["predict", str(pole_survey), "--model", str(pole_model), "--out", str(out)]
    script = SCRIPT.format(call=call, heavy=HEAVY)
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert (out / f"{pole_survey.stem}.gpkg").is_file()
    *_, heavy, asked_by = ran.stdout.splitlines()
    assert heavy == "[]"
    assert "'write_geopackage'" in asked_by
