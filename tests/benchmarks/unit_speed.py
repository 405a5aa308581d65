"""How fast exported units run when nothing but the unit takes time: python -m tests.benchmarks.unit_speed [--emps]

A program in C calls the unit of FMI 3.0 as a simulator does, inputs set and a step done at every communication point,
for the recordings and the nine effects of `exported_programs`; calls from Python take longer than the steps. Written is
a table in Markdown: processor time against simulated time, the best of five runs.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from linid.export.target import Exported
from linid.export.targets.fmu.unit import platform_of
from linid.recording.input_course import input_course
from linid.recording.recording import Recording
from tests.benchmarks.exported_programs import RATES, emps, stand, written
from tests.export.compiler import CC

RUNS = 5
DRIVER = r"""
#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
typedef void *unit;
typedef unsigned int ref;
static void *at(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
    return found;
}
int main(int count, char **words)
{
    void *library = dlopen(words[1], RTLD_NOW);
    unit (*make)(const char *, const char *, const char *, bool, bool, bool, bool, const ref *, size_t, void *, void *,
                 void *) = at(library, "fmi3InstantiateCoSimulation");
    int (*enter)(unit, bool, double, double, bool, double) = at(library, "fmi3EnterInitializationMode");
    int (*leave)(unit) = at(library, "fmi3ExitInitializationMode");
    int (*set)(unit, const ref *, size_t, const double *, size_t) = at(library, "fmi3SetFloat64");
    int (*step)(unit, double, double, bool, bool *, bool *, bool *, double *) = at(library, "fmi3DoStep");
    void (*end)(unit) = at(library, "fmi3FreeInstance");
    int inputs = atoi(words[3]), known, run;
    long n, k;
    double h, *u, best = 1e9, reached;
    ref refs[8], starts[8];
    double values[8];
    bool event, over, early;
    FILE *file = fopen(words[4], "r");
    (void)count;
    if (fscanf(file, "%ld %lf %d", &n, &h, &known) != 3)
        return 1;
    for (k = 0; k < inputs; k++)
        if (fscanf(file, "%u", refs + k) != 1)
            return 1;
    for (k = 0; k < known; k++)
        if (fscanf(file, "%u %lf", starts + k, values + k) != 2)
            return 1;
    u = malloc(sizeof *u * (size_t)(n * inputs));
    for (k = 0; k < n * inputs; k++)
        if (fscanf(file, "%lf", u + k) != 1)
            return 1;
    for (run = 0; run < atoi(words[5]); run++) {
        unit one = make("one", words[2], 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
        clock_t begun;
        double spent;
        enter(one, 0, 0.0, 0.0, 0, 0.0);
        set(one, starts, (size_t)known, values, (size_t)known);
        set(one, refs, (size_t)inputs, u, (size_t)inputs);
        leave(one);
        begun = clock();
        for (k = 0; k < n; k++) {
            set(one, refs, (size_t)inputs, u + k * inputs, (size_t)inputs);
            if (step(one, h * k, h, 1, &event, &over, &early, &reached) != 0)
                return 2;
        }
        spent = (double)(clock() - begun) / CLOCKS_PER_SEC;
        best = spent < best ? spent : best;
        end(one);
    }
    printf("%.9g\n", best);
    return 0;
}
"""


def seconds(model: Exported, recording: Recording, folder: Path, rate: int) -> float:
    """Processor seconds that the unit takes for a recording, with communication at a rate in kHz."""
    import fmpy

    course = input_course(recording)
    assert course is not None
    step = 1e-3 / rate
    times = recording.t[0] + step * np.arange(round(recording.duration / step))
    inputs = np.atleast_2d(course(times))
    written(model, "fmu", folder)
    path = folder / f"{model.name}_fmi3.fmu"
    description = fmpy.read_model_description(str(path))
    number = {one.name: one.valueReference for one in description.modelVariables}
    given = [number[one.name] for one in description.modelVariables if one.causality == "input"]
    settings = {"start_position": recording.y[0], "record": recording.number, "elapsed": recording.elapsed}
    head = [f"{times.size} {step!r} {len(settings)}", " ".join(map(str, given))]
    head += [f"{number[name]} {float(value)!r}" for name, value in settings.items()]
    rows = [" ".join(map(repr, map(float, row))) for row in inputs.T]
    (folder / "inputs.txt").write_text("\n".join([*head, *rows]), encoding="utf-8")
    (folder / "driver.c").write_text(DRIVER, encoding="utf-8")
    place, ending = platform_of(3)
    with zipfile.ZipFile(path) as unit:
        library = unit.extract(f"binaries/{place}/{model.name}{ending}", folder)
    subprocess.run([str(CC), "-O1", "-o", "driver", "driver.c", "-ldl"], cwd=folder, check=True)
    token = str(description.instantiationToken)
    command = ["./driver", library, token, str(len(given)), "inputs.txt", str(RUNS)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return float(done.stdout)


def main() -> None:
    """Print the table."""
    print("| recording | " + " | ".join(f"times real time at {rate} kHz" for rate in RATES) + " |")
    print("|---" * (1 + len(RATES)) + "|")
    for model, recording in emps() if "--emps" in sys.argv else stand():
        with tempfile.TemporaryDirectory() as name:
            spent = [seconds(model, recording, Path(name), rate) for rate in RATES]
        factors = " | ".join(f"{recording.duration / one:.0f}" for one in spent)
        print(f"| {recording.name} | {factors} |", flush=True)


if __name__ == "__main__":
    main()
