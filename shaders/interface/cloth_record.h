// Everything that a kernel knows of one cloth: sizes, numbers of the step, and the places of its
// arrays. One record per slot in the block `Cloths`.
#ifndef DRAPE_SHADERS_INTERFACE_CLOTH_RECORD_H_
#define DRAPE_SHADERS_INTERFACE_CLOTH_RECORD_H_

#include "shaders/interface/layouts.h"
#include "shaders/interface/substep_record.h"

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// The settings and parameters of the cloth in the units of the kernels.
struct StepNumbers {
  vec4 gravity;  // xyz [m/s^2]; w unused
  vec4 wind;     // xyz [m/s]; w unused; only with air forces

  uint substeps;  // N, with two steps N + 1
  uint max_iterations;
  uint velocity_iterations;
  float h;          // substep [s]
  float inverse_h;  // [1/s]

  float tolerance;          // relative to the rest length [-]; 0 = a fixed number of sweeps
  float contact_tolerance;  // tolerance * the model's length scale [m]
  float end_share;          // weight of the end-of-substep direction in an impulse's direction [-]

  float thickness;          // [m]
  float friction_static;    // [-]
  float friction_dynamic;   // [-]
  float restitution;        // [-]; only with restitution
  float slowest_rebound;    // [m/s]; only with restitution
  float slowest_landing;    // [m/s]
  float max_depenetration;  // largest motion out of a collider in one substep [m]
  float contact_margin;     // gap up to which a contact is counted [m]
  float reach_margin;       // expected motion in a step of a cloth at rest without gravity [m]

  float air_drag;  // density of the air * drag coefficient / 4 [kg/m^3]
  float air_lift;  // density of the air * lift coefficient / 4 [kg/m^3]

  // Only with refinement.
  float shortest_sq;   // (1 - strain)^2 [-]: shorter links are refined
  float longest_sq;    // (1 + strain)^2 [-]: longer links are refined
  uint refine_rounds;  // at most
  uint refine_solves;  // no further round after these

  float max_elastic_frequency_sq;  // [1/s^2] faster elastic elements act as if they were not

  // Only with the watch of energy (solver/energy_watch.h).
  float energy_constant;     // [J]
  float energy_lag_root;     // [J^1/2]
  uint keeps_start_of_gain;  // a step that gains too much is not committed: it is done again

  uint self_contacts;  // in Parameters: a SelfContactRecord; only with self-collision
};

struct ClothRecord {
  StepNumbers step;
  SubstepRecord substeps[DRAPE_SUBSTEP_KINDS];

  ModelLayout model;
  ParameterLayout parameters;
  ScratchLayout scratch;
  // In States: the committed state.
  uint positions;   // [particle_count][3] float [m]
  uint velocities;  // [particle_count][3] float [m/s]

  uint particle_count;
  uint pin_count;  // with grips, be they open or not
  uint has_grips;
  uint constraint_count;
  uint colour_count;
  uint joint_count;
  uint joint_colour_count;
  uint elastic_count;
  uint elastic_family_count;  // 0 without solve_elastic
  uint hinge_stage_count;     // 0 without solve_hinges
  uint hinge_period;          // substeps that share the forces of hinges
  uint triangle_count;        // 0 without air forces
  uint strip_phase_count;
  float span_give;  // by which diagonals of spans are larger [-]; only with spans that give
  // Levels of reduction: of strips from both ends before the elimination, and those after which
  // every equation is alone.
  uint strip_levels;
  uint strip_all_levels;
  uint grid_columns;
  uint grid_rows;
  uint collider_count;
  uint measure_piece_count;

  // 0 or 1; for kernels that take cloths of all variants.
  uint is_tiled;  // how `pairs` is stored
  uint has_springs;
  uint has_compliance;
  uint has_joint_compliance;
  uint has_inequalities;
  uint has_own_lengths;
  uint has_moving_colliders;
  uint watches_stores;  // EnergyLimit; only with the watch of energy

  // Resident plan in parts: upper bounds on the passes through loops of one invocation.
  uint sweep_cost;    // of one sweep
  uint substep_cost;  // of a substep without its sweeps
  uint fixed_cost;    // of loading, pausing and committing

  uint impulses;  // in Parameters: [DRAPE_IMPULSE_RECORD_WORDS]; only of a step that tells them
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
