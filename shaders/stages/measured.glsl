// Partial results of `measure`, and the merge of two of them.
#ifndef DRAPE_STAGES_MEASURED_GLSL_
#define DRAPE_STAGES_MEASURED_GLSL_

#include "stages/buffers.glsl"
#include "lib/compensated_sum.glsl"

struct Measured {
  vec2 strain_sq;         // compensated sums: see lib/compensated_sum.glsl
  vec2 motion_sq;         // [m^2]
  vec2 kinetic;           // [J]
  vec2 potential;         // [J]
  vec2 elastic;           // [J]
  float max_strain;       // [-]
  float lowest;           // [m]
  float max_penetration;  // [m]
  float max_residual;     // [m]
  uint contacts;
};

Measured NothingMeasured() {
  return Measured(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0.0, kLargestFloat, 0.0, 0.0, 0u);
}

vec2 MergeSums(vec2 a, vec2 b) { return AddCompensated(AddCompensated(a, b.x), b.y); }

Measured MergeMeasured(Measured a, Measured b) {
  a.strain_sq = MergeSums(a.strain_sq, b.strain_sq);
  a.motion_sq = MergeSums(a.motion_sq, b.motion_sq);
  a.kinetic = MergeSums(a.kinetic, b.kinetic);
  a.potential = MergeSums(a.potential, b.potential);
  a.elastic = MergeSums(a.elastic, b.elastic);
  a.max_strain = max(a.max_strain, b.max_strain);
  a.lowest = min(a.lowest, b.lowest);
  a.max_penetration = max(a.max_penetration, b.max_penetration);
  a.max_residual = max(a.max_residual, b.max_residual);
  a.contacts += b.contacts;
  return a;
}

shared Measured measured_by_invocation[LOCAL_SIZE];

// The merge of all invocations' values down one fixed tree; valid in invocation 0. In uniform control
// flow.
Measured MergeInvocations(Measured measured) {
  uint lane = gl_LocalInvocationID.x;
  measured_by_invocation[lane] = measured;
  for (uint half_size = LOCAL_SIZE / 2u; half_size > 0u; half_size /= 2u) {
    memoryBarrierShared();
    barrier();
    if (lane < half_size) {
      measured_by_invocation[lane] = MergeMeasured(measured_by_invocation[lane], measured_by_invocation[lane + half_size]);
    }
  }
  // The others must not read what invocation 0 has just written.
  return lane == 0u ? measured_by_invocation[0] : measured;
}

// The place in Scratch where the result of one piece of a cloth waits to be merged.
uint PieceWord(uint piece) { return cloth.scratch.measured_pieces + DRAPE_MEASURED_WORDS * piece; }

void StorePiece(uint piece, Measured measured) {
  uint word = PieceWord(piece);
  scratch[word] = measured.strain_sq.x;
  scratch[word + 1u] = measured.strain_sq.y;
  scratch[word + 2u] = measured.motion_sq.x;
  scratch[word + 3u] = measured.motion_sq.y;
  scratch[word + 4u] = measured.kinetic.x;
  scratch[word + 5u] = measured.kinetic.y;
  scratch[word + 6u] = measured.potential.x;
  scratch[word + 7u] = measured.potential.y;
  scratch[word + 8u] = measured.elastic.x;
  scratch[word + 9u] = measured.elastic.y;
  scratch[word + 10u] = measured.max_strain;
  scratch[word + 11u] = measured.lowest;
  scratch[word + 12u] = measured.max_penetration;
  scratch[word + 13u] = measured.max_residual;
  scratch[word + 14u] = float(measured.contacts);  // exact: a piece has at most 2048 particles
}

Measured LoadPiece(uint piece) {
  uint word = PieceWord(piece);
  return Measured(vec2(scratch[word], scratch[word + 1u]),
                  vec2(scratch[word + 2u], scratch[word + 3u]),
                  vec2(scratch[word + 4u], scratch[word + 5u]),
                  vec2(scratch[word + 6u], scratch[word + 7u]),
                  vec2(scratch[word + 8u], scratch[word + 9u]), scratch[word + 10u],
                  scratch[word + 11u], scratch[word + 12u], scratch[word + 13u],
                  uint(scratch[word + 14u]));
}

void StoreMeasured(uint status, Measured measured) {
  float constraint_count = float(max(cloth.constraint_count, 1u));
  statuses[status].contacts = measured.contacts;
  statuses[status].max_strain = measured.max_strain;
  statuses[status].rms_strain =
      sqrt((measured.strain_sq.x + measured.strain_sq.y) / constraint_count);
  statuses[status].rms_motion =
      sqrt((measured.motion_sq.x + measured.motion_sq.y) / float(cloth.particle_count));
  statuses[status].kinetic_energy = measured.kinetic.x + measured.kinetic.y;
  statuses[status].potential_energy = measured.potential.x + measured.potential.y;
  statuses[status].strain_energy = measured.elastic.x + measured.elastic.y;
  statuses[status].lowest = measured.lowest;
  statuses[status].max_penetration = measured.max_penetration;
  statuses[status].max_residual = measured.max_residual;
}

#endif
