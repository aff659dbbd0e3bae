// Kernel `resident_step`: one whole step of one cloth, from the committed state to the committed state. One work
// group = one cloth; an invocation takes every LOCAL_SIZE-th particle or constraint, with HAS_STRIP_REDUCTION one
// link of a strip. Stages: find_reach, apply_springs, apply_elastic, apply_wind, predict, solve_elastic,
// solve_hinges, damp_twist, tether, solve_strips, refine, solve_distance, solve_joints, solve_contacts, integrate,
// solve_velocity, correct_velocity, commit (server/solver/method.md). Reads Items, Cloths, Models, Parameters,
// States; writes States, Scratch, Statuses. SI units. With LOOP_BUDGET (drivers that cut long loops,
// server/gl/drivers.md) a dispatch stops before it exceeds that many passes through loops, and the next one
// continues there. The arithmetic is the same.
layout(local_size_x = LOCAL_SIZE) in;  // before what asks for the size of the work group (lanes.glsl)

#include "stages/access_resident.glsl"
#include "stages/apply_springs.glsl"
#include "stages/apply_elastic.glsl"
#include "stages/apply_wind.glsl"
#include "stages/predict.glsl"
#include "stages/solve_elastic.glsl"
#include "stages/solve_hinges.glsl"
#include "stages/damp_twist.glsl"
#include "stages/tether.glsl"
#include "stages/find_reach.glsl"
#include "stages/solve_velocity.glsl"
#include "stages/sweep_resident.glsl"
#include "lib/fault.glsl"

#ifdef HAS_ENERGY_WATCH
#define ENERGY_SUMS DRAPE_RESIDENT_ENERGY_SUMS
// After the last substep the masses are not needed any more: their memory takes the sums.
void SetEnergySum(uint s, vec2 sum) {
  shared_inverse_masses[2u * s] = sum.x;
  shared_inverse_masses[2u * s + 1u] = sum.y;
}
vec2 EnergySum(uint s) { return vec2(shared_inverse_masses[2u * s], shared_inverse_masses[2u * s + 1u]); }
void EndSumPhase() { PhaseBarrier(); }
#include "stages/watch_energy.glsl"
#endif

#ifdef LOOP_BUDGET
layout(location = DRAPE_UNIFORM_PART) uniform uint part;
#endif

// The progress of the step; the same in every invocation.
struct Progress {
  uint substep_index;
  uint sweep;  // of this substep; 0: it has not begun
  uint sweep_count;
  uint unconverged_substeps;
};

#ifdef LOOP_BUDGET
uint used_loops = 0u;

// Whether work of this cost would exceed the budget of the dispatch; if not, it is counted.
bool MustPause(uint cost) {
  if (used_loops + cost > LOOP_BUDGET) return true;
  used_loops += cost;
  return false;
}

Progress LoadProgress(uint status) {
  if (part == 0u) return Progress(0u, 0u, 0u, 0u);
  return Progress(statuses[status].next_substep, statuses[status].next_sweep,
                  statuses[status].iterations, statuses[status].unconverged_substeps);
}

void SaveCloth() {
  FOR_EACH_PARTICLE(i) {
    SetScratchVector(cloth.scratch.work_positions + 3u * i, Position(i));
    SetScratchVector(cloth.scratch.work_velocities + 3u * i, Velocity(i));
#ifdef HAS_TWO_STEPS
    StorePrevious(i, PreviousPosition(i), PreviousVelocity(i));
#endif
#ifdef HAS_REMAINDERS
    StoreRemainders(i, RemaindersOf(i));
#endif
#ifdef HAS_QUIET_LINKS
    scratch[cloth.scratch.quiet_flags + i] = IsQuiet(i) ? 1.0 : 0.0;
#endif
  }
}
#endif

void LoadParticle(uint i) {
  SetInverseMass(i, HeldInverseMass(i));
#if defined(HAS_TETHER) && defined(OWNS_PARTICLE)
  KeepTethers(i);
#endif
#ifdef LOOP_BUDGET
  if (part != 0u) {
    SetPosition(i, ScratchVector(cloth.scratch.work_positions + 3u * i));
    SetVelocity(i, ScratchVector(cloth.scratch.work_velocities + 3u * i));
#ifdef HAS_TWO_STEPS
    SetPrevious(i, StoredPreviousPosition(i), StoredPreviousVelocity(i));
#endif
#ifdef HAS_REMAINDERS
    SetRemainders(i, StoredRemainders(i));
#endif
#ifdef HAS_QUIET_LINKS
    SetQuiet(i, scratch[cloth.scratch.quiet_flags + i] != 0.0);
#endif
    return;
  }
#endif
  SetPosition(i, StateVector(cloth.positions + 3u * i));
  SetVelocity(i, StateVector(cloth.velocities + 3u * i));
#ifdef HAS_TWO_STEPS
  SetPrevious(i, Position(i), Velocity(i));
#endif
#ifdef HAS_REMAINDERS
  SetRemainders(i, NoRemainders());
#endif
}

