#include "server/solver/gl_compute/regular_strips.h"

#include <bit>
#include <optional>

namespace drape {

namespace {

std::optional<RegularStrip> FindRegularStrip(const SceneModel& model, uint32_t s) {
  const StripSet& strips = model.strips();
  RegularStrip strip{.link_begin = strips.strip_offsets[s],
                     .link_end = strips.strip_offsets[s + 1]};
  const auto rest_length_of = [&](uint32_t link) {
    return static_cast<float>(model.constraints()[strips.constraints[link]].rest_length_m);
  };
  // The particle before link k is particles[k + s].
  strip.first_particle = strips.particles[strip.link_begin + s];
  strip.stride = strips.particles[strip.link_begin + s + 1] - strip.first_particle;
  strip.rest_length_m = rest_length_of(strip.link_begin);
  for (uint32_t k = strip.link_begin; k < strip.link_end; ++k) {
    const uint32_t way = strips.particles[k + s + 1] - strips.particles[k + s];
    const bool is_as_long =
        std::bit_cast<uint32_t>(rest_length_of(k)) == std::bit_cast<uint32_t>(strip.rest_length_m);
    if (way != strip.stride || !is_as_long) return std::nullopt;
  }
  return strip;
}

}  // namespace

std::vector<RegularStrip> FindRegularStrips(const SceneModel& model) {
  std::vector<RegularStrip> found;
  for (uint32_t s = 0; s < model.strips().strip_count(); ++s) {
    const std::optional<RegularStrip> strip = FindRegularStrip(model, s);
    if (!strip) return {};
    found.push_back(*strip);
  }
  return found;
}

}  // namespace drape
