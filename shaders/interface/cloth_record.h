// Everything a kernel must know of one cloth: sizes, settings, and where its arrays lie. One record
// per slot in the block `Cloths`. Offsets count 4-byte words from the start of the named block.
#ifndef DRAPE_SHADERS_INTERFACE_CLOTH_RECORD_H_
#define DRAPE_SHADERS_INTERFACE_CLOTH_RECORD_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

struct ClothRecord {
  vec4 gravity;  // xyz [m/s^2]; w unused

  uint particle_count;
  uint constraint_count;
  uint colour_count;
  uint pin_count;

  uint collider_count;
  uint has_springs;     // 0 or 1
  uint has_compliance;  // 0 or 1
  uint substeps;        // how many there are: N, with two steps N + 1

  uint max_iterations;  // sweeps per substep
  float h;              // substep [s]
  float half_h;         // h / 2 [s]
  float inverse_h;      // 1 / h [1/s]

  float tolerance;          // relative to the rest length [-]; 0 = a fixed number of sweeps
  float contact_tolerance;  // tolerance * the model's length scale [m]
  float max_depenetration;  // farthest a contact moves a particle out in one substep [m]
  float thickness;          // [m]

  float friction_static;   // [-]
  float friction_dynamic;  // [-]
  float first_kick;        // of springs and air, around the first substep [s]
  float contact_margin;    // gap up to which a contact is counted [m]

  uint is_tiled;  // 0 or 1: how `pairs` is stored
  // Resident plan in parts: upper bounds on the passes through loops of one invocation.
  uint sweep_cost;    // of one sweep
  uint substep_cost;  // of a substep without its sweeps
  uint fixed_cost;    // of loading, pausing and committing

  // In Models.
  uint colour_offsets;  // [colour_count + 1] uint
  uint pairs;         // resident: [constraint_count] i | j << 16; tiled: [constraint_count][2] uint
  uint rest_lengths;  // [constraint_count] float [m]
  uint compliances;   // [constraint_count] float [m/N]; only if has_compliance

  uint masses;          // [particle_count] float [kg], pins included
  uint inverse_masses;  // [particle_count] float [1/kg], 0 for pins
  uint spring_offsets;  // [particle_count + 1] uint; only if has_springs
  uint spring_ends;     // [][DRAPE_SPRING_END_WORDS]; only if has_springs

  uint pins;  // [pin_count] uint, particle indices
  // In States: the committed state.
  uint positions;   // [particle_count][3] float [m]
  uint velocities;  // [particle_count][3] float [m/s]
  // In Parameters.
  uint pin_targets;  // [pin_count][3] float [m]

  uint colliders;  // [collider_count][DRAPE_COLLIDER_WORDS]
  // In Scratch: valid within one step; the last substep's values are read by `measure`.
  uint lambdas;        // [constraint_count] float [N s]; only if has_compliance or has_inequalities
  uint normal_betas;   // [collider_count][particle_count] float [m/s]
  uint tangent_betas;  // [collider_count][3][particle_count] float [m/s]; only with friction

  uint spring_accelerations;  // [particle_count][3] float [m/s^2]; only if has_springs
  uint work_positions;        // [particle_count][3] float [m]; tiled, or resident in parts
  uint work_velocities;       // [particle_count][3] float [m/s]; tiled, or resident in parts
  uint violations;            // [particle_count] float [m]; only with colliders

  uint measured_pieces;  // [measure_piece_count][DRAPE_MEASURED_WORDS] float; only if more than one
  uint measure_piece_count;
  // In Models; only with tethers.
  uint tether_offsets;  // [particle_count + 1] uint
  uint tethers;         // [][DRAPE_TETHER_WORDS]

  // Of the first, second and later substeps (solver/substep_schedule.h); w unused. Without two
  // steps only damping_factors.x is used.
  vec4 intervals;          // H [s]
  vec4 inverse_intervals;  // 1 / H [1/s]
  vec4 damping_factors;    // of velocities [-]
  vec4 inverse_durations;  // [1/s]

  float last_inverse_interval;  // 1 / H of the last substep [1/s]
  // Only with twist damping.
  float twist_share;   // [-]
  uint twist_period;   // substeps
  uint twist_changes;  // in Scratch: [particle_count][3] float [m/s]

