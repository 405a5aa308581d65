"""The Modelica of an exported model around its own functions; words between two @ are put in by `target.py`."""

PACKAGE = """package @name@ @title@
  // @what@. @units@
  // Axis is a block that samples its inputs; simulate goes through a whole recording, whose inputs are cubics.

  constant Integer INPUTS = @count@ "Inputs; one that is always 0 where there is none";
  constant Real TOLERANCE = @tolerance@ "Share of friction by which an internal step may be off";
  constant Real infinite = 1e60 "Of a time at which nothing happens";
  constant Real unknown = 1e90 "In place of a number that is not given";
@places@

@block@

@driver@

@example@

  package Core "The functions of the simulation"
@functions@
  end Core;
  annotation(Documentation(info = @about@));
end @name@;
"""

ABOUT = """<p>@title_html@</p><p>@what@. @units@ Written by linid from the functions of its own simulation: a discrete
model, whose steps are exact for the equations linearised in their middle, and halved where the bristle is quick. It
needs no other library.</p>"""

BLOCK = """  block Axis "The axis between sampled inputs and sampled outputs"
@inputs@
    output Real position(unit = "@way@") "Reading of the position";
    output Real speed(unit = "@way@/s") "Speed";
    output Real friction_force(unit = "@force@") "Friction";
    output Real thrust(unit = "@force@") "Force of the motor";
    parameter Real period(unit = "s") = @period@ "Time between two samples";
    parameter Real internal_step(unit = "s") = @step@ "Longest internal step";
    parameter Integer input_order(min = 0, max = 2) = @order@ "Inputs after a sample: 0 held, 1 line, 2 parabola";
    parameter Integer remembered(min = 1) = @remembered@ "Samples of inputs that are kept, as some act late";
    parameter Real start_time(unit = "s") = 0.0 "Time of the first sample";
    parameter Real start_position(unit = "@way@") = 0.0 "Position then";
    parameter Real start_speed(unit = "@way@/s") = 0.0 "Speed then";
    parameter Real recording(unit = "1") = 0.0 "Number of the recording in its campaign, for what acts in single ones";
    parameter Real elapsed(unit = "s") = 0.0 "Running time of the campaign at time 0";
    parameter Real added_mass(unit = "@mass@") = 0.0 "Mass on the mover besides its own";
@parameters@
  protected
    final parameter Real parameters[@count_p@] = {@list_p@};@own@@field@
    discrete Real memory[@memory@] "What the axis remembers";
    discrete Real past[remembered + 2, INPUTS] "Inputs at the last samples, the newest below";
  initial equation
    pre(past) = fill_rows({@list_inputs@}, remembered + 2);
    pre(memory) = begin(@given@, courses(pre(past), period, 0, 0), start_time, period, 1, {start_position, start_speed,
      unknown}, {recording, elapsed, added_mass});
  equation
    when sample(start_time + period, period) then
      memory = step(@given_field@, pre(memory), pre(past), period, internal_step, input_order);
      past = pushed(pre(past), {@list_inputs@});
    end when;
    (position, speed, friction_force, thrust) = seen(@given_field@, memory);
    assert(abs(position) < infinite, "@name@: the axis is nowhere any more; look at its inputs and parameters");
  end Axis;"""

