// What kernels know of the impulses that a step is asked for (server/solver/method.md, "Impulses"):
// a record of words in Parameters, and the arrays that it has the places of.
#ifndef DRAPE_SHADERS_INTERFACE_IMPULSE_RECORD_H_
#define DRAPE_SHADERS_INTERFACE_IMPULSE_RECORD_H_

// Its words. In Parameters:
#define DRAPE_IMPULSE_WEIGHTS 0u  // [substeps][2] float: ImpulseWeights [-]
#define DRAPE_IMPULSE_PIVOTS 1u   // [collider_count][3] float, of colliders that rest [m]
// In Models, where vectors are numbered: constraints, then joints, then tethers.
#define DRAPE_IMPULSE_LIST_OFFSETS 2u  // [particle_count + 1] uint
#define DRAPE_IMPULSE_LISTS 3u         // [] uint: vector << 1 | 1 if the particle is its first one
// In Scratch, sums over the step of what acted on particles:
#define DRAPE_IMPULSE_PULLS \
  4u  // [particle_count][3] float: on what is held, by its own invocation [N s]
#define DRAPE_IMPULSE_VECTORS \
  5u  // [][3] float: on the second particle of a link that is held [N s]
// [collider_count][particle_count][6] float: impulse [N s] and its moment about the pivot [N m s]
#define DRAPE_IMPULSE_CONTACTS 6u
// [particle_count][DRAPE_EXACT_WORDS]: on what is held, by pairs, and with
// DRAPE_IMPULSE_HAS_CONTACTS on all; and of zones that end. Only of cloths that touch themselves;
// behind the contacts.
#define DRAPE_IMPULSE_EXACT_PULLS 7u
#define DRAPE_IMPULSE_ZONE_PULLS 8u
#define DRAPE_IMPULSE_SUMS_END 9u  // where all these end
#define DRAPE_IMPULSE_LANES 10u    // [pieces][collider_count][6][DRAPE_IMPULSE_LANE_COUNT][2] float
// For the host: [pieces] of sums over a piece, of what is held [pin_count][6] and of colliders
// [collider_count][12]; then of what is held [pin_count][DRAPE_IMPULSE_HELD_WORDS]. A vector is
// two: what is rounded, and what that has lost.
#define DRAPE_IMPULSE_RESULTS 11u
#define DRAPE_IMPULSE_HAS_EXACT 12u     // 0 or 1: of a cloth that touches itself
#define DRAPE_IMPULSE_ELASTIC_S 13u     // float: SubstepSchedule::largest_force_interval_s2 [s^2]
#define DRAPE_IMPULSE_HAS_CONTACTS 14u  // 0 or 1: what each particle gets is asked for
#define DRAPE_IMPULSE_RECORD_WORDS 15u

// Words of a sum of vectors in fixed point (stages/exact_pulls.glsl).
#define DRAPE_EXACT_WORDS 9u
// Velocity before and after the step xyz [m/s], the words of its exact pulls.
#define DRAPE_IMPULSE_HELD_WORDS 15u
// Sums into which a piece of the particles is added up, whatever the local size.
#define DRAPE_IMPULSE_LANE_COUNT 32u
// Words that a work group clears before the step.
#define DRAPE_IMPULSE_CLEARED_WORDS 16384u

#endif
