#include "server/solver/cpu/model/held_particles.h"

#include <algorithm>

#include "server/core/check.h"

namespace drape::cpu {

HeldParticles Grips::Hold(const FloatModel& model, std::span<const Vec4> pin_targets,
                          std::span<const Grip> grips) {
  if (grips.empty()) {
    return {model.pins,           pin_targets,       model.free_particles,
            model.inverse_masses, model.pins.size(), false};
  }
  targets_.assign(pin_targets.begin(), pin_targets.end());
  for (const Grip& grip : grips) targets_.push_back(ToVec4(grip.target_m));
  const std::span<const uint32_t> gripped =
      model_ == &model ? std::span<const uint32_t>(particles_).subspan(model.pins.size())
                       : std::span<const uint32_t>();
  if (!std::ranges::equal(gripped, grips, {}, {}, &Grip::particle)) {
    particles_ = model.pins;
    for (const Grip& grip : grips) particles_.push_back(grip.particle);
    Collect(model);
  }
  return {particles_, targets_, free_particles_, inverse_masses_, model.pins.size(), true};
}

void Grips::Collect(const FloatModel& model) {
  model_ = &model;
  inverse_masses_ = model.inverse_masses;
  for (size_t k = model.pins.size(); k < particles_.size(); ++k) {
    float& inverse_mass = inverse_masses_.at(particles_[k]);
    DRAPE_CHECK(inverse_mass != 0, "a grip holds what is free, and each particle once");
    inverse_mass = 0;
  }
  free_particles_.clear();
  for (const uint32_t i : model.free_particles) {
    if (inverse_masses_[i] != 0) free_particles_.push_back(i);
  }
}

}  // namespace drape::cpu