DRIVER = """  function begin "The memory of an axis that starts"
@take@
    input Real cubics[:] "Of the inputs: four coefficients each of four inputs, per interval";
    input Real t(unit = "s");
    input Real dt(unit = "s") "Of an interval";
    input Integer substeps "Internal steps in it";
    input Real motion[3] "Position, speed, and the bristle's deflection or `unknown`";
    input Real run[3] "Number of the recording, running time of the campaign, added mass";
    output Real memory[@memory@];
  protected
    Real states[@count_s@];@local_field@
  algorithm
    states := zeros(@count_s@);@zero_field@
    @call_prepare@
    states[S_record] := run[1];
    states[S_elapsed] := run[2];
    states[S_added_mass] := run[3];
    states[S_intervals] := div(size(cubics, 1), 16);
    memory := zeros(@memory@);
    @call_start@
    memory[@glide@] := 1.0;
    memory[@glide@ + 1] := 0.5;
    memory[@glide@ + 2] := 1.0 / 6.0;
    memory[T] := t;
    memory[@first_s@:@memory@] := states;
  end begin;

  function next "One interval on: from sample n of the inputs to the next"
@take_field@
    input Real memory_before[@memory@];
    input Real cubics[:];
    input Real t(unit = "s") "At sample 0";
    input Real dt(unit = "s");
    input Integer substeps;
    input Integer n;
    input Boolean stepping "Whether inputs may differ before and after a sample";
    output Real memory[@memory@];
  protected
    Real states[@count_s@];
    Boolean followed;
    Integer halvings;
    Integer steps;
  algorithm
    memory := memory_before;
    states := memory_before[@first_s@:@memory@];
    states[S_intervals] := div(size(cubics, 1), 16);
    @call_advance@
    memory[@followed@] := if followed then 1.0 else 0.0;
    memory[@halvings@] := halvings;
    memory[T] := t + n * dt + dt;
    memory[KNOWN] := memory_before[KNOWN] + 1.0;
    memory[@first_s@:@memory@] := states;
  end next;

  function seen "What is seen of the axis now"
@take_field@
    input Real memory[@memory@];
    output Real position;
    output Real speed;
    output Real friction_force;
    output Real thrust;
  protected
    Real states[@count_s@];
  algorithm
    states := memory[@first_s@:@memory@];
    @call_outputs@
  end seen;

  function step "One sample on, with inputs that go on through the last ones"
@take_field@
    input Real memory_before[@memory@];
    input Real past[:, INPUTS];
    input Real h(unit = "s") "To the next sample";
    input Real internal_step(unit = "s");
    input Integer order;
    output Real memory[@memory@];
  protected
    Integer n;
    Integer substeps;
    Real cubics[16 * (size(past, 1) - 2)];
  algorithm
    n := size(past, 1) - 3;
    substeps := max(1, -integer(-(h / internal_step - 1e-9)));
    cubics := courses(past, h, order, integer(memory_before[KNOWN] + 0.5));
    memory := next(@given_field@, memory_before, cubics, memory_before[T] - n * h, h, substeps, n, true);
  end step;

  function courses "Inputs of the last intervals, as they go on after each sample"
    input Real past[:, INPUTS];
    input Real h(unit = "s");
    input Integer order;
    input Integer known "Samples before the last one";
    output Real cubics[16 * (size(past, 1) - 2)];
  protected
    Integer place;
    Integer bend;
  algorithm
    cubics := zeros(16 * (size(past, 1) - 2));
    for k in 3:size(past, 1) loop
      bend := min(order, known - size(past, 1) + k);
      for i in 1:INPUTS loop
        place := 16 * (k - 3) + 4 * (i - 1) + 1;
        cubics[place] := past[k, i];
        if bend == 1 then
          cubics[place + 1] := (past[k, i] - past[k - 1, i]) / h;
        end if;
        if bend > 1 then
          cubics[place + 1] := (3.0 * past[k, i] - 4.0 * past[k - 1, i] + past[k - 2, i]) / (2.0 * h);
          cubics[place + 2] := (past[k, i] - 2.0 * past[k - 1, i] + past[k - 2, i]) / (2.0 * h * h);
        end if;
      end for;
    end for;
  end courses;

  function fill_rows "Equal inputs for some samples"
    input Real u[INPUTS];
    input Integer rows;
    output Real past[rows, INPUTS];
  algorithm
    for k in 1:rows loop
      past[k, :] := u;
    end for;
  end fill_rows;

  function pushed "The inputs at the last samples, with those of one more"
    input Real past_before[:, INPUTS];
    input Real u[INPUTS];
    output Real past[size(past_before, 1), INPUTS];
  algorithm
    for k in 2:size(past_before, 1) loop
      past[k - 1, :] := past_before[k, :];
    end for;
    past[size(past_before, 1), :] := u;
  end pushed;
@field_of@
  function simulate "A whole recording: reading, speed, friction and thrust at every sample"
@take@
    input Real cubics[:] "Of the inputs: four coefficients each of four inputs, per interval";
    input Real t(unit = "s") "At the first sample";
    input Real dt(unit = "s") "Between two samples";
    input Integer substeps "Internal steps between them: @substeps@ in the identification";
    input Real motion[3] "Position, speed, and the bristle's deflection or `unknown`";
    input Real run[3] "Number of the recording, running time of the campaign, added mass";
    input Boolean stepping "Whether inputs may differ before and after a sample";
    output Real out[div(size(cubics, 1), 16) + 1, 4];
  protected
    Real memory[@memory@];@local_field@
  algorithm@make_field@
    memory := begin(@given@, cubics, t, dt, substeps, motion, run);
    (out[1, 1], out[1, 2], out[1, 3], out[1, 4]) := seen(@given_field@, memory);
    for k in 1:div(size(cubics, 1), 16) loop
      memory := next(@given_field@, memory, cubics, t, dt, substeps, k - 1, stepping);
      (out[k + 1, 1], out[k + 1, 2], out[k + 1, 3], out[k + 1, 4]) := seen(@given_field@, memory);
    end for;
  end simulate;"""

FIELD_OF = """
  function field_of "Amplitudes of the motor's field, cosines and sines of the windings' steps"
@take@
    output Real field[@table@];
  protected
    Real states[@count_s@];
  algorithm
    states := zeros(@count_s@);
    field := zeros(@table@);
    @call_prepare@
  end field_of;
"""

EXAMPLE = """  model Example "The axis under sines"
    parameter Real amplitude = 1.0 "Of the inputs";
    parameter Real frequency(unit = "Hz") = 1.0;
    Axis axis;
  equation
@drives@
    annotation(experiment(StartTime = 0, StopTime = 1, Interval = @period@));
  end Example;"""
