"""A co-simulation host that knows FMPy and nothing of this project: jobs.json -> answers.npz.

A job has `settings` (strings), `start` (reals before initialisation ends), `time` (communication
points), `inputs` (name -> one value per communication point; value k acts over the step that ends
at point k) and `outputs` (names).  An answer has `values` (points, outputs) or `error`.
"""

import json
import sys
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave


def run(description, folder, job):
    references = {v.name: v.valueReference for v in description.modelVariables}
    instance = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="robot",
    )
    instance.instantiate(loggingOn=job.get("logging", False))
    try:
        time = job["time"]
        instance.setupExperiment(tolerance=job.get("tolerance"), startTime=time[0])
        for name, value in job.get("settings", {}).items():
            instance.setString([references[name]], [value])
        instance.enterInitializationMode()
        start = job.get("start", {})
        if start:
            instance.setReal([references[name] for name in start], list(start.values()))
        inputs = [references[name] for name in job.get("inputs", {})]
        series = np.array(list(job.get("inputs", {}).values())).T
        if inputs:
            instance.setReal(inputs, series[0].tolist())
        instance.exitInitializationMode()
        outputs = [references[name] for name in job["outputs"]]
        rows = [instance.getReal(outputs)]
        for k in range(1, len(time)):
            if inputs:
                instance.setReal(inputs, series[k].tolist())
            instance.doStep(time[k - 1], time[k] - time[k - 1])
            rows.append(instance.getReal(outputs))
        instance.terminate()
        return {"values": np.array(rows)}
    except Exception as error:  # the test reads which
        return {"error": np.array(str(error))}
    finally:
        instance.freeInstance()


def main(order_file, answer_file):
    order = json.loads(Path(order_file).read_text())
    description = fmpy.read_model_description(order["fmu"])
    folder = fmpy.extract(order["fmu"])
    # The FMU needs numpy, scipy and pin on its host, nothing else of the desk's.
    for desk_only in ("pydantic", "typer", "rich", "plotly", "tomli_w"):
        sys.modules[desk_only] = None
    assert not any(name.startswith(("elastic_robot", "coupling")) for name in sys.modules)
    answers = [run(description, folder, job) for job in order["jobs"]]
    if Path(folder, "resources", "elastic_robot").exists():  # an FMU in Python
        answered_by = Path(sys.modules["elastic_robot"].__file__)
        assert Path(folder).resolve() in answered_by.resolve().parents, answered_by
    else:
        assert "elastic_robot" not in sys.modules
    np.savez(
        answer_file,
        **{
            f"{k}|{name}": value
            for k, answer in enumerate(answers)
            for name, value in answer.items()
        },
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