void LoadCloth(uint status) {
  FOR_EACH_PARTICLE(i) LoadParticle(i);
  if (gl_LocalInvocationID.x == 0u) {
    shared_fault = 0u;
#ifdef HAS_TWO_FRICTIONS
    shared_holds_until = 0u;
#ifdef LOOP_BUDGET
    if (part != 0u) shared_holds_until = statuses[status].holds_until;
#endif
#endif
#ifdef HAS_TOLERANCE
    for (int f = 0; f < 3; ++f) sweep_changed[f] = 0u;
#endif
  }
  PhaseBarrier();
#ifdef KEEPS_LANES
  KeepLanes();
#endif
}

#ifdef HAS_COLLIDER_REACH
shared uint shared_far_colliders;

void FindRange() {
  ClearSharedRange();
  if (gl_LocalInvocationID.x == 0u) shared_far_colliders = 0u;
  PhaseBarrier();
  Spread spread = NoSpread();
  FOR_EACH_PARTICLE(i) SpreadOver(i, spread);
  FOR_EACH(k, 0u, cloth.pin_count) SpreadOverPin(k, spread);
  AddToSharedRange(spread);
  PhaseBarrier();
  range = RangeFrom(shared_range);
}
#endif

// Finds the colliders that the cloth can meet. Later parts of the step read them from the status.
void FindReach(uint status, bool has_begun) {
#ifdef HAS_COLLIDER_REACH
  if (has_begun) {
    LoadReach(status);
    return;
  }
  FindRange();
  FOR_EACH(c, 0u, min(cloth.collider_count, DRAPE_LEFT_OUT_COLLIDERS)) {
    if (!MayMeet(c)) atomicOr(shared_far_colliders, SetOf(c));
  }
  PhaseBarrier();
  far_colliders = shared_far_colliders;
  if (gl_LocalInvocationID.x != 0u) return;
  for (int k = 0; k < DRAPE_RANGE_WORDS; ++k) statuses[status].range[k] = shared_range[k];
  statuses[status].far_colliders = far_colliders;
#endif
}

#if defined(HAS_APPLY_SPRINGS) || defined(HAS_SPRING_FORCES)
void StoreSpringAccelerations(uint place) {
  FOR_EACH_PARTICLE(i) StoreSpringAcceleration(i, place);
  PhaseBarrier();
}
#endif

void ApplySprings(uint place, float seconds) {
#ifdef HAS_APPLY_SPRINGS
  StoreSpringAccelerations(place);
  FOR_EACH_PARTICLE(i) KickParticle(i, seconds);
  PhaseBarrier();
#endif
}

void ApplyElastic(uint place, float seconds) {
#ifdef HAS_APPLY_ELASTIC
  FOR_EACH(e, 0u, cloth.elastic_count) StoreElasticImpulse(e, place, seconds);
  ScratchPhaseBarrier();
  FOR_EACH_PARTICLE(i) ApplyElasticImpulses(i);
  PhaseBarrier();
#endif
}

void ApplyWind(uint place, float seconds) {
#ifdef HAS_APPLY_WIND
  FOR_EACH(t, 0u, cloth.triangle_count) StoreAirImpulse(t, place, seconds);
  ScratchPhaseBarrier();
  FOR_EACH_PARTICLE(i) ApplyAirImpulses(i);
  PhaseBarrier();
#endif
}

// Springs, elastic elements and air act on the velocities before, within or after a substep.
void Kick(uint place) {
  float seconds = KickSeconds(place);
  if (seconds == 0.0) return;
  ApplySprings(place, seconds);
  ApplyElastic(place, seconds);
  ApplyWind(place, seconds);
}

