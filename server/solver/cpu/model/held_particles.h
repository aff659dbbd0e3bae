// What a cloth holds in a step: its pins, and what it grips.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/backend.h"
#include "server/solver/cpu/model/float_model.h"

namespace drape::cpu {

// Views of a model, or of Grips.
struct HeldParticles {
  std::span<const uint32_t> particles;       // the pins, then the grips; both ascending
  std::span<const Vec4> targets;             // of each at the end of the step
  std::span<const uint32_t> free_particles;  // ascending
  std::span<const float> inverse_masses;     // [particle_count] [1/kg], 0 of what is held
  size_t pin_count = 0;                      // of `particles`
  bool has_grips = false;

  // Neither held nor the spare particle.
  bool IsFree(uint32_t i) const { return i < inverse_masses.size() && inverse_masses[i] != 0; }
  // The place in `particles` of one of them.
  size_t PlaceOf(uint32_t i) const {
    const auto pins_end = particles.begin() + static_cast<std::ptrdiff_t>(pin_count);
    const auto pin = std::lower_bound(particles.begin(), pins_end, i);
    const bool is_pin = pin != pins_end && *pin == i;
    const auto place = is_pin ? pin : std::lower_bound(pins_end, particles.end(), i);
    return static_cast<size_t>(place - particles.begin());
  }
  // Whether nothing moves the link or joint between two particles.
  bool AreHeld(uint32_t i, uint32_t j) const {
    return has_grips && inverse_masses[i] == 0 && inverse_masses[j] == 0;
  }
};

// The grips of one cloth. Its model knows nothing of them: links read other inverse masses while
// something is gripped.
class Grips {
 public:
  // What `model` and these grips hold. `pin_targets` [pin_count]. Valid until the next call, as
  // long as the arguments live. Costs nothing without grips, and about as much as reading the
  // inverse masses when other particles are gripped than before.
  HeldParticles Hold(const FloatModel& model, std::span<const Vec4> pin_targets,
                     std::span<const Grip> grips);

 private:
  void Collect(const FloatModel& model);

  const FloatModel* model_ = nullptr;  // that the lists are of
  std::vector<uint32_t> particles_;
  std::vector<Vec4> targets_;
  std::vector<uint32_t> free_particles_;
  std::vector<float> inverse_masses_;
};

}  // namespace drape::cpu
