// The places of the arrays of one cloth, in 4-byte words from the start of the named block.
#ifndef DRAPE_SHADERS_INTERFACE_LAYOUTS_H_
#define DRAPE_SHADERS_INTERFACE_LAYOUTS_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// In Models: constant, shared by all cloths of the model.
struct ModelLayout {
  uint colour_offsets;  // [colour_count + 1] uint
  uint pairs;         // resident: [constraint_count] i | j << 16; tiled: [constraint_count][2] uint
  uint rest_lengths;  // [constraint_count] float [m]
  uint compliances;   // [constraint_count] float [m/N]; only if has_compliance
  uint kinds;         // [constraint_count] DRAPE_KIND_*; only if has_inequalities
  uint joint_colour_offsets;  // [joint_colour_count + 1] uint
  uint joint_pairs;           // [joint_count][2] uint
  uint joint_compliances;     // [joint_count] float [m/N]; only if has_joint_compliance
  uint masses;                // [particle_count] float [kg], pins included
  uint inverse_masses;        // [particle_count] float [1/kg], 0 for pins
  uint pins;                  // [pin_count] uint, particle indices
  // Only with springs.
  uint spring_offsets;  // [particle_count + 1] uint
  uint spring_ends;     // [][DRAPE_SPRING_END_WORDS]
  // Only with elastic elements.
  uint elastic_elements;  // [elastic_count][DRAPE_ELASTIC_WORDS]
  uint elastic_offsets;   // [particle_count + 1] uint
  uint elastic_ends;      // [][DRAPE_ELASTIC_END_WORDS]
  uint elastic_families;  // [elastic_family_count][DRAPE_ELASTIC_FAMILY_WORDS]
  uint elastic_lines;     // [][DRAPE_ELASTIC_LINE_WORDS]
  // Only with tethers.
  uint tether_offsets;  // [particle_count + 1] uint
  uint tethers;         // [][DRAPE_TETHER_WORDS]
  // Strips (scene/strips.h).
  uint strip_phases;       // [strip_phase_count + 1] uint
  uint strip_offsets;      // [strip_count + 1] uint
  uint strip_constraints;  // [constraint_count] uint
  uint strip_particles;    // [constraint_count + strip_count] uint
  uint strip_lengths;      // [constraint_count] float [m], in the order of strip_constraints
  uint strip_spans;        // the same, 1 or 0: of a span (FindSpans); only if there is one
  // Only where strips are solved from both ends (stages/meet_strips.glsl).
  uint strip_ends;  // of each link in that order the particles before and after it, as `pairs`
  uint strip_rows;  // [constraint_count] its place in the strip | the strip's links - 1 << 10 |
                    // its row << 20
  uint strip_phase_blocks;  // [strip_phase_count + 1] uint
  uint strip_blocks;        // [block_count + 1] uint, first strips
  // Only where groups of lanes solve strips (stages/reduce_strips.glsl).
  uint strip_phase_lanes;  // [strip_phase_count + 1] uint, first lanes
  uint strip_lanes;        // [][DRAPE_STRIP_LANE_WORDS] the words of each lane
  uint regular_strips;  // [strip_count][DRAPE_REGULAR_STRIP_WORDS]; only if all strips are regular
  // Only with air forces.
  uint triangles;           // [triangle_count][3] uint
  uint triangle_masses;     // [triangle_count] float [kg]
  uint corner_shares;       // [particle_count] float
  uint triangle_offsets;    // [particle_count + 1] uint
  uint particle_triangles;  // [3 * triangle_count] uint
};

// In Parameters: the values that change between steps.
struct ParameterLayout {
  uint pin_targets;  // [pin_count][3] float [m], those of grips behind those of pins
  // Only if the cloth has grips:
  uint held;  // [pin_count] uint, particles of the pins and grips; DRAPE_NO_PARTICLE: open
  uint inverse_masses;  // [particle_count] float [1/kg], 0 of what is held
  uint colliders;       // [collider_count][DRAPE_COLLIDER_WORDS]
  // [collider_count][DRAPE_COLLIDER_MOTION_WORDS]; only with moving colliders
  uint collider_motions;
  // Rest lengths of the cloth's own before the step and at its end; only if has_own_lengths.
  uint length_starts;    // [constraint_count] float [m]
  uint length_targets;   // [constraint_count] float [m]
  uint elastic_entries;  // [][DRAPE_ELASTIC_ENTRY_WORDS]; only with solve_elastic
  uint hinge_stages;     // [hinge_stage_count][2] float: momentum and gain [-]
};

// In Scratch: valid within one step. `measure` reads the values of the last substep.
struct ScratchLayout {
  uint lambdas;        // [constraint_count] float [N s]; only if has_compliance or has_inequalities
  uint joint_lambdas;  // [joint_count][3] float [N s]; only if has_joint_compliance
  uint normal_betas;   // [collider_count][particle_count] float [m/s]
  uint tangent_betas;  // [collider_count][3][particle_count] float [m/s]; only with friction
  uint rebounds;       // [collider_count][particle_count] float [m/s]; only with restitution
  // [collider_count][particle_count] float [m^2/s^2]: the square of how fast what has a beta slid
  // when the substep began, below 0 if it lands; only with two frictions
  uint slidings;
  uint violations;  // [particle_count] float [m]; only with colliders
  // [particle_count] float: the colliders, as bits, that have pushed the particle in this substep;
  // only with colliders
  uint met_colliders;
  uint spring_accelerations;  // [particle_count][3] float [m/s^2]; only with springs
  uint elastic_impulses;      // [elastic_count][impulses_per_element][3] float [N s]
  uint
      elastic_solutions;  // [particle_count][DRAPE_ELASTIC_SOLUTION_WORDS]; only with solve_elastic
  uint hinge_changes;     // [particle_count][3] float [m/s]; only with solve_hinges
  uint air_impulses;      // [triangle_count][3] float [N s], a third of each impulse
  uint previous_positions;   // [particle_count][3] float [m]; only with two steps
  uint previous_velocities;  // [particle_count][3] float [m/s]; only with two steps
  uint remainders;     // [particle_count][2][3] float [m]: now, previous; only with remainders
  uint twist_changes;  // [particle_count][3] float [m/s]; only with twist damping
  uint strip_links;    // [constraint_count][DRAPE_STRIP_LINK_WORDS] float; only with strips
  // The refinement of tiled cloths. [particle_count] uint, 1 at the ends of links to refine; then
  // uint, whether there are any; then [colour_count] uint, the constraints that this round refines;
  // then uint, those of earlier rounds.
  uint stretched_flags;
  uint refined_links;  // [constraint_count] uint, those of each colour where the colour begins
  // Tiled, or resident in parts.
  uint work_positions;   // [particle_count][3] float [m]
  uint work_velocities;  // [particle_count][3] float [m/s]
  uint quiet_flags;      // [particle_count] float, 1 or 0; only with quiet links
  uint start_positions;  // [particle_count][3] float [m]; if the step is measured, where it began
  uint measured_pieces;  // [measure_piece_count][DRAPE_MEASURED_WORDS] float; only if more than one
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
