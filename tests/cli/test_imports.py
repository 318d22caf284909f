"""What a prediction loads: to import a large library takes longer than to predict a small file."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("pandas", "pyarrow", "geopandas", "sklearn", "matplotlib", "mlflow", "safetensors")


def test_a_prediction_loads_no_library_that_it_does_not_use(pole_survey, pole_model, tmp_path):
    out = tmp_path / "out"
    call = ["predict", str(pole_survey), "--model", str(pole_model), "--out", str(out)]
    script = (
        "import sys\n"
        "from scenenet.cli.app import main\n"
        "try:\n"
        f"    main({call!r})\n"
        "except SystemExit as end:\n"
        "    assert not end.code\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.splitlines()[-1] == "[]"
    assert (out / f"{pole_survey.stem}.gpkg").is_file()