  uint grid_columns;
  uint grid_rows;
  // In Scratch; only with two steps.
  uint previous_positions;   // [particle_count][3] float [m]
  uint previous_velocities;  // [particle_count][3] float [m/s]

  // Only with strips (scene/strips.h). In Models, but strip_links.
  uint strip_phase_count;
  uint strip_phases;       // [strip_phase_count + 1] uint
  uint strip_offsets;      // [strip_count + 1] uint
  uint strip_constraints;  // [constraint_count] uint

  uint strip_particles;  // [constraint_count + strip_count] uint
  uint strip_links;      // in Scratch: [constraint_count][DRAPE_STRIP_LINK_WORDS] float
  float end_share;       // of the direction at the end of the substep in that of an impulse [-]
  uint velocity_iterations;

  // All of the air only with drag or lift.
  vec4 wind;  // xyz [m/s]; w unused

  uint triangle_count;
  float air_drag;     // density of the air * coefficient / 4 [kg/m^3]
  float air_lift;     // likewise
  uint air_impulses;  // in Scratch: [triangle_count][3] float [N s], a third of each impulse

  // In Models.
  uint triangles;           // [triangle_count][3] uint
  uint triangle_masses;     // [triangle_count] float [kg]
  uint triangle_offsets;    // [particle_count + 1] uint
  uint particle_triangles;  // [3 * triangle_count] uint

  // Point joints, and distance constraints that are not plain equalities.
  uint joint_count;
  uint joint_colour_count;
  uint has_joint_compliance;  // 0 or 1
  uint has_inequalities;      // 0 or 1

  // In Models.
  uint joint_colour_offsets;  // [joint_colour_count + 1] uint
  uint joint_pairs;           // [joint_count][2] uint
  uint joint_compliances;     // [joint_count] float [m/N]; only if has_joint_compliance
  uint kinds;                 // [constraint_count] DRAPE_KIND_*; only if has_inequalities

  uint joint_lambdas;  // in Scratch: [joint_count][3] float [N s]; only if has_joint_compliance
  // In Parameters: rest lengths of the cloth's own, before the step and at its end.
  uint has_own_lengths;  // 0 or 1
  uint length_starts;    // [constraint_count] float [m]
  uint length_targets;   // [constraint_count] float [m]

  // Only with restitution.
  float restitution;      // [-]
  float slowest_rebound;  // [m/s]
  uint rebounds;          // in Scratch: [collider_count][particle_count] float [m/s]
  // In Parameters: [collider_count][DRAPE_COLLIDER_MOTION_WORDS]; 0: they rest as described.
  uint collider_motions;

  // Only with elastic elements. In Models, but elastic_impulses.
  uint elastic_count;
  uint elastic_elements;  // [elastic_count][DRAPE_ELASTIC_WORDS]
  uint elastic_offsets;   // [particle_count + 1] uint
  uint elastic_ends;      // [][DRAPE_ELASTIC_END_WORDS]

  uint elastic_impulses;  // in Scratch: [elastic_count][3] float [N s]
  // Only with refinement.
  float shortest_sq;   // (1 - strain)^2 [-]: of the links that are far off
  float longest_sq;    // (1 + strain)^2 [-]
  uint refine_rounds;  // at most
  uint refine_solves;  // after which there is no further round

  // In Scratch; tiled only. [particle_count] uint, 1 at the ends of links that are far off; then
  // uint, whether there are any; then [colour_count] uint, how many constraints are refined in this
  // round; then uint, how many have been in rounds before.
  uint far_off_flags;
  uint refined_links;  // [constraint_count] uint, those of each colour from where the colour begins
  // In Scratch; only if colliders are left out: [particle_count] float, a set of colliders as bits,
  // those that `solve_contacts` has worked on in this substep.
  uint met_colliders;

  float reach_margin;  // how far a cloth at rest without gravity is expected to move in a step [m]
  // In Models; only with strips.
  uint strip_lengths;   // [constraint_count] float, rest lengths in the order of strip_constraints
                        // [m]
  uint regular_strips;  // [strip_count][DRAPE_REGULAR_STRIP_WORDS]; only if all strips are regular
  uint padding_0;
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