void Predict() {
#ifdef HAS_SPRING_FORCES
  StoreSpringAccelerations(DRAPE_KICK_BEFORE);
#endif
  FOR_EACH_PARTICLE(i) PredictParticle(i);
#ifdef HAS_PINS
  FOR_EACH(k, 0u, cloth.pin_count) PredictPin(k);
#endif
  PhaseBarrier();
#ifdef HAS_TWO_STEPS
  Kick(DRAPE_KICK_WITHIN);
#endif
}

void SolveElastic() {
#ifdef HAS_SOLVE_ELASTIC
  for (uint k = 0u; k < cloth.elastic_family_count; ++k) {
    ElasticFamily family = LoadFamily(k);
    FOR_EACH(line, family.line_begin, family.line_end) SolveElasticLine(family, line);
    if (family.kind == DRAPE_ELASTIC_CELLS) {
      ScratchPhaseBarrier();
      FOR_EACH_PARTICLE(i) ApplyCells(i);
    }
    PhaseBarrier();
  }
#endif
}

void SolveHinges() {
#ifdef HAS_SOLVE_HINGES
  for (uint stage = 0u; stage < cloth.hinge_stage_count; ++stage) {
    FOR_EACH(e, 0u, cloth.elastic_count) StoreHingeImpulse(e);
    ScratchPhaseBarrier();
    FOR_EACH_PARTICLE(i) ApplyHinges(i, stage);
    PhaseBarrier();
  }
#endif
}

void DampTwist() {
#ifdef HAS_DAMP_TWIST
  if (substep.twist_share == 0.0) return;
  FOR_EACH_PARTICLE(i) StoreTwistChange(i);
  PhaseBarrier();
  FOR_EACH_PARTICLE(i) ApplyTwistChange(i);
  PhaseBarrier();
#endif
}

void Tether() {
#ifdef HAS_TETHER
  FOR_EACH_PARTICLE(i) TetherParticle(i);
  PhaseBarrier();
#endif
}

const uint kGoesOn = 0u;
const uint kPaused = 1u;
const uint kConverged = 2u;
const uint kUsedUp = 3u;

// The first sweep is counted together with the substep.
bool MustPauseBefore(uint sweep) {
#ifdef LOOP_BUDGET
  return sweep > 0u && MustPause(cloth.sweep_cost);
#else
  return false;
#endif
}

// Whether it applied an impulse.
bool SweepOnce(inout Progress progress) {
#ifdef HAS_TOLERANCE
  sweep_flag = progress.sweep_count % 3u;
  if (gl_LocalInvocationID.x == 0u) sweep_changed[(sweep_flag + 1u) % 3u] = 0u;
#endif
  Sweep(progress.sweep == 0u, is_last_substep && progress.sweep + 1u == cloth.step.max_iterations);
  ++progress.sweep_count;
#ifdef HAS_TOLERANCE
  // Also the barrier of a sweep without colours and contacts.
  PhaseBarrier();
  return sweep_changed[sweep_flag] != 0u;
#else
  return true;
#endif
}

// Sweeps until none of them changes anything, at most max_iterations. No loop with Progress is left by a return: a
// driver then counts once more (server/gl/drivers.md).
uint Solve(inout Progress progress) {
  SetStepShare(progress.substep_index);
  uint outcome = kGoesOn;
  while (outcome == kGoesOn) {
    if (progress.sweep >= cloth.step.max_iterations) {
      outcome = kUsedUp;
    } else if (MustPauseBefore(progress.sweep)) {
      outcome = kPaused;
    } else if (SweepOnce(progress)) {
      ++progress.sweep;
    } else {
      outcome = kConverged;
    }
  }
  return outcome;
}

#ifdef HAS_SOLVE_VELOCITY
// Sweeps over the velocities that rigid links and joints forbid.
void SolveVelocity() {
  for (uint sweep = 0u; sweep < cloth.step.velocity_iterations; ++sweep) {
    for (uint colour = 0u; colour < cloth.colour_count; ++colour) {
      uint begin = models[cloth.model.colour_offsets + colour];
      uint end = models[cloth.model.colour_offsets + colour + 1u];
      FOR_EACH(k, begin, end) SolveLinkVelocity(k);
      PhaseBarrier();
    }
#ifdef HAS_SOLVE_JOINTS
    for (uint colour = 0u; colour < cloth.joint_colour_count; ++colour) {
      uint begin = models[cloth.model.joint_colour_offsets + colour];
      uint end = models[cloth.model.joint_colour_offsets + colour + 1u];
      FOR_EACH(k, begin, end) SolveJointVelocity(k);
      PhaseBarrier();
    }
#endif
  }
}
#endif

