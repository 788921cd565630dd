"""Jobs from a file, in a process that has not imported the project: jobs.py FMU JOBS ANSWERS.

A job has `settings` (strings), `start` (reals before initialisation ends), `time` (communication
points), `inputs` (name -> one value per communication point; value k acts over the step that ends
at point k) and `outputs` (names).  An answer has `values` (points, outputs) or `error`.
"""

import json
import sys
from pathlib import Path

import numpy as np
from fmu import Fmu


def run(instance, job):
    """Run a job on an instance that is new, or as new after a reset."""
    time, inputs = job["time"], job.get("inputs", {})

    def acting(k):
        return {name: values[k] for name, values in inputs.items()}

    try:
        start = {**job.get("start", {}), **acting(0)}
        settings = job.get("settings", {})
        instance.start(time[0], job.get("tolerance"), settings, posture={}, **start)
        rows = [instance.get(job["outputs"])]
        for k in range(1, len(time)):
            if inputs:
                instance.set(acting(k))
            instance.slave.doStep(time[k - 1], time[k] - time[k - 1])
            rows.append(instance.get(job["outputs"]))
        instance.slave.terminate()
        return {"values": np.array(rows)}
    except Exception as error:  # the test reads which
        return {"error": np.array(str(error))}
    finally:
        instance.slave.reset()


def main(file, order_file, answer_file):
    fmu = Fmu(file)
    # The FMU needs numpy, scipy and pin on its host, nothing else of the desk's.
    for desk_only in ("pydantic", "typer", "rich", "plotly", "tomlkit"):
        sys.modules[desk_only] = None
    assert not any(name.startswith(("elastic_robot", "coupling")) for name in sys.modules)
    instances = {logging: fmu.instance(logging=logging) for logging in (False, True)}
    jobs = json.loads(Path(order_file).read_text())
    answers = [run(instances[job.get("logging", False)], job) for job in jobs]
    for instance in instances.values():
        instance.free()
    folder = Path(fmu.folder)
    if Path(folder, "resources", "elastic_robot").exists():  # an FMU in Python
        answered_by = Path(sys.modules["elastic_robot"].__file__)
        assert folder.resolve() in answered_by.resolve().parents, answered_by
    else:
        assert "elastic_robot" not in sys.modules
    named = enumerate(answers)
    np.savez(answer_file, **{f"{k}|{name}": v for k, a in named for name, v in a.items()})


if __name__ == "__main__":
    main(*sys.argv[1:])
