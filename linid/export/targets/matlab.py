"""The target `matlab`: a function file for MATLAB, Simulink's MATLAB Function and Octave, and its parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from linid.export.target import Exported, Target

if TYPE_CHECKING:
    from linid.export.program.build import ModelProgram

_MAIN = """function varargout = @name@(action, varargin)
% @title@
%
% A simulation as linid runs it: @what@. @units@
%
%   p = @name@('parameters')                    parameters as identified, a structure; @name@_parameters.m has units
%   run = @name@('simulate', p, t, inputs, y, v) over times t (1 x n, evenly spaced) with inputs (@count@ x n) from y
%                                               and v: a structure of y (reading), v, friction and thrust, 1 x n each
%   run = @name@('simulate', p, t, inputs, y, v, coefficients, stepping)
%                                               with 16 coefficients per interval (four powers of four inputs) for
%                                               splines; stepping: whether inputs may differ before and after a sample
%   state = @name@('start', p, u, y, v)         step by step: begin under inputs u
%   [state, out] = @name@('step', state, u, h)  hold u for h seconds; out: reading, speed, friction and thrust then
switch action
    case 'parameters'
        varargout{1} = @name@_parameters();
    case 'simulate'
        varargout{1} = simulated(varargin{:});
    case 'start'
        varargout{1} = begun(varargin{:});
    case 'step'
        [varargout{1}, varargout{2}] = stepped(varargin{:});
    otherwise
        error('@name@:action', 'there is no action %s: parameters, simulate, start or step', action);
end
end

function memory = remembered(p)
% What functions work on: parameters, and what a simulation keeps.
memory = p;
for name = {@own@}
    memory.own(end + 1) = p.(name{1});
end
for name = {@state@}
    if ~isfield(memory, name{1})
        memory.(name{1}) = 0;
    end
end
memory.table = zeros(1, @table@);
memory.c = zeros(1, 16);
memory = prepare(memory);
end

function run = simulated(p, t, inputs, y, v, coefficients, stepping)
% A whole recording.
n = numel(t);
dt = (t(end) - t(1)) / (n - 1);
if nargin < 7
    stepping = false;
end
if nargin < 6 || isempty(coefficients)
    coefficients = zeros(4, 4, n - 1);
    for k = 1:size(inputs, 1)
        pieces = spline((0:(n - 1)) * dt, inputs(k, :));
        coefficients(:, k, :) = fliplr(pieces.coefs).';
    end
end
memory = remembered(p);
memory.c = reshape(coefficients, 1, []);
memory.intervals = n - 1;
first = t(1);
substeps = @substeps@;
w = NaN;
[@start_results@] = @start@;
followed = false;
glide_1 = 1; glide_2 = 0.5; glide_3 = 1 / 6; glide_h = 0;
halvings = 0; steps = 0;
out = zeros(4, n);
now = first;
[out(1, 1), out(2, 1), out(3, 1), out(4, 1)] = @outputs@;
for k = 0:(n - 2)
    [@advance_results@] = @advance@;
    now = first + k * dt + dt;
    [out(1, k + 2), out(2, k + 2), out(3, k + 2), out(4, k + 2)] = @outputs@;
end
run = struct('t', t, 'y', out(1, :), 'v', out(2, :), 'friction', out(3, :), 'thrust', out(4, :));
end

function state = begun(p, u, y, v)
% The start, step by step.
memory = remembered(p);
memory.c = zeros(1, 16 * @history@);
for k = 1:numel(u)
    memory.c((0:(@history@ - 1)) * 16 + 4 * (k - 1) + 1) = u(k);
end
memory.intervals = @history@;
first = 0; dt = @step@; substeps = 1; w = NaN;
[@start_results@] = @start@;
followed = false;
glide_1 = 1; glide_2 = 0.5; glide_3 = 1 / 6; glide_h = 0;
halvings = 0; steps = 0;
state = struct('t', 0, 'memory', memory, 'going', {{@going@}});
end

function [state, out] = stepped(state, u, dt)
% A step under held inputs; where inputs act late, all steps must be equal.
memory = state.memory;
[@going@] = state.going{:};
last = zeros(1, 16);
last(4 * (0:(numel(u) - 1)) + 1) = u;
memory.c = [memory.c(17:end), last];
substeps = max(1, ceil(dt / @step@ - 1e-9));
k = @history@ - 1;
first = state.t - k * dt;
stepping = true;
[@advance_results@] = @advance@;
now = state.t + dt;
out = zeros(4, 1);
[out(1), out(2), out(3), out(4)] = @outputs@;
state.t = now;
state.memory = memory;
state.going = {@going@};
end

@functions@
"""
_PARAMETERS = """function p = @name@_parameters()
% Parameters of @name@ as identified, in SI units.
p = struct();
@lines@
% Of a recording: its number, the running time of its campaign at its start (s), mass on the mover besides its own.
p.record = 0;
p.elapsed = 0;
p.added_mass = 0;
p.own = [];
end
"""


def _files(exported: Exported) -> dict[str, bytes]:
    from linid.export.program.build import program_of

    program = program_of(exported)
    slots = (*program.parameters, *program.own)
    lines = "\n".join(f"p.{slot.name} = {slot.value!r}; % {slot.unit}: {slot.meaning or slot.name}" for slot in slots)
    parameters = _PARAMETERS.replace("@lines@", lines).replace("@name@", exported.name)
    return {
        f"{exported.name}.m": _main(exported, program).encode("utf-8"),
        f"{exported.name}_parameters.m": parameters.encode("utf-8"),
    }


def _main(exported: Exported, program: ModelProgram) -> str:
    """The function file."""
    from linid.export.program.build import GOING, HISTORY, MOTION
    from linid.export.program.words import inputs_in_words, title_of, units_of
    from linid.export.translate.writers.octave import OctaveWriter

    writer = OctaveWriter()
    functions = writer.program(list(program.functions))
    known = {"clock_1": "first", "clock_2": "dt", "clock_3": "substeps", "clock_4": repr(program.tolerance)}
    known |= {"start_of_axis_1": "y", "start_of_axis_2": "v", "start_of_axis_3": "w"}
    known |= {"n": "k", "stepping": "stepping", "t": "now"}
    known |= {f"going_{name}" if name not in MOTION else f"going_motion_{name}": name for name in GOING}
    known |= {f"motion_{name}": name for name in MOTION}

    def call(entry: str) -> str:
        function = program.entries[entry]
        return writer.call(function, [known[one.name] for one in function.arguments])

    def results(entry: str, names: tuple[str, ...]) -> str:
        return ", ".join((["memory"] if program.entries[entry].writes else []) + list(names))

    marks = {
        "functions": functions,
        "title": title_of(exported),
        "what": inputs_in_words(exported),
        "units": units_of(exported),
        "count": str(max(len(program.inputs), 1)),
        "own": ", ".join(f"'{slot.name}'" for slot in program.own) or "",
        "state": ", ".join(f"'{name}'" for name in program.state),
        "table": str(program.table),
        "substeps": str(program.substeps),
        "history": str(HISTORY if program.delayed else 1),
        "step": repr(exported.step),
        "start_results": results("start", MOTION),
        "start": call("start"),
        "advance_results": results("advance", GOING),
        "advance": call("advance"),
        "outputs": call("outputs"),
        "going": ", ".join(GOING),
        "name": exported.name,
    }
    text = _MAIN
    for mark, value in marks.items():
        text = text.replace(f"@{mark}@", value)
    return text


TARGET = Target(
    name="matlab",
    purpose="A function file for MATLAB, Simulink and Octave with a parameter structure, of the whole model.",
    files=_files,
)