void Integrate() {
  FOR_EACH_PARTICLE(i) {
#ifdef HAS_SOLVE_CONTACTS
    if (is_last_substep) StoreContactViolation(i);
#endif
    IntegrateParticle(i);
#ifndef HAS_SOLVE_VELOCITY
    CorrectVelocity(i);
#endif
  }
#ifdef HAS_SOLVE_VELOCITY
  PhaseBarrier();
  SolveVelocity();
  FOR_EACH_PARTICLE(i) CorrectVelocity(i);
#endif
#ifdef HAS_PINS
  if (is_last_substep) {
    PhaseBarrier();
    FOR_EACH(k, 0u, cloth.pin_count) PlacePin(k);
  }
#endif
  PhaseBarrier();
}

// Whether the old state stays, because the step is to be done again.
bool KeepsStart(uint status) {
#ifdef HAS_ENERGY_WATCH
  bool gains_energy = GainsEnergy();
  if (gl_LocalInvocationID.x == 0u) statuses[status].gained_energy = gains_energy ? 1u : 0u;
  return gains_energy && cloth.step.keeps_start_of_gain != 0u;
#else
  return false;
#endif
}

// The new state replaces the old one unless any particle is beyond the limits.
void Commit(uint status) {
  if (KeepsStart(status)) return;
  FOR_EACH_PARTICLE(i) {
    uint fault = FaultOf(Position(i), Velocity(i));
    if (fault != 0u) atomicOr(shared_fault, fault);
  }
  PhaseBarrier();
  if (shared_fault != 0u) return;
  FOR_EACH_PARTICLE(i) {
    SetStateVector(cloth.positions + 3u * i, Position(i));
    SetStateVector(cloth.velocities + 3u * i, Velocity(i));
  }
}

void StoreStatus(uint status, Progress progress) {
  if (gl_LocalInvocationID.x != 0u) return;
  statuses[status].iterations = progress.sweep_count;
  statuses[status].unconverged_substeps = progress.unconverged_substeps;
  statuses[status].fault = shared_fault;
#ifdef HAS_TWO_FRICTIONS
  statuses[status].holds_until = shared_holds_until;
#endif
  statuses[status].next_substep = progress.substep_index;
  statuses[status].next_sweep = progress.sweep;
}

bool MustPauseBeforeSubstep() {
#ifdef LOOP_BUDGET
  return MustPause(cloth.substep_cost + cloth.sweep_cost);
#else
  return false;
#endif
}

// One substep, or what is left of it; false if it had to pause.
bool RunSubstep(inout Progress progress) {
  BeginSubstep(progress.substep_index);
  if (progress.sweep == 0u) {
    Kick(DRAPE_KICK_BEFORE);
    Predict();
    SolveElastic();
    SolveHinges();
    DampTwist();
    Tether();
  }
  uint outcome = Solve(progress);
  if (outcome == kPaused) return false;
  if (outcome == kUsedUp) ++progress.unconverged_substeps;
  progress.sweep = 0u;
  ++progress.substep_index;
  Integrate();
  Kick(DRAPE_KICK_AFTER);
  return true;
}

// All substeps that are left; false if it had to pause.
bool RunSubsteps(inout Progress progress) {
  bool is_paused = false;
  while (!is_paused && progress.substep_index < cloth.step.substeps) {
    is_paused = MustPauseBeforeSubstep() || !RunSubstep(progress);
  }
  return !is_paused;
}

void main() {
  BatchItem item = items[first_item + gl_WorkGroupID.x];
  OpenRecord(item.cloth);
#ifdef LOOP_BUDGET
  Progress progress = LoadProgress(item.status);
  if (progress.substep_index >= cloth.step.substeps) return;
  MustPause(cloth.fixed_cost);
#else
  Progress progress = Progress(0u, 0u, 0u, 0u);
#endif
  LoadCloth(item.status);
#ifdef LOOP_BUDGET
  FindReach(item.status, part != 0u);
  if (!RunSubsteps(progress)) {
    SaveCloth();
    StoreStatus(item.status, progress);
    return;
  }
#else
  FindReach(item.status, false);
  RunSubsteps(progress);
#endif
  Commit(item.status);
  StoreStatus(item.status, progress);
}
