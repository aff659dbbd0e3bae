// The result of a step for one cloth; read back once per batch.
#ifndef DRAPE_SHADERS_INTERFACE_CLOTH_STATUS_H_
#define DRAPE_SHADERS_INTERFACE_CLOTH_STATUS_H_

#include "shaders/interface/bindings.h"

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

struct ClothStatus {
  uint iterations;            // sweeps over all substeps
  uint unconverged_substeps;  // substeps that used max_iterations without meeting the tolerance
  uint fault;                 // DRAPE_FAULT_* bits; not 0: the state was kept
  uint sweep_changed;         // tiled plan: this sweep applied an impulse

  uint is_substep_done;  // tiled plan: no more sweeps in this substep
  uint contacts;         // these, to max_residual, by `measure` alone
  float max_strain;      // [-]
  float rms_strain;      // [-]

  float kinetic_energy;    // [J]
  float potential_energy;  // [J]
  float strain_energy;     // [J]
  float lowest;            // [m]

  float max_penetration;  // [m]
  float max_residual;     // [m]
  uint next_substep;      // resident plan in parts: where the next part continues
  uint next_sweep;        // 0: the substep has not begun

  float strain_p50;  // [-]; percentiles, by `measure_strains` alone
  float strain_p90;  // [-]
  float strain_p99;  // [-]
  float rms_motion;  // [m]; by `measure` alone

  uint gained_energy;  // more than it may; only with the watch of energy

  // Only if colliders are left out.
  uint range[DRAPE_RANGE_WORDS];  // of the particles when the step begins
  uint far_colliders;             // bits: colliders that no particle in the range touches

  // Only with self-collision.
  uint contact_pairs;      // the most pairs that a search has found
  uint contacts_failed;    // pins may have forced a pair through itself
  uint contacts_given_up;  // all particles moved alike in some substep
  uint most_sweeps;        // of the substep, after the last sweep over the pairs
  uint hit_sweeps;         // beyond max_iterations, over all substeps

  // Only with two frictions: 1 + the last substep in which some contact holds by friction.
  uint holds_until;
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
