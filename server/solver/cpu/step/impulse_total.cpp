#include "server/solver/cpu/step/impulse_total.h"

#include <cmath>
#include <cstdint>
#include <utility>

#include "server/scene/colliders.h"

namespace drape::cpu {

using Eigen::Vector3d;

void ExactSum::Add(Vec4 vector) {
  for (int axis = 0; axis < 3; ++axis) {
    const double value = double{vector[axis]} * kUnit;
    // What is no number, or too large, is a fault of the step, which tells no impulses.
    if (std::abs(value) < 0x1p63) {
      sums_[axis] += static_cast<int64_t>(value);  // the same in less time
    } else if (std::abs(value) < 0x1p100) {
      sums_[axis] += static_cast<Wide>(value);
    }
  }
}

Vector3d ExactSum::Value() const {
  return {static_cast<double>(sums_[0]) / kUnit, static_cast<double>(sums_[1]) / kUnit,
          static_cast<double>(sums_[2]) / kUnit};
}

StepImpulses ImpulseTotal::Take(const FloatState& start) {
  const StepContext& context = context_;
  StepImpulses total;
  total.colliders.resize(context.controls.colliders.size());
  const std::span<const uint32_t> near = context.scratch.reach.near;
  for (size_t k = 0; k < near.size(); ++k) {
    total.colliders[near[k]] = {-impulses_[k].Value(), -moments_[k].Value()};
  }
  const FloatState& end = context.scratch.state;
  const HeldParticles& held = context.held;
  const Vector3d fall = double{context.controls.time_step} * ToVector3d(context.controls.gravity);
  for (size_t k = 0; k < held.particles.size(); ++k) {
    const uint32_t i = held.particles[k];
    const Vector3d change = ToVector3d(end.velocities[i]) - ToVector3d(start.velocities[i]);
    const Vector3d impulse =
        pulls_[k].Value() + context.model.source->masses_kg()[i] * Vector3d(fall - change);
    if (k < context.model.pins.size()) {
      total.pins_n_s.push_back(impulse);
    } else {
      total.grips_n_s.push_back(impulse);
      total.gripped_particles.push_back(i);
    }
  }
  if (context.asks_for_contacts) {
    SortContacts(contacts_);
    total.contacts = std::move(contacts_);
  }
  return total;
}

std::vector<Vec4> PivotsAt(const StepContext& context, std::span<const uint32_t> colliders,
                           double end_s) {
  std::vector<Vec4> pivots;
  for (const uint32_t c : colliders) {
    pivots.push_back(ToVec4(context.collider_motions.empty()
                                ? CentreOf(context.colliders[c])
                                : context.collider_motions[c].After(end_s).position_m));
  }
  return pivots;
}

}  // namespace drape::cpu
