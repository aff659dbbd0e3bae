// What a step of cloths that touch themselves knows of them, in single or double precision.
#pragma once

#include <cstdint>
#include <span>

#include "server/solver/self_contact/contact_lists.h"
#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/pair_friction.h"

namespace drape::self_contact {

// What a step needs to know of the cloth, or of all cloths of a world.
template <class V>
struct StepNumbers {
  using Real = ScalarOf<V>;

  Thicknesses<Real> thicknesses{};
  // [member_count]; between two cloths the geometric mean.
  std::span<const FrictionNumbers<Real>> frictions{};
  Real depenetration_speed = 0;  // kMaxDepenetrationSpeed_m_per_s
  Real gravity = 0;              // its length [m/s^2]
  Real slowest_landing = 0;      // SlowestLanding [m/s]
  Real grazing_sine = 0;         // kGrazingSine
  Real touch_round_offs = 0;     // kTouchRoundOffs
  Real edge_length = 0;          // of a typical edge [m]
  Real time_step = 0;            // [s]
  uint32_t substeps = 1;
  bool has_two_steps = false;
  std::span<const Real> inverse_masses;  // [particle_count] [1/kg]
  HeldPulls<V> pulls{};
  Interruption* interruption = nullptr;  // of stages that take long; null: nobody is asked
};

}  // namespace drape::self_contact
